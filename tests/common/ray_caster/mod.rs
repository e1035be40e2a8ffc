//! A ray caster in f64 over a scene's triangles, as the reference for the rasterised maps.

pub mod pixel;

use camlux::scene::Scene;
use glam::DVec3;

/// Maximum number of triangles of a leaf.
const LEAF_TRIANGLES: usize = 4;

/// All triangles of a scene, two-sided, in a BVH.
pub struct RayCaster {
    triangles: Vec<Triangle>,
    nodes: Vec<Node>,
}

pub struct Triangle {
    pub corner_m: DVec3,
    pub edge1_m: DVec3,
    pub edge2_m: DVec3,
    /// Index into the scene's meshes.
    pub mesh: usize,
    /// Index into the mesh's triangles.
    pub index: usize,
}

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// In lengths of the ray's direction.
    pub distance: f64,
    pub position_m: DVec3,
    /// Unit normal of the triangle, on the side that the ray hits.
    pub normal: DVec3,
    /// Barycentric coordinates of the triangle's second and third corner.
    pub barycentric: [f64; 2],
    pub mesh: usize,
    /// Index into the mesh's triangles.
    pub triangle: usize,
}

struct Node {
    min_m: DVec3,
    max_m: DVec3,
    /// The triangles of a leaf. Empty for an inner node, whose children are the next node and `second_child`.
    triangles: std::ops::Range<usize>,
    second_child: usize,
}

impl RayCaster {
    pub fn new(scene: &Scene) -> RayCaster {
        let mut triangles = Vec::new();
        for (mesh_index, instance) in scene.meshes.iter().enumerate() {
            let place = |&at_m: &DVec3| instance.to_world.transform_point3(at_m);
            let positions_m: Vec<DVec3> = instance.positions_m.iter().map(place).collect();
            for (index, corners) in instance.triangles.iter().enumerate() {
                let [a, b, c] = corners.map(|corner| positions_m[corner as usize]);
                triangles.push(Triangle {
                    corner_m: a,
                    edge1_m: b - a,
                    edge2_m: c - a,
                    mesh: mesh_index,
                    index,
                });
            }
        }
        let mut caster = RayCaster {
            nodes: Vec::new(),
            triangles,
        };
        if !caster.triangles.is_empty() {
            caster.build(0..caster.triangles.len());
        }
        caster
    }

    /// The first surface on the ray beyond its origin.
    pub fn nearest(&self, origin_m: DVec3, direction: DVec3) -> Option<Hit> {
        self.nearest_in(origin_m, direction, 0.0, f64::INFINITY)
    }

    /// The first surface on the ray between two distances, in lengths of `direction`.
    pub fn nearest_in(&self, origin_m: DVec3, direction: DVec3, from: f64, to: f64) -> Option<Hit> {
        let mut nearest: Option<(f64, [f64; 2], &Triangle)> = None;
        let mut to = to;
        let mut pending = if self.nodes.is_empty() {
            vec![]
        } else {
            vec![0]
        };
        while let Some(index) = pending.pop() {
            let node = &self.nodes[index];
            if !node.meets(origin_m, direction.recip(), from, to) {
                continue;
            }
            if node.triangles.is_empty() {
                pending.extend([node.second_child, index + 1]);
            }
            for triangle in &self.triangles[node.triangles.clone()] {
                if let Some((distance, barycentric)) = triangle.meets(origin_m, direction)
                    && distance > from
                    && distance < to
                {
                    to = distance;
                    nearest = Some((distance, barycentric, triangle));
                }
            }
        }
        nearest.map(|(distance, barycentric, triangle)| {
            let normal = triangle.edge1_m.cross(triangle.edge2_m).normalize();
            let [b1, b2] = barycentric;
            Hit {
                distance,
                // Computed from the triangle, because rounding along the ray grows with the distance.
                position_m: triangle.corner_m + b1 * triangle.edge1_m + b2 * triangle.edge2_m,
                normal: if normal.dot(direction) > 0.0 {
                    -normal
                } else {
                    normal
                },
                barycentric,
                mesh: triangle.mesh,
                triangle: triangle.index,
            }
        })
    }

    /// Appends the tree over some triangles; returns its first node.
    fn build(&mut self, range: std::ops::Range<usize>) -> usize {
        let triangles = &mut self.triangles[range.clone()];
        let corners = || triangles.iter().flat_map(Triangle::corners_m);
        let min_m = corners().fold(DVec3::INFINITY, DVec3::min);
        let max_m = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let index = self.nodes.len();
        self.nodes.push(Node {
            min_m,
            max_m,
            triangles: 0..0,
            second_child: 0,
        });
        if triangles.len() <= LEAF_TRIANGLES {
            self.nodes[index].triangles = range;
            return index;
        }
        let extent = max_m - min_m;
        let axis = (0..3)
            .max_by(|&a, &b| extent[a].total_cmp(&extent[b]))
            .unwrap_or(0);
        let half = triangles.len() / 2;
        let key = |triangle: &Triangle| triangle.corners_m().map(|c| c[axis]).iter().sum::<f64>();
        triangles.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
        self.build(range.start..range.start + half);
        self.nodes[index].second_child = self.build(range.start + half..range.end);
        index
    }
}

impl Triangle {
    fn corners_m(&self) -> [DVec3; 3] {
        [
            self.corner_m,
            self.corner_m + self.edge1_m,
            self.corner_m + self.edge2_m,
        ]
    }

    /// Distance and barycentric coordinates (Möller & Trumbore 1997).
    fn meets(&self, origin_m: DVec3, direction: DVec3) -> Option<(f64, [f64; 2])> {
        // A ray through a shared edge must not slip between the triangles.
        const SLACK: f64 = 1e-12;
        let p = direction.cross(self.edge2_m);
        let determinant = self.edge1_m.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let from_corner = origin_m - self.corner_m;
        let b1 = from_corner.dot(p) / determinant;
        let q = from_corner.cross(self.edge1_m);
        let b2 = direction.dot(q) / determinant;
        let is_inside = b1 >= -SLACK && b2 >= -SLACK && b1 + b2 <= 1.0 + SLACK;
        is_inside.then(|| (self.edge2_m.dot(q) / determinant, [b1, b2]))
    }
}

impl Node {
    /// Whether the ray passes through the box between two distances (slab test).
    fn meets(&self, origin_m: DVec3, inverse_direction: DVec3, from: f64, to: f64) -> bool {
        let a = (self.min_m - origin_m) * inverse_direction;
        let b = (self.max_m - origin_m) * inverse_direction;
        // A ray within a slab's face gives 0·∞, which is NaN. `f64::min` and `f64::max` ignore NaN, which keeps the box.
        let pick = |f: fn(f64, f64) -> f64, axis: usize| f(a[axis], b[axis]);
        let entry = (0..3).map(|axis| pick(f64::min, axis)).fold(from, f64::max);
        let exit = (0..3).map(|axis| pick(f64::max, axis)).fold(to, f64::min);
        // Rounding of the slabs: 1e-12 of the distance.
        entry <= exit * (1.0 + 1e-12) + f64::MIN_POSITIVE
    }
}
