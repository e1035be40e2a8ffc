//! The space in which the device computes: the scene moved to the origin and scaled to about 1.
//!
//! f32 has seven digits. A scene at 10⁵ m would lose its millimetres, one of 1 mm would square its distances into
//! denormal numbers. Origin and scale are chosen in f64; the scale is a power of two, so that scaling rounds nothing.

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
    /// The world itself.
    fn default() -> Self {
        LocalSpace {
            origin_m: DVec3::ZERO,
            metres_per_unit: 1.0,
        }
    }
}

impl LocalSpace {
    /// The space of a scene: every coordinate of its surfaces lies within −1 and 1. A scene without surfaces gets the
    /// world itself.
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

    /// A length in metres as a local one.
    pub fn length(&self, length_m: f64) -> f64 {
        length_m / self.metres_per_unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn far_positions_keep_their_detail() {
        let far = DVec3::new(1e7, -2e6, 3e5);
        let bounds = BoundingBox {
            min_m: far,
            max_m: far + DVec3::new(3.0, 1.0, 2.0),
        };
        let space = LocalSpace::of(Some(bounds));
        let point = far + DVec3::new(1.234567, 0.5, 1.999);
        let error_m = (space.to_world(space.to_local(point)) - point).length();
        // Half an ulp of f32 at 1 local unit (2 m) is 1.2e-7 m; half an ulp of f64 at 1e7 m is 1e-9 m.
        assert!(error_m < 2.5e-7, "{error_m}");
    }

    #[test]
    fn a_scene_of_one_point_has_a_space() {
        let point = DVec3::splat(5.0);
        let bounds = BoundingBox {
            min_m: point,
            max_m: point,
        };
        assert_eq!(LocalSpace::of(Some(bounds)).metres_per_unit, 1.0);
    }
}
