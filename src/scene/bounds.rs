//! How far the surfaces of a scene reach.

use std::collections::HashMap;

use glam::{BVec3, DMat3, DVec3};

use super::{Instance, Mesh, Scene};

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
        self.bounding_box_of(&self.extents())
    }

    /// A sphere around every vertex that a triangle uses; None without triangles. For a validated scene.
    ///
    /// Its centre is the area-weighted centroid of the triangles (the mean of their corners, where all areas are 0), its
    /// radius the largest distance to a used vertex. So it turns with the scene, which the sphere around an axis-aligned box
    /// does not, and depends neither on the order of the meshes nor on how finely a surface is tessellated: a shadow map
    /// fitted to it has the same texels however the scene is turned or cut. It is not the smallest such sphere.
    pub fn bounding_sphere(&self) -> Option<BoundingSphere> {
        let extents = self.extents();
        // Sums are taken about a point of the scene: at 10⁷ m from 0, sums about 0 would lose the detail.
        let origin_m = self.bounding_box_of(&extents)?.centre_m();
        let (mut sum, mut area_m2) = (DVec3::ZERO, 0.0);
        for instance in &self.meshes {
            let of_mesh = extents.get(&instance.mesh.id());
            if let (Some(extent), Some(scale)) = (of_mesh, similarity(instance.to_world.matrix3)) {
                let own_area_m2 = scale.powi(2) * extent.area_m2;
                let centroid_m = instance.to_world.transform_point3(extent.centroid_m);
                sum += own_area_m2 * (centroid_m - origin_m);
                area_m2 += own_area_m2;
            } else {
                let (own_sum, own_area_m2) = area_moment(instance.corners_m(), origin_m);
                sum += own_sum;
                area_m2 += own_area_m2;
            }
        }
        let centre_m = if area_m2 > 0.0 {
            origin_m + sum / area_m2
        } else {
            let corners_m = || self.meshes.iter().flat_map(Instance::corners_m).flatten();
            let offsets = corners_m().map(|corner_m| corner_m - origin_m);
            origin_m + offsets.sum::<DVec3>() / corners_m().count() as f64
        };
        let mut radius_m: f64 = 0.0;
        self.for_each_vertex_m(&extents, |vertex_m| {
            radius_m = radius_m.max(vertex_m.distance(centre_m));
        });
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

    /// Of the meshes that are not where their positions say, each once however often it is placed.
    fn extents(&self) -> HashMap<usize, Extent> {
        let mut extents = HashMap::new();
        for instance in &self.meshes {
            if !instance.is_in_world_space() {
                let extent = extents.entry(instance.mesh.id());
                extent.or_insert_with(|| Extent::of(&instance.mesh));
            }
        }
        extents
    }

    fn bounding_box_of(&self, extents: &HashMap<usize, Extent>) -> Option<BoundingBox> {
        let mut bounds: Option<BoundingBox> = None;
        self.for_each_vertex_m(extents, |vertex_m| {
            let (min_m, max_m) = (vertex_m, vertex_m);
            let grown = bounds.map_or(BoundingBox { min_m, max_m }, |b| BoundingBox {
                min_m: b.min_m.min(vertex_m),
                max_m: b.max_m.max(vertex_m),
            });
            bounds = Some(grown);
        });
        bounds
    }

    /// Every vertex that a triangle uses, once or more.
    fn for_each_vertex_m(&self, extents: &HashMap<usize, Extent>, mut visit: impl FnMut(DVec3)) {
        for instance in &self.meshes {
            match extents.get(&instance.mesh.id()) {
                Some(extent) => {
                    let used = extent.used_vertices_m.iter();
                    used.for_each(|&at_m| visit(instance.to_world.transform_point3(at_m)));
                }
                None => instance.corners_m().flatten().for_each(&mut visit),
            }
        }
    }
}

/// How far a mesh reaches in its own space.
struct Extent {
    used_vertices_m: Vec<DVec3>,
    area_m2: f64,
    centroid_m: DVec3,
}

impl Extent {
    fn of(mesh: &Mesh) -> Extent {
        let mut is_used = vec![false; mesh.positions_m.len()];
        for &corner in mesh.triangles.as_flattened() {
            is_used[corner as usize] = true;
        }
        let vertices = mesh.positions_m.iter().zip(is_used);
        let used = vertices.filter_map(|(&at_m, is_used)| is_used.then_some(at_m));
        let used_vertices_m: Vec<DVec3> = used.collect();
        let bounds = BoundingBox::around(used_vertices_m.iter().copied());
        let origin_m = bounds.map_or(DVec3::ZERO, |bounds| bounds.centre_m());
        let (sum, area_m2) = area_moment(mesh.corners_m(), origin_m);
        Extent {
            used_vertices_m,
            area_m2,
            centroid_m: origin_m + sum / area_m2.max(f64::MIN_POSITIVE),
        }
    }
}

/// The sum of areas times offsets from an origin, and that of areas.
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

/// The factor of a matrix that turns, mirrors and scales alike along all axes.
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
