//! An animal with a rough coat in a room. Its rounded limbs blend into each other.

use glam::{DAffine3, DVec3};

use super::isosurface::isosurface;
use super::materials::FUR;
use super::noise::octaves;
use super::room::open_room;
use super::{Part, part};

/// Cells of the lattice on which the surface is found: about 70 000 triangles.
const CELL_M: f64 = 0.0088;

/// The volume of a ball that rolls from one point to another while its radius changes.
struct Limb {
    from_m: DVec3,
    to_m: DVec3,
    from_radius_m: f64,
    to_radius_m: f64,
}

const fn limb(from_m: [f64; 3], to_m: [f64; 3], from_radius_m: f64, to_radius_m: f64) -> Limb {
    Limb {
        from_m: DVec3::from_array(from_m),
        to_m: DVec3::from_array(to_m),
        from_radius_m,
        to_radius_m,
    }
}

/// The animal looks along +x.
const LIMBS: [Limb; 14] = [
    limb([-0.27, 0.47, 0.0], [0.24, 0.49, 0.0], 0.165, 0.175),
    limb([0.26, 0.52, 0.0], [0.44, 0.74, 0.0], 0.12, 0.085),
    limb([0.44, 0.78, 0.0], [0.63, 0.70, 0.0], 0.105, 0.055),
    // Ears.
    limb([0.41, 0.85, 0.07], [0.37, 0.99, 0.11], 0.035, 0.018),
    limb([0.41, 0.85, -0.07], [0.37, 0.99, -0.11], 0.035, 0.018),
    // Legs and feet.
    limb([0.22, 0.42, 0.10], [0.24, 0.06, 0.12], 0.085, 0.048),
    limb([0.22, 0.42, -0.10], [0.17, 0.06, -0.12], 0.085, 0.048),
    limb([-0.27, 0.42, 0.10], [-0.32, 0.06, 0.12], 0.105, 0.048),
    limb([-0.27, 0.42, -0.10], [-0.24, 0.06, -0.12], 0.105, 0.048),
    limb([0.24, 0.05, 0.12], [0.31, 0.045, 0.13], 0.05, 0.04),
    limb([0.17, 0.05, -0.12], [0.24, 0.045, -0.13], 0.05, 0.04),
    limb([-0.32, 0.05, 0.12], [-0.25, 0.045, 0.13], 0.05, 0.04),
    limb([-0.24, 0.05, -0.12], [-0.17, 0.045, -0.13], 0.05, 0.04),
    // Tail.
    limb([-0.40, 0.52, 0.0], [-0.62, 0.74, 0.06], 0.05, 0.026),
];

pub fn parts() -> Vec<Part> {
    let min_m = DVec3::new(-0.75, -0.02, -0.35);
    let max_m = DVec3::new(0.78, 1.08, 0.35);
    let animal = isosurface([min_m, max_m], CELL_M, height_m);
    let turned = animal.transformed(DAffine3::from_rotation_y(-0.5));
    let mut parts = open_room([2.4, 2.0, 2.4]);
    parts.push(part(FUR, turned));
    parts
}

/// Approximate distance from the animal's surface, negative inside.
fn height_m(place_m: DVec3) -> f64 {
    const BLEND_M: f64 = 0.05;
    const COAT_M: f64 = 0.006;
    let distances_m = LIMBS.iter().map(|limb| limb.distance_m(place_m));
    let smooth_m = distances_m.fold(f64::MAX, |a, b| smooth_minimum(a, b, BLEND_M));
    if smooth_m.abs() > 5.0 * COAT_M {
        // Far from the surface only the sign matters.
        return smooth_m;
    }
    smooth_m + COAT_M * octaves(place_m * 22.0, 3)
}

impl Limb {
    fn distance_m(&self, place_m: DVec3) -> f64 {
        let axis_m = self.to_m - self.from_m;
        let share = (place_m - self.from_m).dot(axis_m) / axis_m.length_squared();
        let share = share.clamp(0.0, 1.0);
        let radius_m = self.from_radius_m + share * (self.to_radius_m - self.from_radius_m);
        place_m.distance(self.from_m + share * axis_m) - radius_m
    }
}

/// The smaller of two distances, rounded where they are within `blend` of each other (Quilez).
fn smooth_minimum(a: f64, b: f64, blend: f64) -> f64 {
    let overlap = (blend - (a - b).abs()).max(0.0);
    a.min(b) - overlap * overlap / (4.0 * blend)
}
