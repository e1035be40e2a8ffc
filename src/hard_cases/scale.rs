//! The same scene small and large, near the origin and far from it.

use glam::{DVec3, dvec3};

use super::{
    Case, Examiner,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, values},
    scenes::{COLOURED, GREY, cuboid, moved, point_light, room, scene_of},
};
use crate::{
    Result, Scene,
    output::{Frame, Layer},
    scene::Lens,
};

pub const CASES: &[Case] = &[
    Case::new(
        "scene_of_a_millimetre",
        "squared distances, squared again, leave the range of f32; constants in metres are larger than the scene",
        "the device computes in a space of size about 1, scaled by a power of two in f64",
        |exam| exam.all("room", &moved(&room(), 0.0005, DVec3::ZERO)),
    ),
    Case::new(
        "scene_of_ten_kilometres",
        "the opposite extreme: biases of a millimetre vanish, and powers of 1e-16 remain",
        "the same space; every bias is a fraction of it",
        |exam| exam.all("room", &moved(&room(), 5000.0, DVec3::ZERO)),
    ),
    Case::new(
        "scene_a_hundred_kilometres_away",
        "f32 coordinates at 1e5 m have steps of 8 mm",
        "the origin moves to the scene in f64 before anything is rounded",
        |exam| room_at(exam, 1e5),
    )
    .long(),
    Case::new(
        "scene_ten_thousand_kilometres_away",
        "f32 coordinates at 1e7 m have steps of 1 m",
        "the origin moves to the scene in f64 before anything is rounded",
        |exam| room_at(exam, 1e7),
    ),
    Case::new(
        "tunnel_of_a_kilometre",
        "a box of 2 m in two directions and 1 km in the third: a fraction of the scene's size is large across it",
        "fractions of 1e-6: 0.7 mm",
        tunnel,
    ),
    Case::new(
        "near_and_far_a_millionfold_apart",
        "a depth buffer from 2 mm to 2 km has no digits left at one end",
        "reversed depth in f32 only sorts; positions come from the triangles' planes",
        |exam| near_and_far(exam, DVec3::ZERO),
    ),
    Case::new(
        "near_and_far_off_the_middle_of_the_scene",
        "half a kilometre from the origin of a scene of 2 km, f32 has steps of 0.03 mm: 3 % of a block of 1 mm",
        "nothing: positions are exact to 6e-8 of half the scene's size",
        |exam| near_and_far(exam, dvec3(517.3, -231.7, 393.1)),
    )
    .with_known_issue("f32 corners of triangles are relative to the middle of the whole scene, not to the camera's surroundings"),
    Case::new(
        "shadows_of_a_millimetre_in_two_kilometres",
        "a bias that is a fraction of the scene is larger than the object that throws the shadow",
        "nothing: a ray starts 24 roundings of half the scene's size off its surface",
        near_shadows,
    )
    .with_known_issue("an object nearer to a surface than 1.4e-6 of half the scene's size, here 1.4 mm, throws no shadow on it"),
];

/// Compares with the reference of the room at its original position: at 1e7 m, f64 has steps of 2e-9 m.
fn room_at(exam: &mut Examiner, distance_m: f64) -> Result<()> {
    let here = room();
    let there = moved(&here, 1.0, distance_m * dvec3(1.0, -0.62, 0.37));
    exam.sums("room", &there, 24, KERNEL_BOUND)?;
    exam.bounce("room", &there)?;
    for layer in [Layer::Direct, Layer::Depth, Layer::Range, Layer::Normal] {
        let error = exam.error_against(&exam.unsampled(&here)?, &there, layer)?;
        exam.record("room", layer.name(), error, DIRECT_BOUND);
    }
    Ok(())
}

/// Camera and light are at one end, on opposite sides of a block.
fn tunnel(exam: &mut Examiner) -> Result<()> {
    let tube = cuboid("tube", DVec3::splat(-1.0), dvec3(2.0, 2.0, 1000.0), GREY);
    let block = cuboid(
        "block",
        dvec3(-0.5, -1.0, 2.0),
        dvec3(0.8, 0.7, 0.5),
        COLOURED,
    );
    let light = point_light(dvec3(0.3, 0.6, 4.0));
    let eye_m = dvec3(0.1, 0.2, -0.6);
    let scene = scene_of(vec![tube, block], light, eye_m, 3.0 * DVec3::Z);
    // Half the scene's size is 500 m: f32 keeps positions to 3e-5 m. Distances are 1 m and more, and count squared.
    exam.all_within("1 km", &scene, DIRECT_BOUND + 2.0 * 3e-5)
}

/// Blocks of 1 mm at 2 mm from the camera, in a hall of 2 km.
fn blocks_in_a_hall(eye_m: DVec3, light_mm: DVec3) -> Scene {
    let at = |mm: DVec3| eye_m + 1e-3 * mm;
    let block = |name: &str, corner_mm: DVec3, size_mm: DVec3| {
        cuboid(name, at(corner_mm), 1e-3 * size_mm, COLOURED)
    };
    let meshes = vec![
        cuboid("hall", DVec3::splat(-1e3), DVec3::splat(2e3), GREY),
        block("near", dvec3(-1.3, -0.9, -2.7), DVec3::ONE),
        block("nearer", dvec3(0.2, -0.3, -2.4), dvec3(0.4, 0.8, 0.3)),
    ];
    let mut scene = scene_of(meshes, point_light(at(light_mm)), eye_m, at(-DVec3::Z));
    scene.camera.lens = Lens::FovY { fov_y_deg: 60.0 };
    scene
}

fn near_and_far(exam: &mut Examiner, eye_m: DVec3) -> Result<()> {
    let scene = blocks_in_a_hall(eye_m, dvec3(0.9, 1.1, 0.3));
    let what = "blocks of 1 mm in 2 km";
    exam.direct(what, &scene, DIRECT_BOUND)?;
    let depth = error_of_depth(&exam.render(&scene)?, &exam.unsampled(&scene)?);
    exam.record(what, "depth", depth, DIRECT_BOUND);
    exam.sums(what, &scene, 16, KERNEL_BOUND)
}

/// Root mean square of the pixels' relative depth errors: near pixels count as much as far ones.
fn error_of_depth(frame: &Frame, truth: &Frame) -> f64 {
    let [depths, truths] = [frame, truth].map(|frame| values(frame, Layer::Depth));
    let edges = truth.ids(Layer::Edge).unwrap_or_default();
    let squares: Vec<f64> = (0..depths.len())
        .filter(|&pixel| truths[pixel].is_finite() && edges[pixel] == 0)
        .map(|pixel| (f64::from(depths[pixel]) / f64::from(truths[pixel]) - 1.0).powi(2))
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// The light casts the shadow of one block onto the side of the other.
fn near_shadows(exam: &mut Examiner) -> Result<()> {
    let scene = blocks_in_a_hall(DVec3::ZERO, dvec3(1.4, 0.3, -2.2));
    let what = "blocks of 1 mm in 2 km";
    exam.direct(what, &scene, DIRECT_BOUND)?;
    exam.direct_by_map(what, &scene, DIRECT_BOUND)?;
    exam.bounce(what, &scene)
}
