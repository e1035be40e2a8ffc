//! The surface on which a function of space is zero.

use std::collections::HashMap;

use glam::{DVec3, USizeVec3};

use super::mesh::Mesh;

/// Naive surface nets: one vertex in each cubic cell that the surface crosses, and one quad around each lattice edge that the surface
/// crosses. `height_m` is approximately a distance, negative inside, and positive on the faces of the box. The mesh has smooth normals.
pub fn isosurface(
    [min_m, max_m]: [DVec3; 2],
    cell_m: f64,
    height_m: impl Fn(DVec3) -> f64,
) -> Mesh {
    let counts = ((max_m - min_m) / cell_m).ceil().as_usizevec3() + 1;
    let place_m = |node: USizeVec3| min_m + cell_m * node.as_dvec3();
    let is_inside = inside_nodes(counts, cell_m, |node| height_m(place_m(node)));
    let is_inside = |node: USizeVec3| is_inside[(node.z * counts.y + node.y) * counts.x + node.x];

    let mut mesh = Mesh::default();
    let mut vertices = HashMap::new();
    let mut vertex_of = |cell: USizeVec3| {
        *vertices.entry(cell).or_insert_with(|| {
            let (position, normal) = on_surface(place_m(cell) + 0.5 * cell_m, cell_m, &height_m);
            mesh.positions.push(position);
            mesh.normals.push(normal);
            mesh.positions.len() as u32 - 1
        })
    };
    let axes = [USizeVec3::X, USizeVec3::Y, USizeVec3::Z];
    for z in 1..counts.z - 1 {
        for y in 1..counts.y - 1 {
            for x in 1..counts.x - 1 {
                let node = USizeVec3::new(x, y, z);
                for axis in 0..3 {
                    let is_next_inside = is_inside(node + axes[axis]);
                    if is_inside(node) == is_next_inside {
                        continue;
                    }
                    let [u, v] = [axes[(axis + 1) % 3], axes[(axis + 2) % 3]];
                    let [a, b, c, d] = [node - u - v, node - v, node, node - u].map(&mut vertex_of);
                    mesh.triangles.extend(if is_next_inside {
                        [[a, c, b], [a, d, c]]
                    } else {
                        [[a, b, c], [a, c, d]]
                    });
                }
            }
        }
    }
    mesh
}

/// Whether each lattice node is inside; x varies fastest.
fn inside_nodes(counts: USizeVec3, cell_m: f64, height_m: impl Fn(USizeVec3) -> f64) -> Vec<bool> {
    let mut is_inside = Vec::with_capacity(counts.x * counts.y * counts.z);
    for z in 0..counts.z {
        for y in 0..counts.y {
            let mut x = 0;
            while x < counts.x {
                let height_m = height_m(USizeVec3::new(x, y, z));
                // The surface is at least half that distance away, because the function is only approximately a distance.
                let alike = (0.5 * height_m.abs() / cell_m) as usize + 1;
                let alike = alike.min(counts.x - x);
                is_inside.extend(std::iter::repeat_n(height_m < 0.0, alike));
                x += alike;
            }
        }
    }
    is_inside
}

/// The surface point near the centre of a cell, at most half a cell away along each axis, and its normal.
fn on_surface(centre_m: DVec3, cell_m: f64, height_m: &impl Fn(DVec3) -> f64) -> (DVec3, DVec3) {
    let gradient = |p: DVec3| {
        let step_m = 0.1 * cell_m;
        let slope = |axis: DVec3| height_m(p + step_m * axis) - height_m(p - step_m * axis);
        DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)) / (2.0 * step_m)
    };
    let mut position_m = centre_m;
    for _ in 0..2 {
        let slope = gradient(position_m);
        position_m -= height_m(position_m) * slope / slope.length_squared();
        // Stays inside its cell, so that no triangle is flipped.
        let half_m = DVec3::splat(0.5 * cell_m);
        position_m = position_m.clamp(centre_m - half_m, centre_m + half_m);
    }
    (position_m, gradient(position_m).normalize())
}
