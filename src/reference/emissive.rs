//! The surfaces that emit, as lights.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::{
    light::{Beam, Emitter},
    rays::Hit,
    surface::Surfaces,
};
use crate::scene::Material;

/// A side of a triangle that emits.
#[derive(Debug, Clone, Copy)]
struct Side {
    triangle: u32,
    is_back: bool,
    /// Radiance times area, without the texture, all bands together; and the sum of it up to this side.
    weight: f64,
    end: f64,
}

/// All sides that emit.
#[derive(Debug, Clone)]
pub struct EmissiveSides(Vec<Side>);

impl EmissiveSides {
    /// `None` if no surface emits.
    pub fn of(surfaces: &Surfaces) -> Option<EmissiveSides> {
        let mut sides = Vec::new();
        let mut end = 0.0;
        for (index, corners) in surfaces.triangles.iter().enumerate() {
            let triangle = index as u32;
            let [_, material] = surfaces.mesh_and_material(triangle);
            let material: &Material = &surfaces.scene.materials[material as usize];
            let radiance: f64 = material.emission_w_sr_m2.iter().sum();
            if radiance == 0.0 {
                continue;
            }
            for is_back in [false, true] {
                if is_back && material.is_one_sided {
                    continue;
                }
                let weight = radiance * area(*corners);
                end += weight;
                sides.push(Side {
                    triangle,
                    is_back,
                    weight,
                    end,
                });
            }
        }
        (!sides.is_empty()).then_some(EmissiveSides(sides))
    }

    /// A point of a side, drawn in proportion to what the sides emit without textures, as a lamp that stands for all of them.
    pub fn at_point(&self, [u, v]: [f64; 2], surfaces: &Surfaces) -> Option<Emitter> {
        let total = self.0.last()?.end;
        let at = u * total;
        let side = self.0.partition_point(|side| side.end <= at);
        let side = self.0.get(side)?;
        let along = 1.0 - ((side.end - at) / side.weight).clamp(0.0, 1.0);
        // Uniform over the triangle (Turk 1990).
        let root = along.sqrt();
        let weights = [1.0 - root, root * (1.0 - v), root * v];
        let [a, b, c] = surfaces.triangles[side.triangle as usize];
        let front = (b - a).cross(c - a).normalize();
        let normal = if side.is_back { -front } else { front };
        let hit = Hit {
            distance: 0.0,
            triangle: side.triangle,
            weights,
        };
        let radiance = surfaces.emission(&hit);
        let of_all = area([a, b, c]) * total / side.weight;
        Some(Emitter::Lamp {
            position: weights[0] * a + weights[1] * b + weights[2] * c,
            beam: Beam::of_area(normal, FRAC_PI_2),
            intensity: radiance * of_all,
            area: None,
        })
    }
}

fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
