//! The space in which the device computes: the scene moved to the origin and scaled to about 1.
//!
//! f32 has seven digits. A scene at 10⁵ m would lose its millimetres, and the squared distances of a scene of 1 mm would be denormal.
//! Origin and scale are chosen in f64; the scale is a power of two, so that scaling rounds nothing.

use glam::DVec3;

use crate::scene::BoundingBox;

/// Maps world positions to local ones and back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalSpace {
    /// World position of the local origin.
    pub origin_m: DVec3,
    /// Length of a local unit, a power of two.
    pub metres_per_unit: f64,
}

impl Default for LocalSpace {
    /// World space itself.
    fn default() -> Self {
        LocalSpace {
            origin_m: DVec3::ZERO,
            metres_per_unit: 1.0,
        }
    }
}

impl LocalSpace {
    /// The space of a scene: every coordinate of its surfaces is within −1 and 1. A scene without surfaces gets world space.
    pub fn of(bounds: Option<BoundingBox>) -> Self {
        let Some(bounds) = bounds else {
            return LocalSpace::default();
        };
        let half_extent = 0.5 * (bounds.max_m - bounds.min_m).max_element();
        let scale = half_extent.log2().ceil().exp2();
        LocalSpace {
            origin_m: bounds.centre_m(),
            // A single point has no extent.
            metres_per_unit: if scale.is_normal() { scale } else { 1.0 },
        }
    }

    /// Local coordinates of a world position, rounded to f32.
    pub fn to_local(&self, world_m: DVec3) -> [f32; 3] {
        ((world_m - self.origin_m) / self.metres_per_unit)
            .as_vec3()
            .to_array()
    }

    /// World position of local coordinates, metres.
    pub fn to_world(&self, local: [f32; 3]) -> DVec3 {
        self.origin_m + self.metres_per_unit * DVec3::from(local.map(f64::from))
    }

    /// Converts a length in metres to local units.
    pub fn length(&self, length_m: f64) -> f64 {
        length_m / self.metres_per_unit
    }
}
