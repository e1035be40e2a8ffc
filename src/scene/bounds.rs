//! How far the surfaces of a scene reach.

use glam::{BVec3, DVec3};

use super::{Instance, Scene};

/// Axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingBox {
    pub min_m: DVec3,
    pub max_m: DVec3,
}

impl BoundingBox {
    /// The least box around points; None without any.
    pub fn around(points_m: impl Iterator<Item = DVec3>) -> Option<BoundingBox> {
        let boxes = points_m.map(|point_m| BoundingBox {
            min_m: point_m,
            max_m: point_m,
        });
        boxes.reduce(|a, b| BoundingBox {
            min_m: a.min_m.min(b.min_m),
            max_m: a.max_m.max(b.max_m),
        })
    }

    pub fn centre_m(&self) -> DVec3 {
        0.5 * (self.min_m + self.max_m)
    }

    pub(crate) fn corners_m(&self) -> [DVec3; 8] {
        let is_max = |corner: usize| BVec3::new(corner & 1 != 0, corner & 2 != 0, corner & 4 != 0);
        std::array::from_fn(|corner| DVec3::select(is_max(corner), self.max_m, self.min_m))
    }
}

/// A sphere around the surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingSphere {
    pub centre_m: DVec3,
    pub radius_m: f64,
}

impl Scene {
    /// Triangles of all meshes.
    pub fn triangle_count(&self) -> u64 {
        let triangles = self.meshes.iter().map(|mesh| mesh.triangles.len() as u64);
        triangles.sum()
    }

    /// The box around every vertex that a triangle uses; None without triangles. For a validated scene.
    pub fn bounding_box(&self) -> Option<BoundingBox> {
        BoundingBox::around(self.triangle_corners_m().flatten())
    }

    /// A sphere around every vertex that a triangle uses; None without triangles. For a validated scene.
    ///
    /// Its centre is the area-weighted centroid of the triangles (the mean of their corners, where all areas are 0), its
    /// radius the largest distance to a used vertex. So it turns with the scene, which the sphere around an axis-aligned box
    /// does not, and depends neither on the order of the meshes nor on how finely a surface is tessellated: a shadow map
    /// fitted to it has the same texels however the scene is turned or cut. It is not the smallest such sphere.
    pub fn bounding_sphere(&self) -> Option<BoundingSphere> {
        // Sums are taken about a point of the scene: at 10⁷ m from 0, sums about 0 would lose the detail.
        let origin_m = self.bounding_box()?.centre_m();
        let centroid = |weight_of: fn([DVec3; 3]) -> f64| {
            let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
            for corners in self.triangle_corners_m() {
                let corners = corners.map(|corner| corner - origin_m);
                let weight = weight_of(corners);
                sum += weight * (corners.iter().sum::<DVec3>() / 3.0);
                weights += weight;
            }
            (weights > 0.0).then(|| sum / weights)
        };
        let area_of = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
        let centre_m = origin_m + centroid(area_of).or_else(|| centroid(|_| 1.0))?;
        let radius_m = self
            .triangle_corners_m()
            .flatten()
            .map(|corner| corner.distance(centre_m))
            .fold(0.0, f64::max);
        Some(BoundingSphere { centre_m, radius_m })
    }

    /// The same sphere. Where there is nothing, or only a point, its radius is 1 m, for a light must emit into something.
    pub(crate) fn bounding_sphere_or_unit(&self) -> BoundingSphere {
        let sphere = self.bounding_sphere();
        let radius_m = sphere.map_or(0.0, |sphere| sphere.radius_m);
        BoundingSphere {
            centre_m: sphere.map_or(DVec3::ZERO, |sphere| sphere.centre_m),
            radius_m: if radius_m > 0.0 { radius_m } else { 1.0 },
        }
    }

    fn triangle_corners_m(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.meshes.iter().flat_map(Instance::corners_m)
    }
}
