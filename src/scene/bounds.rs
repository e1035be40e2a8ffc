//! What encloses a scene.

use glam::DVec3;

/// A sphere that holds every vertex of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingSphere {
    pub centre_m: DVec3,
    pub radius_m: f64,
}
