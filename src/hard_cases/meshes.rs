//! The cases of [geometry](super::geometry) that concern the meshes themselves: thin walls, needles, coincident surfaces.

use std::{f64::consts::TAU, mem};

use glam::{DMat3, DVec3, dvec3};

use super::{
    Examiner,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, TARGET_ERROR},
    scenes::{
        COLOURED, GREY, append, cuboid, empty_room, grid, lit_by, point_light, quad, room, rounded,
        sphere, turned, two_walls, with_shadow,
    },
};
use crate::{
    Result, Scene,
    output::Layer,
    scene::{Material, Mesh, Shadow},
};

/// A wall cuts the room in two, with the light on one side and the camera on the other. Everything that the camera sees must be black.
fn dark_side(exam: &mut Examiner, wall: Mesh) -> Result<()> {
    let mut scene = empty_room();
    scene.meshes.push(wall.into());
    scene.camera.position_m = dvec3(0.9, 0.1, 0.8);
    scene.camera.look_at_m = dvec3(0.0, -0.1, -0.7);
    let [lit, dark] = [0.4, -0.4].map(|x| lit_by(&scene, vec![point_light(dvec3(x, 0.3, 0.2))]));
    let bright = exam.largest(&lit, Layer::Direct)?;
    exam.leaks(&dark, bright)?;
    // The sums ignore visibility, so the wall is no obstacle to them.
    exam.sums("", &dark, 24, KERNEL_BOUND)
}

pub(super) fn wall_of_a_millimetre(exam: &mut Examiner) -> Result<()> {
    let size = dvec3(0.001, 2.0, 2.0);
    let corner = dvec3(-0.001, -1.0, -1.0);
    dark_side(exam, cuboid("wall", corner, size, COLOURED))
}

pub(super) fn wall_without_thickness(exam: &mut Examiner) -> Result<()> {
    let corner = dvec3(0.0, -1.0, -1.0);
    let wall = quad("wall", corner, 2.0 * DVec3::Y, 2.0 * DVec3::Z, COLOURED);
    dark_side(exam, wall)
}

/// Forty slats of 2 mm between a lamp and the floor.
pub(super) fn room_with_slats() -> Scene {
    let mut scene = empty_room();
    let [width, length] = [0.002 * DVec3::X, 1.6 * DVec3::Z];
    for i in 0..40 {
        let corner = dvec3(-0.8 + 0.04 * f64::from(i), -0.2, -0.8);
        let slat = quad("slat", corner, width, length, COLOURED);
        scene.meshes.push(slat.into());
    }
    scene
}

pub(super) fn interpenetrating(exam: &mut Examiner) -> Result<()> {
    let corner = dvec3(-0.5, -1.2, -0.5);
    let mut scene = empty_room();
    scene.meshes.extend([
        sphere(dvec3(-0.1, -0.8, -0.2), 0.55, 8, COLOURED).into(),
        sphere(dvec3(0.2, -0.6, -0.1), 0.4, 8, GREY).into(),
        cuboid("block", corner, dvec3(0.6, 0.9, 1.3), GREY).into(),
    ]);
    exam.all("balls, a block and a room", &scene)
}

pub(super) fn two_meshes_in_one_place(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    for mut again in room().meshes {
        for [a, b, _] in &mut again.triangles {
            mem::swap(a, b);
        }
        scene.meshes.push(again);
    }
    exam.all("room twice", &scene)
}

/// Needles 2 m long and 2 µm wide across the floor, and four hundred triangles of zero area in the room.
pub(super) fn needles(exam: &mut Examiner) -> Result<()> {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..400_u32 {
        let t = f64::from(i) / 400.0;
        let from = dvec3(2.0 * t - 1.0, -0.2 + 0.3 * t, 0.3);
        let to = from + dvec3(0.37, 0.11, 0.05);
        positions.extend([from, from.lerp(to, 0.3), to].map(|p| p.to_array()));
        triangles.extend([[3 * i, 3 * i, 3 * i], [3 * i, 3 * i + 2, 3 * i]]);
    }
    let mut scene = room();
    let no_area = Mesh::from_slices("no area", &positions, &triangles, COLOURED);
    scene.meshes.push(no_area.into());
    for i in 0..40 {
        // A strip parallel to the floor and slightly above it, cut lengthwise into needles.
        let corner = dvec3(-1.0, -0.998, -0.9 + 0.045 * f64::from(i));
        let strip = [corner, 2.0 * DVec3::X, 20e-6 * DVec3::Z];
        let needles = grid("needles", strip, [1, 10], COLOURED);
        scene.meshes.push(needles.into());
    }
    // The floor itself: a fan of triangles around one corner; every second one is a needle.
    let mut rim = Vec::new();
    for i in 0..=40 {
        let x = -1.0 + 0.05 * f64::from(i);
        rim.extend([[x, -0.997, 1.0], [x + 2e-6, -0.997, 1.0]]);
    }
    let apex = rim.len() as u32;
    rim.push([-0.3, -0.997, -1.0]);
    let triangles: Vec<_> = (0..apex - 1).map(|i| [apex, i, i + 1]).collect();
    let fan = Mesh::from_slices("fan", &rim, &triangles, GREY);
    scene.meshes.push(fan.into());
    exam.all("needles of aspect 1e6", &scene)
}

/// Compares with the reference of a scene without the hidden triangles.
pub(super) fn two_materials_in_one_place(exam: &mut Examiner) -> Result<()> {
    let seen = room();
    let truth = exam.sampled_enough(&seen)?;
    for (what, reflectance) in [("black", 0.0), ("white", 1.0)] {
        let mut scene = seen.clone();
        let below = scene.materials.len() as u32;
        let material = Material::lambert(what, [reflectance; 3]);
        scene.materials.push(material);
        for mut mesh in seen.meshes.clone() {
            mesh.triangle_materials.fill(below);
            scene.meshes.push(mesh);
        }
        for shadow in Shadow::ALL {
            let scene = with_shadow(&scene, shadow);
            let what = format!("{what} under it, shadow by {}", shadow.name());
            let error = exam.error_against(&truth, &scene, Layer::Direct)?;
            exam.record(&what, "direct", error, DIRECT_BOUND);
        }
        exam.sums(what, &scene, 24, KERNEL_BOUND)?;
        exam.bounce_against(&truth, what, &scene, TARGET_ERROR)?;
    }
    Ok(())
}

/// A slanted wall across the room. One half consists of cells, whose corners are, up to rounding, on the long edge of the other half.
pub(super) fn t_junctions(exam: &mut Examiner) -> Result<()> {
    let corner = dvec3(-0.31, -1.1, -1.4);
    let [along, across] = [dvec3(0.37, 2.2, 0.13), dvec3(0.11, 0.0, 1.4)];
    let mut wall = grid("wall", [corner, along, across], [37, 5], COLOURED);
    let whole = quad("whole", corner + across, along, across, COLOURED);
    append(&mut wall, whole);
    dark_side(exam, wall)
}

/// A tent over the floor: three thousand needles from its top to its rim, where they are 1.5 mm wide.
pub(super) fn needle_fan(exam: &mut Examiner) -> Result<()> {
    const NEEDLES: u32 = 3_000;
    let mut positions = vec![[-0.1, -0.5, -0.2]];
    positions.extend((0..NEEDLES).map(|i| {
        let (sine, cosine) = (f64::from(i) / f64::from(NEEDLES) * TAU).sin_cos();
        [-0.1 + 0.7 * cosine, -0.9, -0.2 + 0.7 * sine]
    }));
    let needle = |i: u32| [0, 1 + i, 1 + (i + 1) % NEEDLES];
    let triangles: Vec<_> = (0..NEEDLES).map(needle).collect();
    let tent = Mesh::from_slices("tent", &positions, &triangles, COLOURED);
    let mut scene = empty_room();
    scene.meshes.push(tent.into());
    // Rasterisers round corners to 1/256 pixel, here 0.2 mm in 1 m. If that moves a pixel's centre out of its needle, P stays at the
    // needle's rim.
    let of_raster = 2.0 * 0.5 * 0.0002;
    exam.by_rays("3 000 needles", &scene, DIRECT_BOUND + of_raster)
}

/// The room mirrored from x to −x, with shading normals on one of the boxes.
pub(super) fn room_in_a_mirror(exam: &mut Examiner) -> Result<()> {
    let mut scene = room();
    let centre_m = dvec3(-0.35, -0.45, -0.5);
    scene.meshes[1] = rounded(Mesh::clone(&scene.meshes[1]), centre_m).into();
    let mirror = DMat3::from_diagonal(dvec3(-1.0, 1.0, 1.0));
    exam.all("", &turned(&scene, mirror))
}

/// A corner of two walls; its floor has two million triangles.
pub(super) fn two_million_triangles(exam: &mut Examiner) -> Result<()> {
    let light = point_light(dvec3(0.7, 0.9, 0.11));
    let mut scene = two_walls(light, dvec3(1.3, 0.9, 0.2), dvec3(0.2, 0.1, 0.0));
    let plane = [-DVec3::Z, 2.0 * DVec3::Z, 2.0 * DVec3::X];
    scene.meshes[0] = grid("floor", plane, [1000, 1000], GREY).into();
    // Rasterisers round corners to 1/256 pixel, here 0.2 mm in 1.3 m. If that moves a pixel's centre out of its triangle of 2 mm, P stays
    // at the triangle's rim.
    let of_raster = 2.0 * 0.5 * 0.0002 / 1.3;
    exam.all_within("floor of 2e6 triangles", &scene, DIRECT_BOUND + of_raster)
}
