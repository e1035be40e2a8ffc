//! Grass on uneven soil in front of a garden wall.

use std::f64::consts::TAU;

use fastrand::Rng;
use glam::{DVec2, DVec3};

use super::materials::{DRY_GRASS, GRASS, SOIL, TERRACOTTA};
use super::mesh::Mesh;
use super::noise::octaves;
use super::shapes::{block, grid};
use super::{Part, part};

const WIDTH_M: f64 = 1.8;
const DEPTH_M: f64 = 1.3;
const BLADES: usize = 9_000;
/// One blade in this many has dried.
const DRY: usize = 6;
/// Quads along a blade; the last one is a triangle.
const SEGMENTS: usize = 4;

pub fn parts() -> Vec<Part> {
    let mut random = Rng::with_seed(1);
    let mut fresh = Mesh::default();
    let mut dry = Mesh::default();
    for index in 0..BLADES {
        let x_m = (random.f64() - 0.5) * WIDTH_M;
        let z_m = (random.f64() - 0.5) * DEPTH_M;
        let blade = blade(DVec3::new(x_m, soil_m(x_m, z_m), z_m), &mut random);
        let kind = if index % DRY == 0 {
            &mut dry
        } else {
            &mut fresh
        };
        kind.append(blade);
    }
    let soil = grid([90, 65], [false, false], |column, row| {
        let x_m = (column as f64 / 90.0 - 0.5) * WIDTH_M;
        let z_m = (0.5 - row as f64 / 65.0) * DEPTH_M;
        DVec3::new(x_m, soil_m(x_m, z_m), z_m)
    });
    let wall = block(2.0 * WIDTH_M, 0.9, 0.1).moved(0.0, -0.1, -DEPTH_M / 2.0 - 0.02);
    vec![
        part(SOIL, soil),
        part(GRASS, fresh),
        part(DRY_GRASS, dry),
        part(TERRACOTTA, wall),
    ]
}

/// Height of the soil.
fn soil_m(x_m: f64, z_m: f64) -> f64 {
    0.04 * octaves(DVec3::new(x_m, 0.0, z_m) * 4.0, 4)
}

/// A strip that bends under its own weight and narrows towards its tip.
fn blade(root_m: DVec3, random: &mut Rng) -> Mesh {
    let length_m = 0.07 + 0.11 * random.f64();
    let width_m = 0.004 + 0.004 * random.f64();
    let bend = 0.3 + 1.2 * random.f64();
    let towards = DVec2::from_angle(TAU * random.f64());
    let forward = DVec3::new(towards.x, 0.0, towards.y);
    let aside = DVec3::new(-towards.y, 0.0, towards.x);

    // Starts slightly below the soil, because the soil is uneven.
    let mut middle_m = root_m - 0.005 * DVec3::Y;
    let mut middles_m = vec![middle_m];
    for segment in 0..SEGMENTS {
        let lean = 0.1 + bend * segment as f64 / SEGMENTS as f64;
        let direction = lean.sin() * forward + lean.cos() * DVec3::Y;
        middle_m += length_m / SEGMENTS as f64 * direction;
        middles_m.push(middle_m);
    }
    grid([1, SEGMENTS], [false, false], |column, row| {
        let half_width_m = 0.5 * width_m * (1.0 - row as f64 / SEGMENTS as f64);
        middles_m[row] + half_width_m * (2.0 * column as f64 - 1.0) * aside
    })
}
