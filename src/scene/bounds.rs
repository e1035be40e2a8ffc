//! Bounds of the surfaces of a scene.

use glam::{BVec3, DMat3, DVec3};

use super::{Instance, Mesh, Scene};

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingBox {
    pub min_m: DVec3,
    pub max_m: DVec3,
}

impl BoundingBox {
    /// The smallest box around points; `None` without points.
    pub fn around(points_m: impl Iterator<Item = DVec3>) -> Option<BoundingBox> {
        let boxes = points_m.map(|point_m| BoundingBox {
            min_m: point_m,
            max_m: point_m,
        });
        boxes.reduce(BoundingBox::union)
    }

    fn union(self, other: BoundingBox) -> BoundingBox {
        BoundingBox {
            min_m: self.min_m.min(other.min_m),
            max_m: self.max_m.max(other.max_m),
        }
    }

    /// The largest distance from a point to a point of the box.
    fn reach_from(&self, point_m: DVec3) -> f64 {
        let [below, above] = [self.min_m, self.max_m].map(|corner_m| (corner_m - point_m).abs());
        below.max(above).length()
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
    /// Number of triangles of all meshes.
    pub fn triangle_count(&self) -> u64 {
        let triangles = self.meshes.iter().map(|mesh| mesh.triangles.len() as u64);
        triangles.sum()
    }

    /// The box around every vertex that a triangle uses; `None` without triangles. The scene must be validated.
    pub fn bounding_box(&self) -> Option<BoundingBox> {
        let mut bounds = None;
        for instance in &self.meshes {
            let Some(around) = instance.box_around() else {
                continue;
            };
            let with_around = bounds.map_or(around, |bounds: BoundingBox| bounds.union(around));
            // Most instances are within the box so far, so their vertices need not be read.
            if instance.is_in_world_space() || bounds == Some(with_around) {
                bounds = Some(with_around);
                continue;
            }
            let vertices = BoundingBox::around(instance.used_vertices_m());
            bounds = bounds
                .into_iter()
                .chain(vertices)
                .reduce(BoundingBox::union);
        }
        bounds
    }

    /// A sphere around every vertex that a triangle uses; `None` without triangles. The scene must be validated.
    ///
    /// The centre is the area-weighted centroid of the triangles, or the mean of their corners if all areas are 0. The radius is the
    /// largest distance to a used vertex. So the sphere rotates with the scene, unlike the sphere around an axis-aligned box. It depends
    /// neither on the order of the meshes nor on the tessellation. A shadow map fitted to it has the same texels however the scene is
    /// rotated or tessellated. It is not the smallest such sphere.
    pub fn bounding_sphere(&self) -> Option<BoundingSphere> {
        // Sums are relative to a point of the scene: at 10⁷ m from 0, sums relative to 0 would lose the detail.
        let origin_m = self.bounding_box()?.centre_m();
        let (mut sum, mut area_m2) = (DVec3::ZERO, 0.0);
        for instance in &self.meshes {
            let (own_sum, own_area_m2) = match similarity(instance.to_world.matrix3) {
                Some(scale) => {
                    let extent = instance.extent();
                    let own_area_m2 = scale.powi(2) * extent.area_m2;
                    let centroid_m = instance.to_world.transform_point3(extent.centroid_m);
                    (own_area_m2 * (centroid_m - origin_m), own_area_m2)
                }
                None => area_moment(instance.corners_m(), origin_m),
            };
            sum += own_sum;
            area_m2 += own_area_m2;
        }
        let centre_m = if area_m2 > 0.0 {
            origin_m + sum / area_m2
        } else {
            let corners_m = || self.meshes.iter().flat_map(Instance::corners_m).flatten();
            let offsets = corners_m().map(|corner_m| corner_m - origin_m);
            origin_m + offsets.sum::<DVec3>() / corners_m().count() as f64
        };
        let mut radius_m: f64 = 0.0;
        for instance in &self.meshes {
            let reach_m = instance
                .box_around()
                .map(|around| around.reach_from(centre_m));
            if reach_m.is_some_and(|reach_m| reach_m > radius_m) {
                let vertices_m = instance.used_vertices_m();
                let distances_m = vertices_m.map(|vertex_m| vertex_m.distance(centre_m));
                radius_m = distances_m.fold(radius_m, f64::max);
            }
        }
        Some(BoundingSphere { centre_m, radius_m })
    }

    /// The same sphere. Without surfaces, or with a single point, its radius is 1 m, because a light must emit into something.
    pub(crate) fn bounding_sphere_or_unit(&self) -> BoundingSphere {
        let sphere = self.bounding_sphere();
        let radius_m = sphere.map_or(0.0, |sphere| sphere.radius_m);
        BoundingSphere {
            centre_m: sphere.map_or(DVec3::ZERO, |sphere| sphere.centre_m),
            radius_m: if radius_m > 0.0 { radius_m } else { 1.0 },
        }
    }
}

impl Instance {
    /// A box in world space around the mesh's own box.
    fn box_around(&self) -> Option<BoundingBox> {
        let corners_m = self.extent().bounds?.corners_m().into_iter();
        BoundingBox::around(corners_m.map(|corner_m| self.to_world.transform_point3(corner_m)))
    }

    /// Every vertex that a triangle uses, in world space.
    fn used_vertices_m(&self) -> impl Iterator<Item = DVec3> {
        let vertices = self.positions_m.iter().zip(&self.extent().is_used);
        let used = vertices.filter_map(|(&at_m, &is_used)| is_used.then_some(at_m));
        used.map(|at_m| self.to_world.transform_point3(at_m))
    }
}

/// The bounds of a mesh in its own space.
#[derive(Debug, Clone)]
pub(super) struct Extent {
    /// For each vertex, whether a triangle uses it.
    is_used: Vec<bool>,
    bounds: Option<BoundingBox>,
    area_m2: f64,
    centroid_m: DVec3,
}

impl Extent {
    pub fn of(mesh: &Mesh) -> Extent {
        let mut is_used = vec![false; mesh.positions_m.len()];
        for &corner in mesh.triangles.as_flattened() {
            is_used[corner as usize] = true;
        }
        let used = mesh.positions_m.iter().zip(&is_used);
        let used = used.filter_map(|(&at_m, &is_used)| is_used.then_some(at_m));
        let bounds = BoundingBox::around(used);
        let origin_m = bounds.map_or(DVec3::ZERO, |bounds| bounds.centre_m());
        let (sum, area_m2) = area_moment(mesh.corners_m(), origin_m);
        Extent {
            is_used,
            bounds,
            area_m2,
            centroid_m: origin_m + sum / area_m2.max(f64::MIN_POSITIVE),
        }
    }
}

/// The sum of area times offset from an origin, and the sum of the areas.
fn area_moment(triangles_m: impl Iterator<Item = [DVec3; 3]>, origin_m: DVec3) -> (DVec3, f64) {
    let (mut sum, mut total_m2) = (DVec3::ZERO, 0.0);
    for corners in triangles_m {
        let [a, b, c] = corners.map(|corner| corner - origin_m);
        let area_m2 = 0.5 * (b - a).cross(c - a).length();
        sum += area_m2 * ([a, b, c].iter().sum::<DVec3>() / 3.0);
        total_m2 += area_m2;
    }
    (sum, total_m2)
}

/// The scale factor of a matrix that rotates, mirrors and scales equally along all axes; `None` for other matrices.
fn similarity(linear: DMat3) -> Option<f64> {
    let products = linear.transpose() * linear;
    let square = products.x_axis.x;
    let off = products - DMat3::from_diagonal(DVec3::splat(square));
    let columns = [off.x_axis, off.y_axis, off.z_axis];
    let is_even = columns
        .iter()
        .all(|column| column.abs().max_element() < 1e-12 * square);
    is_even.then(|| square.sqrt())
}
