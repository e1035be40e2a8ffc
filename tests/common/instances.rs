//! Scenes in which instances share meshes.

use camlux::Scene;
use camlux::scene::{Instance, Mesh, Shared};
use glam::{DAffine3, DMat3, DQuat, DVec3, EulerRot, dvec3};

use super::gpu::demo_scene;

/// Squares along an edge of a face of [`block`].
const SQUARES: u32 = 8;

/// A cube of edge 1 about 0 whose faces are many flat triangles. Each face shows a texture once.
pub fn block() -> Mesh {
    let mut mesh = Mesh {
        name: "block".into(),
        ..Mesh::default()
    };
    for turn in [
        DQuat::IDENTITY,
        DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2),
        DQuat::from_rotation_x(std::f64::consts::PI),
        DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2),
        DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2),
        DQuat::from_rotation_y(-std::f64::consts::FRAC_PI_2),
    ] {
        let first = mesh.positions_m.len() as u32;
        for row in 0..=SQUARES {
            for column in 0..=SQUARES {
                let [u, v] = [column, row].map(|place| f64::from(place) / f64::from(SQUARES));
                mesh.positions_m.push(turn * dvec3(u - 0.5, v - 0.5, 0.5));
                mesh.texcoords.push([u, v]);
            }
        }
        for row in 0..SQUARES {
            for column in 0..SQUARES {
                let a = first + row * (SQUARES + 1) + column;
                let (b, c, d) = (a + 1, a + SQUARES + 2, a + SQUARES + 1);
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh.triangle_materials = vec![0; mesh.triangles.len()];
    mesh
}

/// Two tilted slabs as large as the scene, with a block between them. Rays that start on a slab graze its many triangles in one plane.
pub fn slabs(resolution_px: [u32; 2]) -> Scene {
    let mut scene = demo_scene("cornell", resolution_px);
    scene.meshes.clear();
    let slab = Shared::from(block());
    let turn = DMat3::from_euler(EulerRot::YXZ, 0.6, 0.3, 0.2);
    for (size, height_m) in [
        (dvec3(3.0, 0.01, 3.0), 0.2),
        (dvec3(3.0, 0.02, 3.0), 1.9),
        (dvec3(0.4, 0.7, 0.5), 0.555),
    ] {
        scene.meshes.push(Instance {
            to_world: DAffine3 {
                matrix3: turn * DMat3::from_diagonal(size),
                translation: turn * dvec3(0.0, height_m, 0.0),
            },
            ..Instance::from(slab.clone())
        });
    }
    scene
}

/// Rotated, stretched, mirrored and small instances of the block and the knot in the knot's room. Blocks stand on the floor and on each other.
pub fn crowd(resolution_px: [u32; 2]) -> Scene {
    let mut scene = demo_scene("knot", resolution_px);
    let mut knot = scene.meshes.pop().expect("the knot");
    for position_m in &mut knot.positions_m {
        position_m.y -= 0.92;
    }
    let ivory = knot.triangle_materials[0];
    let mut block = block();
    block.triangle_materials.fill(ivory);
    let block = Shared::from(block);
    let mut place = |mesh: &Shared<Mesh>, size: DVec3, euler_deg: [f64; 3], at_m: DVec3| {
        let [x, y, z] = euler_deg.map(f64::to_radians);
        let turn = DMat3::from_euler(EulerRot::YXZ, y, x, z);
        scene.meshes.push(Instance {
            name: format!("{} {}", mesh.name, scene.meshes.len()),
            mesh: mesh.clone(),
            to_world: DAffine3 {
                matrix3: turn * DMat3::from_diagonal(size),
                translation: at_m,
            },
        });
    };
    let at = |x: f64, y: f64, z: f64| dvec3(x, y, z);
    place(
        &knot.mesh,
        DVec3::splat(0.5),
        [20.0, 40.0, 0.0],
        at(-0.45, 1.2, -0.3),
    );
    place(
        &knot.mesh,
        dvec3(0.3, 0.55, 0.4),
        [0.0, 130.0, 70.0],
        at(0.5, 1.1, 0.0),
    );
    place(
        &knot.mesh,
        dvec3(-0.4, 0.4, 0.4),
        [0.0, -60.0, 0.0],
        at(0.1, 1.55, -0.5),
    );
    place(
        &knot.mesh,
        DVec3::splat(0.05),
        [33.0, 0.0, 0.0],
        at(0.0, 0.75, 0.4),
    );
    place(
        &block,
        dvec3(0.5, 0.3, 0.4),
        [0.0, 30.0, 0.0],
        at(-0.5, 0.15, 0.1),
    );
    place(
        &block,
        DVec3::splat(0.3),
        [0.0, 45.0, 0.0],
        at(-0.5, 0.45, 0.1),
    );
    place(
        &block,
        dvec3(0.4, 0.6, 0.4),
        [0.0, 0.0, 0.0],
        at(0.5, 0.3, 0.2),
    );
    place(
        &block,
        dvec3(-0.2, 0.01, 0.2),
        [10.0, 20.0, 30.0],
        at(0.1, 0.3, 0.6),
    );
    scene
}
