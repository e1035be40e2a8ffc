//! The rays of a camera's pixels and of a light's texels.

use crate::common::texels::{texel_direction, texel_origin_m};
use camlux::{
    Scene,
    emission::{EmissionDomain, Projection},
};
use glam::DVec3;

use super::{Hit, RayCaster};

/// A pixel is at an edge if a ray this far from its centre hits another triangle.
const EDGE_PX: f64 = 1.0 / 32.0;

/// A ray through a pixel's centre and the steps to the neighbouring pixels' rays.
pub struct PixelRay {
    pub origin_m: DVec3,
    pub direction: DVec3,
    /// What a step of one pixel to the right and down adds to origin and direction.
    steps: [[DVec3; 2]; 2],
}

impl PixelRay {
    /// What the ray hits, and whether it is away from edges.
    pub fn cast(&self, caster: &RayCaster) -> (Option<Hit>, bool) {
        self.cast_by(|origin_m, direction| caster.nearest(origin_m, direction))
    }

    /// The same, if `nearest` says what a ray from an origin in a direction hits.
    pub fn cast_by(&self, nearest: impl Fn(DVec3, DVec3) -> Option<Hit>) -> (Option<Hit>, bool) {
        let at = |x: f64, y: f64| {
            let [[origin_x, direction_x], [origin_y, direction_y]] = self.steps;
            nearest(
                self.origin_m + x * origin_x + y * origin_y,
                self.direction + x * direction_x + y * direction_y,
            )
        };
        let hit = at(0.0, 0.0);
        let triangle = |hit: Option<Hit>| hit.map(|hit| (hit.mesh, hit.triangle));
        let is_inside = [-1.0, 0.0, 1.0].iter().all(|x| {
            let rows = [-1.0, 0.0, 1.0];
            rows.iter()
                .all(|y| triangle(at(x * EDGE_PX, y * EDGE_PX)) == triangle(hit))
        });
        (hit, is_inside)
    }

    /// The camera's ray through a pixel.
    pub fn of_camera(scene: &Scene, x: u32, y: u32) -> PixelRay {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let camera = &scene.camera;
        let (origin_m, direction) = (camera.ray_origin_m(x, y), camera.ray_direction(x, y));
        let step_to = |x: f64, y: f64| {
            [
                camera.ray_origin_m(x, y) - origin_m,
                camera.ray_direction(x, y) - direction,
            ]
        };
        PixelRay {
            origin_m,
            direction,
            steps: [step_to(x + 1.0, y), step_to(x, y + 1.0)],
        }
    }

    /// A light's ray through a texel of its RSM.
    pub fn of_texel(domain: &EmissionDomain, face: usize, x: u32, y: u32) -> PixelRay {
        let face = &domain.faces[face];
        let texel = 2.0 * face.half_extent / f64::from(domain.size);
        let step = |axis: DVec3| match domain.projection {
            Projection::Perspective => [DVec3::ZERO, texel * axis],
            Projection::Orthographic => [texel * axis, DVec3::ZERO],
        };
        PixelRay {
            origin_m: texel_origin_m(domain, face, x, y),
            direction: texel_direction(domain, face, x, y),
            steps: [step(face.right), step(-face.up)],
        }
    }
}
