//! The cases of [geometry](super::geometry) that are about what meshes are made of: thin walls, needles, two in one place.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use super::{
    Examiner, Measurement,
    examiner::{DIRECT_BOUND, KERNEL_BOUND, largest, values},
    scenes::{
        COLOURED, GREY, cuboid, grid, point_light, quad, room, rounded, sphere, turned, two_walls,
        with_shadow,
    },
};
use crate::{
    Result, Scene,
    output::Layer,
    scene::{Material, Mesh, Shadow, Shared},
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
    Ok(Measurement::of([
        examiner.leaks(&scene, bright)?,
        // To sums the wall is no obstacle.
        examiner.sums("", &scene, 24, KERNEL_BOUND)?,
    ]))
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
        examiner.sums("40 slats of 2 mm", &scene, 24, KERNEL_BOUND)?,
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
        examiner.sums("balls, a block and a room", &scene, 24, KERNEL_BOUND)?,
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

/// Against the reference of a scene without the triangles that must not be seen.
pub(super) fn two_materials_in_one_place(examiner: &mut Examiner) -> Result<Measurement> {
    let seen = room();
    let mut parts = Vec::new();
    for (what, other) in [("black", BLACK), ("white", WHITE)] {
        let mut scene = seen.clone();
        for (name, reflectance) in [("black", 0.0), ("white", 1.0)] {
            let material = Material::lambert(name, [reflectance; 3]);
            scene.materials.push(material);
        }
        for mut mesh in seen.meshes.clone() {
            mesh.triangle_materials.fill(other);
            scene.meshes.push(mesh);
        }
        for shadow in Shadow::ALL {
            let scene = with_shadow(&scene, shadow);
            let what = format!("{what} under it, shadow by {}", shadow.name());
            parts.push(examiner.layer(&what, &scene, (&seen, Layer::Direct), DIRECT_BOUND)?);
        }
        parts.push(examiner.sums(what, &scene, 24, KERNEL_BOUND)?);
        parts.push(examiner.bounce_like(what, &scene, &seen)?);
    }
    Ok(Measurement::of(parts))
}

/// After those of the scenes.
const BLACK: u32 = 3;
const WHITE: u32 = 4;

/// A slanted wall across the room, one half of it in cells, whose corners lie on the long edge of the other half but for rounding.
pub(super) fn t_junctions(examiner: &mut Examiner) -> Result<Measurement> {
    let corner = DVec3::new(-0.31, -1.1, -1.4);
    let [along, across] = [DVec3::new(0.37, 2.2, 0.13), DVec3::new(0.11, 0.0, 1.4)];
    let mut wall = grid("wall", [corner, along, across], [37, 5], COLOURED);
    let whole = quad("whole", corner + across, along, across, COLOURED);
    let first = wall.positions_m.len() as u32;
    wall.positions_m.extend(whole.positions_m);
    let triangles = whole.triangles.iter().map(|t| t.map(|i| first + i));
    wall.triangles.extend(triangles);
    wall.triangle_materials.extend(whole.triangle_materials);
    dark_side(examiner, wall)
}

/// A tent over the floor: three thousand needles from its top to its rim, 1.5 mm wide there.
pub(super) fn needle_fan(examiner: &mut Examiner) -> Result<Measurement> {
    const NEEDLES: u32 = 3_000;
    let mut positions = vec![[-0.1, -0.5, -0.2]];
    positions.extend((0..NEEDLES).map(|i| {
        let (sine, cosine) = (f64::from(i) / f64::from(NEEDLES) * TAU).sin_cos();
        [-0.1 + 0.7 * cosine, -0.9, -0.2 + 0.7 * sine]
    }));
    let triangles: Vec<_> = (0..NEEDLES)
        .map(|i| [0, 1 + i, 1 + (i + 1) % NEEDLES])
        .collect();
    let mut scene = room();
    scene.meshes.truncate(1);
    scene
        .meshes
        .push(Mesh::from_slices("tent", &positions, &triangles, COLOURED).into());
    let what = "3 000 needles";
    // Rasterisers round corners to 1/256 pixel, here 0.2 mm in 1 m, and where that takes a pixel's centre out of its needle, P stays
    // at the needle's rim.
    let of_raster = 2.0 * 0.5 * 0.0002;
    Ok(Measurement::of([
        examiner.direct(what, &scene, DIRECT_BOUND + of_raster)?,
        examiner.sums(what, &scene, 24, KERNEL_BOUND)?,
        examiner.bounce(what, &scene)?,
    ]))
}

/// x turned to −x, with shading normals on one of the boxes.
pub(super) fn room_in_a_mirror(examiner: &mut Examiner) -> Result<Measurement> {
    let mut scene = room();
    let centre_m = DVec3::new(-0.35, -0.45, -0.5);
    scene.meshes[1] = rounded(Mesh::clone(&scene.meshes[1]), centre_m).into();
    let scene = turned(&scene, DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)));
    examiner.all("", &scene, 24)
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
