//! One scene small and large, near and far.

use glam::DVec3;

use super::{
    Case, Examiner, Measurement,
    examiner::{DIRECT_BOUND, KERNEL_BOUND},
    scenes::{COLOURED, GREY, cuboid, moved, point_light, room, scene_of},
};
use crate::{Result, Scene, output::Layer, scene::Lens};

pub(super) const CASES: &[Case] = &[
    Case {
        name: "scene_of_a_millimetre",
        hazard: "distances squared twice leave the range of f32; constants in metres are larger than the scene",
        remedy: "the device computes in a space of about 1, scaled by a power of two in f64",
        is_short: true,
        known_issue: None,
        run: |examiner| scaled_room(examiner, 0.0005),
    },
    Case {
        name: "scene_of_ten_kilometres",
        hazard: "the same at the other end: biases of a millimetre are nothing, and powers of 1e-16 remain",
        remedy: "the same space, and every bias a share of it",
        is_short: true,
        known_issue: None,
        run: |examiner| scaled_room(examiner, 5000.0),
    },
    Case {
        name: "scene_a_hundred_kilometres_away",
        hazard: "f32 coordinates at 1e5 m have steps of 8 mm",
        remedy: "the origin moves to the scene in f64 before anything is rounded",
        is_short: false,
        known_issue: None,
        run: |examiner| room_at(examiner, 1e5),
    },
    Case {
        name: "scene_ten_thousand_kilometres_away",
        hazard: "f32 coordinates at 1e7 m have steps of 1 m",
        remedy: "the origin moves to the scene in f64 before anything is rounded",
        is_short: true,
        known_issue: None,
        run: |examiner| room_at(examiner, 1e7),
    },
    Case {
        name: "tunnel_of_a_kilometre",
        hazard: "a box of 2 m in two directions and 1 km in the third: what is a share of the scene's size is large across",
        remedy: "shares of 1e-6: 0.7 mm",
        is_short: true,
        known_issue: None,
        run: tunnel,
    },
    Case {
        name: "near_and_far_a_millionfold_apart",
        hazard: "a depth buffer between 2 mm and 2 km has no digits left for one of them",
        remedy: "reversed depth in f32 only sorts; places come from the triangles' planes",
        is_short: true,
        known_issue: None,
        run: |examiner| near_and_far(examiner, DVec3::ZERO),
    },
    Case {
        name: "near_and_far_off_the_middle_of_the_scene",
        hazard: "half a kilometre from the origin of a scene of 2 km, f32 has steps of 0.03 mm: 3 % of a block of 1 mm",
        remedy: "nothing: places are kept to 6e-8 of half the scene's size",
        is_short: true,
        known_issue: Some(
            "corners of triangles are kept in f32 about the middle of the whole scene, and not of what the camera is near to",
        ),
        run: |examiner| near_and_far(examiner, DVec3::new(517.3, -231.7, 393.1)),
    },
    Case {
        name: "shadows_of_a_millimetre_in_two_kilometres",
        hazard: "a bias that is a share of the scene is larger than what throws the shadow",
        remedy: "nothing: a ray starts 24 roundings of half the scene's size off its surface",
        is_short: true,
        known_issue: Some(
            "what is nearer to a surface than 1.4e-6 of half the scene's size, here 1.4 mm, throws no shadow on it",
        ),
        run: near_shadows,
    },
];

fn scaled_room(examiner: &mut Examiner, scale: f64) -> Result<Measurement> {
    let scene = moved(&room(), scale, DVec3::ZERO);
    examiner.all("room", &scene, 24)
}

/// Against the reference of the room where it was: in f64, 1e7 m leave steps of 2e-9 m.
fn room_at(examiner: &mut Examiner, distance_m: f64) -> Result<Measurement> {
    let here = room();
    let there = moved(&here, 1.0, distance_m * DVec3::new(1.0, -0.62, 0.37));
    let mut parts = vec![
        examiner.sums("room", &there, 24, KERNEL_BOUND)?,
        examiner.bounce("room", &there)?,
    ];
    for layer in [Layer::Direct, Layer::Depth, Layer::Range, Layer::Normal] {
        parts.push(examiner.layer("room", &there, (&here, layer), DIRECT_BOUND)?);
    }
    Ok(Measurement::of(parts))
}

/// Camera and light at one end, on opposite sides of a block.
fn tunnel(examiner: &mut Examiner) -> Result<Measurement> {
    let tube = cuboid(
        "tube",
        DVec3::new(-1.0, -1.0, -1.0),
        DVec3::new(2.0, 2.0, 1000.0),
        GREY,
    );
    let block = cuboid(
        "block",
        DVec3::new(-0.5, -1.0, 2.0),
        DVec3::new(0.8, 0.7, 0.5),
        COLOURED,
    );
    let light = point_light(DVec3::new(0.3, 0.6, 4.0));
    let scene = scene_of(
        vec![tube, block],
        light,
        DVec3::new(0.1, 0.2, -0.6),
        3.0 * DVec3::Z,
    );
    // Half the scene's size is 500 m: f32 keeps places there to 3e-5 m, over distances of 1 m and more, which count squared.
    let bound = DIRECT_BOUND + 2.0 * 3e-5;
    Ok(Measurement::of([
        examiner.direct("1 km", &scene, bound)?,
        examiner.direct_by_map("1 km", &scene, bound)?,
        examiner.sums("1 km", &scene, 24, KERNEL_BOUND)?,
        examiner.bounce("1 km", &scene)?,
    ]))
}

/// Blocks of 1 mm at 2 mm from the camera, in a hall of 2 km.
fn blocks_in_a_hall(eye_m: DVec3, light_mm: DVec3) -> Scene {
    let at = |mm: DVec3| eye_m + 1e-3 * mm;
    let block = |name: &str, corner_mm: DVec3, size_mm: DVec3| {
        cuboid(name, at(corner_mm), 1e-3 * size_mm, COLOURED)
    };
    let meshes = vec![
        cuboid("hall", DVec3::splat(-1e3), DVec3::splat(2e3), GREY),
        block("near", DVec3::new(-1.3, -0.9, -2.7), DVec3::ONE),
        block(
            "nearer",
            DVec3::new(0.2, -0.3, -2.4),
            DVec3::new(0.4, 0.8, 0.3),
        ),
    ];
    let mut scene = scene_of(meshes, point_light(at(light_mm)), eye_m, at(-DVec3::Z));
    scene.camera.lens = Lens::FovY { fov_y_deg: 60.0 };
    scene
}

fn near_and_far(examiner: &mut Examiner, eye_m: DVec3) -> Result<Measurement> {
    let scene = blocks_in_a_hall(eye_m, DVec3::new(0.9, 1.1, 0.3));
    let what = "blocks of 1 mm in 2 km";
    Ok(Measurement::of([
        examiner.direct(what, &scene, DIRECT_BOUND)?,
        examiner.depth(what, &scene, DIRECT_BOUND)?,
        examiner.sums(what, &scene, 16, KERNEL_BOUND)?,
    ]))
}

/// The light throws the shadow of one block on the side of the other.
fn near_shadows(examiner: &mut Examiner) -> Result<Measurement> {
    let scene = blocks_in_a_hall(DVec3::ZERO, DVec3::new(1.4, 0.3, -2.2));
    let what = "blocks of 1 mm in 2 km";
    Ok(Measurement::of([
        examiner.direct(what, &scene, DIRECT_BOUND)?,
        examiner.direct_by_map(what, &scene, DIRECT_BOUND)?,
        examiner.bounce(what, &scene)?,
    ]))
}
