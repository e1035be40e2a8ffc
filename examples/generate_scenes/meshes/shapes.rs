//! Shapes that several scenes use. All face outwards.

use std::collections::HashMap;
use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::mesh::Mesh;

/// Columns and rows of quads through given points; each direction may be closed. A quad that has shrunk to a triangle, as at the pole of a
/// sphere, becomes one triangle.
pub fn grid(
    [columns, rows]: [usize; 2],
    [closes_columns, closes_rows]: [bool; 2],
    point: impl Fn(usize, usize) -> DVec3,
) -> Mesh {
    let points_per_row = if closes_columns { columns } else { columns + 1 };
    let point_rows = if closes_rows { rows } else { rows + 1 };
    let mut mesh = Mesh::default();
    for row in 0..point_rows {
        let points = (0..points_per_row).map(|column| point(column, row));
        mesh.positions.extend(points);
    }
    let index =
        |column, row| ((row % point_rows) * points_per_row + column % points_per_row) as u32;
    for row in 0..rows {
        for column in 0..columns {
            let a = index(column, row);
            let b = index(column + 1, row);
            let c = index(column + 1, row + 1);
            let d = index(column, row + 1);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let Mesh {
        positions,
        triangles,
        ..
    } = &mut mesh;
    triangles.retain(|triangle| {
        let [a, b, c] = triangle.map(|index| positions[index as usize]);
        let is_same = |p: DVec3, q: DVec3| p.distance_squared(q) < 1e-20;
        !is_same(a, b) && !is_same(b, c) && !is_same(c, a)
    });
    mesh
}

/// A surface through closed loops with the same number of points.
pub fn loft(loops: &[Vec<DVec3>]) -> Mesh {
    let size = [loops[0].len(), loops.len() - 1];
    grid(size, [true, false], |column, row| loops[row][column])
}

/// A profile of (radius, height) revolved around the y axis. It runs from bottom to top on the outside.
pub fn lathe(profile: &[[f64; 2]], sides: usize) -> Mesh {
    grid(
        [sides, profile.len() - 1],
        [true, false],
        // Clockwise seen from above, so that the surface faces outwards.
        |column, row| {
            let [radius, height] = profile[row];
            let around = DVec2::from_angle(-TAU * column as f64 / sides as f64);
            DVec3::new(radius * around.x, height, radius * around.y)
        },
    )
}

/// Around the y axis, smooth.
pub fn torus(major_radius: f64, minor_radius: f64, [columns, rows]: [usize; 2]) -> Mesh {
    let torus = grid([columns, rows], [true, true], |column, row| {
        let around = DVec2::from_angle(-TAU * column as f64 / columns as f64);
        let tube = DVec2::from_angle(TAU * row as f64 / rows as f64);
        let radius = major_radius + minor_radius * tube.x;
        DVec3::new(radius * around.x, minor_radius * tube.y, radius * around.y)
    });
    torus.smooth()
}

/// The unit sphere with 20·4^levels triangles of nearly equal size: an icosahedron whose triangles are repeatedly split into four.
pub fn sphere(levels: u32) -> Mesh {
    let long = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut positions = Vec::new();
    for (s, t) in [(-1.0, -long), (1.0, -long), (-1.0, long), (1.0, long)] {
        positions.extend([
            DVec3::new(0.0, s, t),
            DVec3::new(s, t, 0.0),
            DVec3::new(t, 0.0, s),
        ]);
    }
    let mut triangles = Vec::new();
    for a in 0..12_u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|index: u32| positions[index as usize]);
                // Neighbours are 2 apart.
                if [(p, q), (q, r), (r, p)]
                    .iter()
                    .all(|(u, v)| u.distance(*v) < 2.1)
                {
                    let faces_out = (q - p).cross(r - p).dot(p) > 0.0;
                    triangles.push(if faces_out { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for position in &mut positions {
        *position = position.normalize();
    }
    for _ in 0..levels {
        triangles = in_four(&mut positions, &triangles);
    }
    Mesh {
        normals: positions.clone(),
        positions,
        triangles,
    }
}

/// Cuts each triangle of a sphere in four through the middles of its edges.
fn in_four(positions: &mut Vec<DVec3>, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middles = HashMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            positions.push((positions[a as usize] + positions[b as usize]).normalize());
            positions.len() as u32 - 1
        })
    };
    let mut quarters = Vec::with_capacity(4 * triangles.len());
    for &[a, b, c] in triangles {
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        quarters.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    quarters
}

/// Two triangles; faces along `across` × `up`.
pub fn rectangle(corner: DVec3, across: DVec3, up: DVec3) -> Mesh {
    Mesh {
        positions: vec![corner, corner + across, corner + across + up, corner + up],
        normals: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

/// A box between two corners.
pub fn cuboid(min: DVec3, max: DVec3) -> Mesh {
    let [x, y, z] = (max - min).to_array();
    let [x, y, z] = [DVec3::X * x, DVec3::Y * y, DVec3::Z * z];
    Mesh::joined([
        rectangle(min, y, x),
        rectangle(min, z, y),
        rectangle(min, x, z),
        rectangle(max, -x, -y),
        rectangle(max, -y, -z),
        rectangle(max, -z, -x),
    ])
}

/// A box that stands on the y = 0 plane, around the y axis.
pub fn block(width: f64, height: f64, depth: f64) -> Mesh {
    let corner = DVec3::new(width / 2.0, height, depth / 2.0);
    cuboid(corner * DVec3::new(-1.0, 0.0, -1.0), corner)
}
