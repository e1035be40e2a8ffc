//! A head of bronze with bumps, on a plinth in a room.

use glam::{DAffine3, DQuat, DVec3};

use super::materials::{BRONZE, STONE};
use super::mesh::Mesh;
use super::noise::octaves;
use super::room::open_room;
use super::shapes::{block, lathe, sphere};
use super::{Part, part};

/// 81 920 triangles.
const LEVELS: u32 = 6;

const HEAD_RADIUS_M: f64 = 0.2;

/// A bump or a dent of the head around a direction.
struct Feature {
    direction: DVec3,
    /// Height relative to `HEAD_RADIUS_M`.
    height: f64,
    /// Distance from the direction, on the unit sphere, at which the height has fallen to 1/e.
    width: f64,
}

const fn feature(direction: [f64; 3], height: f64, width: f64) -> Feature {
    Feature {
        direction: DVec3::from_array(direction),
        height,
        width,
    }
}

/// The face looks along +z. Features that are on both sides are mirrored.
const FEATURES: [Feature; 9] = [
    feature([0.0, -0.10, 1.0], 0.32, 0.13),  // nose
    feature([0.0, 0.10, 1.0], 0.16, 0.10),   // its bridge
    feature([0.36, 0.16, 0.9], -0.20, 0.17), // eye sockets
    feature([0.34, 0.15, 0.9], 0.10, 0.09),  // eyes
    feature([0.36, 0.40, 0.85], 0.10, 0.13), // brows
    feature([0.55, -0.22, 0.8], 0.06, 0.22), // cheeks
    feature([0.0, -0.42, 0.9], 0.12, 0.11),  // lips
    feature([0.0, -0.78, 0.7], 0.16, 0.25),  // chin
    feature([1.0, 0.0, -0.05], 0.26, 0.15),  // ears
];

pub fn parts() -> Vec<Part> {
    let mut head = sphere(LEVELS);
    for position in &mut head.positions {
        *position = head_m(*position);
    }
    let neck = [[0.17, -0.34], [0.115, -0.27], [0.095, -0.2], [0.09, -0.1]];
    let bust = Mesh::joined([head.smooth(), lathe(&neck, 96).smooth()]);
    let turn = DQuat::from_rotation_y(-0.35);
    let at_m = DVec3::new(0.0, 0.94, 0.0);
    let mut parts = open_room([1.8, 1.9, 1.8]);
    let bust = bust.transformed(DAffine3::from_rotation_translation(turn, at_m));
    parts.push(part(BRONZE, bust));
    parts.push(part(STONE, block(0.45, 0.6, 0.45)));
    parts
}

/// The point of the head's surface in a direction from its centre.
fn head_m(direction: DVec3) -> DVec3 {
    let mirrored = DVec3::new(direction.x.abs(), direction.y, direction.z);
    let features = FEATURES.iter().map(|feature| {
        let distance = mirrored.distance(feature.direction.normalize()) / feature.width;
        feature.height * (-distance * distance).exp()
    });
    let bumps = 0.014 * octaves(direction * 9.0, 4);
    let radius_m = HEAD_RADIUS_M * (1.0 + features.sum::<f64>() + bumps);
    radius_m * direction * DVec3::new(0.82, 1.25, 0.95)
}
