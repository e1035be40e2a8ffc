//! A hall with fluted columns and a cornice, and a side room beside it.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::materials::{OCHRE, STONE, TERRACOTTA};
use super::mesh::Mesh;
use super::room::room_with_walls;
use super::shapes::{block, cuboid, grid, lathe, sphere, torus};
use super::{Part, part};

const WIDTH_M: f64 = 6.0;
const HEIGHT_M: f64 = 3.6;
const DEPTH_M: f64 = 6.0;

pub fn parts() -> Vec<Part> {
    let mut columns = Mesh::default();
    let mut bases = Mesh::default();
    for z_m in [-2.2, -0.6, 1.0] {
        for x_m in [-1.5, 0.5] {
            columns.append(shaft().moved(x_m, 0.0, z_m));
            bases.append(base_and_capital().moved(x_m, 0.0, z_m));
        }
    }
    let mut parts = room_with_walls([WIDTH_M, HEIGHT_M, DEPTH_M], STONE, TERRACOTTA);
    parts.extend([
        part(STONE, columns),
        part(STONE, bases),
        part(STONE, cornice()),
        part(OCHRE, partition()),
        part(STONE, urn().moved(2.0, 0.0, -1.8)),
    ]);
    parts
}

/// The wall between hall and side room, with a doorway.
fn partition() -> Mesh {
    let x_m = [1.25, 1.35];
    let piece = |y_m: [f64; 2], z_m: [f64; 2]| {
        cuboid(
            DVec3::new(x_m[0], y_m[0], z_m[0]),
            DVec3::new(x_m[1], y_m[1], z_m[1]),
        )
    };
    Mesh::joined([
        piece([0.0, HEIGHT_M], [-DEPTH_M / 2.0, -1.4]),
        piece([2.2, HEIGHT_M], [-1.4, 0.5]),
        piece([0.0, HEIGHT_M], [0.5, DEPTH_M / 2.0]),
    ])
}

/// The fluted part of a column, slightly narrower at the top. Flat facets.
fn shaft() -> Mesh {
    const FLUTES: usize = 20;
    const POINTS_PER_FLUTE: usize = 8;
    let sides = FLUTES * POINTS_PER_FLUTE;
    grid([sides, 24], [true, false], |column, row| {
        let share = row as f64 / 24.0;
        let turn = column as f64 / sides as f64;
        let flute_m = 0.018 * (TAU / 2.0 * turn * FLUTES as f64).sin().abs();
        let radius_m = 0.2 - 0.035 * share * share - flute_m;
        let around = radius_m * DVec2::from_angle(-TAU * turn);
        DVec3::new(around.x, 0.25 + share * (HEIGHT_M - 0.6), around.y)
    })
}

fn base_and_capital() -> Mesh {
    let base = [
        [0.27, 0.08],
        [0.27, 0.1],
        [0.2, 0.19],
        [0.22, 0.21],
        [0.22, 0.24],
        [0.2, 0.25],
    ];
    let capital = [
        [0.16, -0.4],
        [0.19, -0.37],
        [0.17, -0.34],
        [0.18, -0.25],
        [0.28, -0.12],
    ];
    let capital = capital.map(|[radius_m, height_m]| [radius_m, HEIGHT_M + height_m]);
    let ring = Mesh {
        normals: Vec::new(),
        ..torus(0.22, 0.05, [96, 24]).moved(0.0, 0.13, 0.0)
    };
    Mesh::joined([
        block(0.58, 0.08, 0.58),
        lathe(&base, 96),
        ring,
        lathe(&capital, 96),
        block(0.6, 0.11, 0.6).moved(0.0, HEIGHT_M - 0.12, 0.0),
    ])
}

/// A moulding below the ceiling along the left and the back wall, mitred in the corner.
fn cornice() -> Mesh {
    const STEPS: usize = 24;
    const SIZE_M: f64 = 0.25;
    grid([2, STEPS], [false, false], |corner, step| {
        // From the wall to the ceiling: a round, a step, a hollow.
        let share = step as f64 / STEPS as f64;
        let out_m = SIZE_M * (share + 0.12 * (TAU * 2.0 * share).sin()).clamp(0.0, 1.0);
        let below_m = SIZE_M * (1.0 - share - 0.12 * (TAU * share).sin()).clamp(0.0, 1.0);
        let x_m = -WIDTH_M / 2.0 + out_m;
        let y_m = HEIGHT_M - below_m;
        let z_m = -DEPTH_M / 2.0 + out_m;
        match corner {
            0 => DVec3::new(x_m, y_m, DEPTH_M / 2.0),
            1 => DVec3::new(x_m, y_m, z_m),
            _ => DVec3::new(1.25, y_m, z_m),
        }
    })
}

/// In the side room: a pedestal and a ball.
fn urn() -> Mesh {
    let profile = [
        [0.2, 0.0],
        [0.2, 0.05],
        [0.06, 0.12],
        [0.06, 0.5],
        [0.12, 0.56],
    ];
    let ball = sphere(4).transformed(glam::DAffine3::from_scale(DVec3::splat(0.25)));
    let ball = Mesh {
        normals: Vec::new(),
        ..ball.moved(0.0, 0.78, 0.0)
    };
    Mesh::joined([lathe(&profile, 64), ball])
}
