//! The room of most scenes.

use glam::DVec3;

use super::materials::{Material, TEAL, TERRACOTTA, WHITE};
use super::mesh::Mesh;
use super::shapes::rectangle;
use super::{Part, part};

/// Floor at y = 0, walls and ceiling, centred on the y axis and open towards +z. All are white except the left and right walls.
pub fn open_room([width_m, height_m, depth_m]: [f64; 3]) -> Vec<Part> {
    room_with_walls([width_m, height_m, depth_m], TERRACOTTA, TEAL)
}

pub fn room_with_walls(size_m: [f64; 3], left: Material, right: Material) -> Vec<Part> {
    let [width, height, depth] = DVec3::from_array(size_m).to_array();
    let [across, up, back] = [DVec3::X * width, DVec3::Y * height, -DVec3::Z * depth];
    let left_front = DVec3::new(-width / 2.0, 0.0, depth / 2.0);
    let rest = Mesh::joined([
        rectangle(left_front, across, back),
        rectangle(left_front + back, across, up),
        rectangle(left_front + back + up, across, -back),
    ]);
    vec![
        part(WHITE, rest),
        part(left, rectangle(left_front, back, up)),
        part(right, rectangle(left_front + across + back, -back, up)),
    ]
}
