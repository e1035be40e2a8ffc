//! A gorge between ridges: a height field.

use glam::DVec3;

use super::materials::ROCK;
use super::noise::{noise, octaves};
use super::shapes::grid;
use super::{Part, part};

const SIZE_M: f64 = 1_000.0;
/// Quads along an edge: 125 000 triangles.
const QUADS: usize = 250;

pub fn parts() -> Vec<Part> {
    let share = |index| index as f64 / QUADS as f64 - 0.5;
    let ground = grid([QUADS, QUADS], [false, false], |column, row| {
        let x_m = SIZE_M * share(column);
        let z_m = -SIZE_M * share(row);
        DVec3::new(x_m, height_m(x_m, z_m), z_m)
    });
    vec![part(ROCK, ground)]
}

/// Height of ridged mountains with a winding gorge that a river has cut along z.
fn height_m(x_m: f64, z_m: f64) -> f64 {
    let place = DVec3::new(x_m, 0.0, z_m);
    let river_m = 70.0 * (z_m / 140.0).sin() + 40.0 * noise(DVec3::new(0.5, 0.0, z_m / 120.0));
    let from_river_m = (x_m - river_m).abs();
    let slope = (from_river_m / 160.0).min(1.0);
    // Steep at the river and flat above, with sharp crests where the noise changes sign.
    let valley_m = 150.0 * slope.powf(0.7);
    let crests_m = 70.0 * (1.0 - noise(place / 110.0 + 3.7).abs()) * slope;
    let rough_m = (6.0 + 16.0 * slope) * octaves(place / 60.0, 5);
    valley_m + crests_m + rough_m
}
