//! The surfaces that emit, as lights.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::{
    light::{Beam, Emitter},
    rays::Hit,
    surface::{Surface, Surfaces},
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
    area: f64,
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
                let area = area(*corners);
                let weight = radiance * area;
                end += weight;
                sides.push(Side {
                    triangle,
                    is_back,
                    weight,
                    end,
                    area,
                });
            }
        }
        (!sides.is_empty()).then_some(EmissiveSides(sides))
    }

    /// A point of a side, drawn in proportion to what the sides emit without textures, as a lamp that stands for all of them. `None` in a
    /// hole of a cut-out.
    pub fn at_point(&self, place: [f64; 2], surfaces: &Surfaces) -> Option<Emitter> {
        let (hit, side, normal) = self.drawn(place, surfaces)?;
        if !surfaces.is_at(&hit) {
            return None;
        }
        let density = self.density(side.triangle);
        Some(Emitter::Lamp {
            position: surfaces.at(&hit, -normal).position,
            beam: Beam::of_area(normal, FRAC_PI_2),
            intensity: surfaces.emission(&hit) / density,
            area: None,
        })
    }

    /// The same point as a surface, if it faces `viewer`.
    pub fn surface_at(
        &self,
        place: [f64; 2],
        surfaces: &Surfaces,
        viewer: DVec3,
    ) -> Option<Surface> {
        let (hit, _, normal) = self.drawn(place, surfaces)?;
        let surface = surfaces.at(&hit, -normal);
        let is_facing = normal.dot(viewer - surface.position) > 0.0;
        (is_facing && surfaces.is_at(&hit)).then_some(surface)
    }

    /// The density of points on each side of a triangle, per square unit; 0 if it emits nothing.
    pub fn density(&self, triangle: u32) -> f64 {
        let first = self.0.partition_point(|side| side.triangle < triangle);
        let side = self.0.get(first).filter(|side| side.triangle == triangle);
        let total = self.0.last().map_or(1.0, |side| side.end);
        side.map_or(0.0, |side| side.weight / side.area / total)
    }

    fn drawn(&self, [u, v]: [f64; 2], surfaces: &Surfaces) -> Option<(Hit, Side, DVec3)> {
        let at = u * self.0.last()?.end;
        let side = self.0.partition_point(|side| side.end <= at);
        let side = *self.0.get(side)?;
        let along = 1.0 - ((side.end - at) / side.weight).clamp(0.0, 1.0);
        // Uniform over the triangle (Turk 1990).
        let root = along.sqrt();
        let hit = Hit {
            distance: 0.0,
            triangle: side.triangle,
            weights: [1.0 - root, root * (1.0 - v), root * v],
        };
        let [a, b, c] = surfaces.triangles[side.triangle as usize];
        let front = (b - a).cross(c - a).normalize();
        Some((hit, side, if side.is_back { -front } else { front }))
    }
}

fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
