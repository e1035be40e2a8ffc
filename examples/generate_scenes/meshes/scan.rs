//! A draped figure as a raw 3D scan: uneven triangles, noise, holes, and loose fragments.

use std::f64::consts::TAU;

use fastrand::Rng;
use glam::{DAffine3, DVec2, DVec3};

use super::materials::{CLAY, GREY};
use super::mesh::Mesh;
use super::noise::{noise, octaves};
use super::room::open_room;
use super::shapes::{block, grid, sphere};
use super::{Part, part};

const COLUMNS: usize = 190;
const ROWS: usize = 250;
const HEIGHT_M: f64 = 0.9;
const PLINTH_M: f64 = 0.25;
/// Noise of the measured points along the line of sight.
const NOISE_M: f64 = 0.0008;
const BITS: usize = 60;

pub fn parts() -> Vec<Part> {
    let mut random = Rng::with_seed(9);
    let mut figure = grid([COLUMNS, ROWS], [true, false], |column, row| {
        scanned_m(
            column,
            row,
            &mut Rng::with_seed((row * COLUMNS + column) as u64),
        )
    });
    cut_unevenly(&mut figure, &mut random);
    punch_holes(&mut figure);
    let mut scan = figure.smooth();
    for _ in 0..BITS {
        scan.append(bit(&mut random));
    }
    let mut parts = open_room([1.8, 1.7, 1.6]);
    parts.push(part(CLAY, scan.moved(0.0, PLINTH_M, 0.0)));
    parts.push(part(GREY, block(0.5, PLINTH_M, 0.5)));
    parts
}

/// A point of the figure near its row and column: the points of a scanner are not on a lattice.
fn scanned_m(column: usize, row: usize, random: &mut Rng) -> DVec3 {
    let mut jitter = || 0.7 * (random.f64() - 0.5);
    let mut turn = (column as f64 + jitter()) / COLUMNS as f64;
    let mut share = row as f64;
    if row > 0 && row < ROWS {
        share += jitter();
    }
    share /= ROWS as f64;
    // The density varies.
    share += 0.02 * (TAU * 3.0 * share).sin();
    turn += 0.02 * (TAU * 2.0 * turn).sin();
    let measured_m = radius_m(turn, share) + NOISE_M * (jitter() + jitter() + jitter());
    let around = DVec2::from_angle(-TAU * turn);
    let sway_m = 0.04 * (TAU * 0.6 * share).sin();
    DVec3::new(
        measured_m * around.x + sway_m,
        HEIGHT_M * share,
        measured_m * around.y,
    )
}

/// The figure: a robe with folds, shoulders, a neck and a head.
fn radius_m(turn: f64, share: f64) -> f64 {
    let bump = |middle: f64, width: f64| (-((share - middle) / width).powi(2)).exp();
    let robe = 0.17 * (1.0 - 0.45 * share) * (1.0 - bump(1.0, 0.22));
    let head = 0.085 * (1.0 - ((share - 0.91) / 0.095).powi(2)).max(0.0).sqrt();
    let shoulders = 0.055 * bump(0.68, 0.09) * (TAU * turn).cos().powi(2);
    let body = robe + shoulders - 0.03 * bump(0.48, 0.1);
    let folds = 0.018 * (1.0 - share).powi(2) * (TAU * (9.0 * turn + 0.8 * share)).sin();
    let around = DVec2::from_angle(TAU * turn);
    let rough = 0.004 * octaves(DVec3::new(3.0 * around.x, 9.0 * share, 3.0 * around.y), 4);
    // Closed at the top, open at the bottom.
    if share > 0.999 {
        return 0.0;
    }
    (body + folds).max(head).max(0.004) + rough.min(0.004) * (1.0 - share).min(0.1) * 10.0
}

/// Splits one triangle in eight into three at an interior point, which leaves slivers.
fn cut_unevenly(mesh: &mut Mesh, random: &mut Rng) {
    for index in 0..mesh.triangles.len() {
        if random.u32(..8) > 0 {
            continue;
        }
        let [a, b, c] = mesh.triangles[index];
        let weights = DVec3::new(random.f64(), random.f64(), random.f64()) + 0.15;
        let [p, q, r] = [a, b, c].map(|corner| mesh.positions[corner as usize]);
        let inside = (weights.x * p + weights.y * q + weights.z * r) / weights.element_sum();
        let new = mesh.positions.len() as u32;
        mesh.positions.push(inside);
        mesh.triangles[index] = [a, b, new];
        mesh.triangles.extend([[b, c, new], [c, a, new]]);
    }
}

/// What the scanner missed: patches and single triangles.
fn punch_holes(mesh: &mut Mesh) {
    let mut random = Rng::with_seed(10);
    let Mesh {
        positions,
        triangles,
        ..
    } = mesh;
    triangles.retain(|triangle| {
        let corners = triangle.map(|index| positions[index as usize]);
        let middle = corners.iter().sum::<DVec3>() / 3.0;
        noise(middle * 16.0) < 0.62 && random.u32(..300) > 0
    });
}

/// A small crumpled ball near the figure.
fn bit(random: &mut Rng) -> Mesh {
    let size_m = 0.003 + 0.006 * random.f64();
    let around = (0.2 + 0.15 * random.f64()) * DVec2::from_angle(TAU * random.f64());
    let place = DVec3::new(around.x, HEIGHT_M * random.f64(), around.y);
    let mut ball = sphere(random.u32(0..=1));
    for position in &mut ball.positions {
        *position *= size_m * (0.5 + random.f64());
    }
    ball.smooth().transformed(DAffine3::from_translation(place))
}
