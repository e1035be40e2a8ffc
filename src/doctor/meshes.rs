//! The cases of [geometry](super::geometry) that are about what meshes are made of: thin walls, needles, two in one place.

use glam::DVec3;

use super::{
    Examiner, Measurement,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, largest, values},
    scenes::{COLOURED, GREY, cuboid, grid, point_light, quad, room, sphere, two_walls},
};
use crate::{
    Result, Scene,
    output::Layer,
    scene::{Mesh, Shared},
};

/// The room cut in two, its light on one side, its camera on the other; everything that is seen must be black.
fn dark_side(examiner: &mut Examiner, wall: Mesh) -> Result<Measurement> {
    let mut scene = room();
    scene.meshes = vec![scene.meshes.swap_remove(0), wall.into()];
    scene.lights = vec![point_light(DVec3::new(-0.4, 0.3, 0.2))];
    scene.camera.position_m = DVec3::new(0.9, 0.1, 0.8);
    scene.camera.look_at_m = DVec3::new(0.0, -0.1, -0.7);
    let lit = scene.lights[0];
    scene.lights = vec![point_light(DVec3::new(0.4, 0.3, 0.2))];
    let bright = largest(values(&examiner.render(&scene)?, Layer::Direct));
    scene.lights = vec![lit];
    examiner.leaks(&scene, bright)
}

pub(super) fn wall_of_a_millimetre(examiner: &mut Examiner) -> Result<Measurement> {
    let size = DVec3::new(0.001, 2.0, 2.0);
    dark_side(
        examiner,
        cuboid("wall", DVec3::new(-0.001, -1.0, -1.0), size, COLOURED),
    )
}

pub(super) fn wall_without_thickness(examiner: &mut Examiner) -> Result<Measurement> {
    let corner = DVec3::new(0.0, -1.0, -1.0);
    let wall = quad("wall", corner, 2.0 * DVec3::Y, 2.0 * DVec3::Z, COLOURED);
    dark_side(examiner, wall)
}

/// Forty slats of 2 mm between a lamp and the floor.
fn room_with_slats() -> Scene {
    let mut scene = room();
    scene.meshes.truncate(1);
    let [width, length] = [0.002 * DVec3::X, 1.6 * DVec3::Z];
    for i in 0..40 {
        let corner = DVec3::new(-0.8 + 0.04 * f64::from(i), -0.2, -0.8);
        scene
            .meshes
            .push(quad("slat", corner, width, length, COLOURED).into());
    }
    scene
}

pub(super) fn slats(examiner: &mut Examiner) -> Result<Measurement> {
    let scene = room_with_slats();
    Ok(Measurement::of([
        examiner.direct("40 slats of 2 mm", &scene, DIRECT_BOUND)?,
        examiner.bounce("40 slats of 2 mm", &scene)?,
    ]))
}

pub(super) fn shadow_map_of_slats(examiner: &mut Examiner) -> Result<Measurement> {
    examiner.direct_by_map("40 slats of 2 mm", &room_with_slats(), DIRECT_BOUND)
}

pub(super) fn interpenetrating(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    scene.meshes.truncate(1);
    scene.meshes.extend(
        [
            sphere(DVec3::new(-0.1, -0.8, -0.2), 0.55, 8, COLOURED),
            sphere(DVec3::new(0.2, -0.6, -0.1), 0.4, 8, GREY),
            cuboid(
                "block",
                DVec3::new(-0.5, -1.2, -0.5),
                DVec3::new(0.6, 0.9, 1.3),
                GREY,
            ),
        ]
        .map(Shared::from),
    );
    Ok(Measurement::of([
        examiner.direct("balls, a block and a room", &scene, DIRECT_BOUND)?,
        examiner.direct_by_map("balls, a block and a room", &scene, DIRECT_BOUND)?,
        examiner.bounce("balls, a block and a room", &scene)?,
    ]))
}

pub(super) fn two_meshes_in_one_place(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    let mut again = scene.meshes.clone();
    for mesh in &mut again {
        for [a, b, _] in &mut mesh.triangles {
            std::mem::swap(a, b);
        }
    }
    scene.meshes.extend(again);
    examiner.all("room twice", &scene, 24)
}

/// Needles 2 m long and 2 µm wide from side to side over the floor, and four hundred triangles without area in the room.
pub(super) fn needles(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..400_u32 {
        let t = f64::from(i) / 400.0;
        let from = DVec3::new(2.0 * t - 1.0, -0.2 + 0.3 * t, 0.3);
        let to = from + DVec3::new(0.37, 0.11, 0.05);
        positions.extend([from, from.lerp(to, 0.3), to].map(|p| p.to_array()));
        triangles.extend([[3 * i, 3 * i, 3 * i], [3 * i, 3 * i + 2, 3 * i]]);
    }
    scene
        .meshes
        .push(Mesh::from_slices("no area", &positions, &triangles, COLOURED).into());
    let fan = |name: &str, z: f64| {
        // A strip of the floor's plane, cut lengthwise into needles, a little above it.
        let corner = DVec3::new(-1.0, -0.998, z);
        grid(
            name,
            [corner, 2.0 * DVec3::X, 20e-6 * DVec3::Z],
            [1, 10],
            COLOURED,
        )
    };
    for i in 0..40 {
        scene
            .meshes
            .push(fan("needles", -0.9 + 0.045 * f64::from(i)).into());
    }
    // The floor itself: a fan of triangles around one corner, of which every second is a needle.
    let mut rim = Vec::new();
    for i in 0..=40 {
        let x = -1.0 + 0.05 * f64::from(i);
        rim.extend([[x, -0.997, 1.0], [x + 2e-6, -0.997, 1.0]]);
    }
    let apex = rim.len() as u32;
    rim.push([-0.3, -0.997, -1.0]);
    let triangles: Vec<_> = (0..apex - 1).map(|i| [apex, i, i + 1]).collect();
    scene
        .meshes
        .push(Mesh::from_slices("fan", &rim, &triangles, GREY).into());
    Ok(Measurement::of([
        examiner.direct("needles of aspect 1e6", &scene, DIRECT_BOUND)?,
        examiner.direct_by_map("needles of aspect 1e6", &scene, DIRECT_BOUND)?,
        examiner.sums("needles of aspect 1e6", &scene, 24, KERNEL_BOUND)?,
        examiner.bounce("needles of aspect 1e6", &scene)?,
    ]))
}

/// A corner whose floor is of two million triangles.
pub(super) fn two_million_triangles(examiner: &mut Examiner) -> Result<Measurement> {
    let light = point_light(DVec3::new(0.7, 0.9, 0.11));
    let mut scene = two_walls(light, DVec3::new(1.3, 0.9, 0.2), DVec3::new(0.2, 0.1, 0.0));
    let plane = [-DVec3::Z, 2.0 * DVec3::Z, 2.0 * DVec3::X];
    scene.meshes[0] = grid("floor", plane, [1000, 1000], GREY).into();
    let what = "floor of 2e6 triangles";
    // Rasterisers round corners to 1/256 pixel, here 0.2 mm in 1.3 m, and where that takes a pixel's centre out of its
    // triangle of 2 mm, P stays at the triangle's rim.
    let of_raster = 2.0 * 0.5 * 0.0002 / 1.3;
    Ok(Measurement::of([
        examiner.direct(what, &scene, DIRECT_BOUND + of_raster)?,
        examiner.direct_by_map(what, &scene, DIRECT_BOUND + of_raster)?,
        examiner.sums(what, &scene, 24, KERNEL_BOUND)?,
        examiner.bounce(what, &scene)?,
    ]))
}
