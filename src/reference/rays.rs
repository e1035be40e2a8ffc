//! Ray tracing among triangles: a tree of boxes in f32, and triangles in f64.
//!
//! The boxes only cull. They are widened by more than the rounding of f32 rays, so no hit is lost. A watertight f64 test decides the hits:
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013).

use std::{fmt, time::Duration};

use glam::{DVec2, DVec3};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
    ray::{Ray as BoxRay, RayHit},
};

/// Margin of the boxes around their contents, in units of the scene's size. f32 rays within the scene are off by up to 2⁻²⁴ in origin,
/// direction and each step of the slab test.
const BOX_SLACK: f32 = 1e-6;

/// For a ray that starts on no triangle, or leads to none.
const NO_TRIANGLE: u32 = u32::MAX;

/// The triangles of a scene, coordinates within −1 and 1.
#[derive(Default)]
pub struct Triangles {
    tree: Bvh2,
    /// In the order of the tree's leaves: corners, and index in the given order.
    triangles: Vec<([[f64; 3]; 3], u32)>,
}

/// A segment or a half line.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    pub origin: DVec3,
    /// Any length but zero.
    pub direction: DVec3,
    /// The ray ends at origin + end · direction; infinite for a half line.
    pub end: f64,
    /// The triangle that the ray starts on, which it cannot hit.
    pub from_triangle: u32,
    /// The triangle that the ray leads to, which does not block it.
    pub to_triangle: u32,
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// In units of the length of the ray's direction.
    pub distance: f64,
    /// Index in the given order of the triangles.
    pub triangle: u32,
    /// Barycentric coordinates of the three corners.
    pub weights: [f64; 3],
}

impl Triangles {
    pub fn new(corners: &[[DVec3; 3]]) -> Triangles {
        if corners.is_empty() {
            return Triangles::default();
        }
        let boxes: Vec<Aabb> = corners.iter().map(widened_bounds).collect();
        let parameters = BvhBuildParams {
            max_prims_per_leaf: 2,
            ..BvhBuildParams::medium_build()
        };
        let mut tree = build_bvh2(&boxes, parameters, &mut Duration::default());
        // Stack size of a search. The builder sets it before it moves nodes.
        tree.max_depth = depth_of(&tree);
        let triangle = |&place: &u32| (corners[place as usize].map(|c| c.to_array()), place);
        Triangles {
            triangles: tree.primitive_indices.iter().map(triangle).collect(),
            tree,
        }
    }

    /// The nearest hit on the ray that `is_there` accepts.
    pub fn nearest(&self, ray: &Ray, is_there: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let search = Search::new(ray)?;
        let mut nearest: Option<Hit> = None;
        let test = |_: &BoxRay, leaf: usize| {
            let end = nearest.map_or(ray.end, |hit| hit.distance);
            let (corners, triangle) = &self.triangles[leaf];
            let hit = search.hit(corners, *triangle, end);
            let Some(hit) = hit.filter(&is_there) else {
                return f32::INFINITY;
            };
            nearest = Some(hit);
            search.box_distance(hit.distance * search.length)
        };
        self.tree
            .ray_traverse(search.box_ray, &mut RayHit::none(), test);
        nearest
    }

    /// Whether no hit that `is_there` accepts is between the two ends.
    pub fn is_free(&self, ray: &Ray, is_there: impl Fn(&Hit) -> bool) -> bool {
        let Some(search) = Search::new(ray) else {
            return true;
        };
        let test = |_: &BoxRay, leaf: usize| {
            let (corners, triangle) = &self.triangles[leaf];
            let hit = search.hit(corners, *triangle, ray.end);
            match hit.filter(&is_there) {
                Some(_) => f32::NEG_INFINITY,
                None => f32::INFINITY,
            }
        };
        self.tree.ray_traverse_miss(search.box_ray, test)
    }
}

impl Ray {
    /// A half line that starts on no triangle.
    pub fn half_line(origin: DVec3, direction: DVec3) -> Ray {
        Ray {
            origin,
            direction,
            end: f64::INFINITY,
            from_triangle: NO_TRIANGLE,
            to_triangle: NO_TRIANGLE,
        }
    }
}

impl fmt::Debug for Triangles {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.debug_struct("Triangles").finish_non_exhaustive()
    }
}

/// Iterates instead of recursing: a tree may be as deep as its number of triangles.
fn depth_of(tree: &Bvh2) -> usize {
    let mut depth = 0;
    let mut level = vec![0];
    while !level.is_empty() {
        let nodes = level.iter().map(|&index: &u32| &tree.nodes[index as usize]);
        let inner = nodes.filter(|node| !node.is_leaf());
        level = inner
            .flat_map(|node| [node.first_index, node.first_index + 1])
            .collect();
        depth += 1;
    }
    depth
}

fn widened_bounds([a, b, c]: &[DVec3; 3]) -> Aabb {
    let [low, high] = [a.min(*b).min(*c), a.max(*b).max(*c)].map(|corner| corner.as_vec3a());
    Aabb::new(low - BOX_SLACK, high + BOX_SLACK)
}

/// Values computed once for each ray.
struct Search<'r> {
    ray: &'r Ray,
    /// Length of the ray's direction.
    length: f64,
    /// An f32 ray of unit direction that begins where the ray enters the scene's bounds.
    box_ray: BoxRay,
    /// Distance to that point.
    start: f64,
    /// The ray's main axis is the last one. Shearing the other two aligns the ray with it.
    axes: [usize; 3],
    shear: DVec2,
    /// In the order of `axes`.
    origin: [f64; 3],
    main_slope: f64,
}

impl Search<'_> {
    /// `None` for a ray that misses the scene.
    fn new(ray: &Ray) -> Option<Search<'_>> {
        let length = ray.direction.length();
        let direction = ray.direction / length;
        if !direction.is_finite() {
            return None;
        }
        let bound = DVec3::splat(1.0 + 2.0 * f64::from(BOX_SLACK));
        let inverse = direction.recip();
        let [low, high] = [-bound, bound].map(|bound| (bound - ray.origin) * inverse);
        let (mut start, mut end) = (0.0, length * ray.end);
        for axis in 0..3 {
            // A ray along a face of these bounds gives NaN and is culled. The bounds are wider than the scene, so nothing is there.
            start = f64::max(start, low[axis].min(high[axis]));
            end = f64::min(end, low[axis].max(high[axis]));
        }
        if start > end {
            return None;
        }
        let origin = ray.origin + start * direction;
        let main = direction.abs().max_position();
        let axes = [(main + 1) % 3, (main + 2) % 3, main];
        let [x, y, z] = axes.map(|axis| ray.direction[axis]);
        let mut search = Search {
            ray,
            length,
            box_ray: BoxRay::new_inf(origin.as_vec3a(), direction.as_vec3a()),
            start,
            axes,
            shear: DVec2::new(x, y) / z,
            origin: axes.map(|axis| ray.origin[axis]),
            main_slope: z,
        };
        search.box_ray.tmax = search.box_distance(end);
        Some(search)
    }

    /// Distance from the start of the f32 ray, rounded up to the next f32.
    fn box_distance(&self, distance: f64) -> f32 {
        ((distance - self.start) as f32).next_up()
    }

    /// Hit of the ray with a triangle before `end`.
    fn hit(&self, corners: &[[f64; 3]; 3], triangle: u32, end: f64) -> Option<Hit> {
        let [x, y, z] = self.axes;
        let depths = corners.map(|corner| corner[z] - self.origin[2]);
        let [a, b, c] = [0, 1, 2].map(|i| {
            let offset = DVec2::new(
                corners[i][x] - self.origin[0],
                corners[i][y] - self.origin[1],
            );
            offset - self.shear * depths[i]
        });
        let weights @ [u, v, w] = [c.perp_dot(b), a.perp_dot(c), b.perp_dot(a)];
        // On an edge, both of its triangles are hit.
        let is_inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        let determinant = u + v + w;
        let is_own = [self.ray.from_triangle, self.ray.to_triangle].contains(&triangle);
        if !is_inside || determinant == 0.0 || is_own {
            return None;
        }
        let inverse = 1.0 / determinant;
        let depth = u * depths[0] + v * depths[1] + w * depths[2];
        let distance = depth * inverse / self.main_slope;
        (distance > 0.0 && distance < end).then(|| Hit {
            distance,
            triangle,
            weights: weights.map(|weight| weight * inverse),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Coordinates in −1 to 1.
    fn vector(random: &mut fastrand::Rng) -> DVec3 {
        DVec3::from([0; 3].map(|_| 2.0 * random.f64() - 1.0))
    }

    /// Möller & Trumbore 1997.
    fn distance_to(corners: &[DVec3; 3], ray: &Ray) -> Option<f64> {
        let [a, b, c] = *corners;
        let p = ray.direction.cross(c - a);
        let determinant = (b - a).dot(p);
        let u = (ray.origin - a).dot(p) / determinant;
        let q = (ray.origin - a).cross(b - a);
        let v = ray.direction.dot(q) / determinant;
        let distance = (c - a).dot(q) / determinant;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(distance)
    }

    #[test]
    fn the_tree_finds_what_a_search_through_all_finds() {
        let random = &mut fastrand::Rng::with_seed(1);
        for size in [0.02, 0.2, 1.0] {
            let corners: Vec<[DVec3; 3]> = (0..500)
                .map(|_| {
                    let centre = vector(random) * (1.0 - size);
                    [0; 3].map(|_| centre + size * vector(random))
                })
                .collect();
            let triangles = Triangles::new(&corners);
            let mut hits = 0;
            for index in 0..4000 {
                // From inside, from outside, from far away, and along an axis.
                let from = vector(random) * [0.9, 3.0, 1e4, 0.9][index % 4];
                let mut direction = vector(random) - from * f64::from(index % 4 != 0);
                if index % 4 == 3 {
                    direction = DVec3::AXES[index / 4 % 3] * direction.x.signum();
                }
                let ray = Ray::half_line(from, direction);
                let all = corners
                    .iter()
                    .filter_map(|corners| distance_to(corners, &ray));
                let expected = all.fold(f64::INFINITY, f64::min);
                let found = triangles.nearest(&ray, |_| true);
                let distance = found.map_or(f64::INFINITY, |hit| hit.distance);
                assert!(
                    distance == expected || (distance / expected - 1.0).abs() < 1e-9,
                    "{ray:?}: {distance} for {expected}"
                );
                assert_eq!(triangles.is_free(&ray, |_| true), expected.is_infinite());
                if let Some(hit) = found {
                    hits += 1;
                    let [a, b, c] = corners[hit.triangle as usize];
                    let [wa, wb, wc] = hit.weights;
                    let by_weights = wa * a + wb * b + wc * c;
                    let by_distance = from + hit.distance * direction;
                    assert!(by_weights.distance(by_distance) < 1e-9);
                    let beyond = Ray {
                        end: 0.999 * hit.distance,
                        ..ray
                    };
                    assert!(triangles.is_free(&beyond, |_| true));
                }
            }
            assert!(hits > 25, "{hits} hits at size {size}");
        }
    }

    /// Rays from a point to the edges and corners of a closed mesh around it never slip out between its triangles.
    #[test]
    fn shared_edges_and_corners_are_tight() {
        let random = &mut fastrand::Rng::with_seed(2);
        // An octahedron whose faces are divided into four, with uneven corners.
        let mut faces = Vec::new();
        for signs in 0..8 {
            let sign = |bit: u32| if signs >> bit & 1 == 0 { 0.83 } else { -0.71 };
            let [x, y, z] = [
                DVec3::new(sign(0), 0.01, 0.03),
                DVec3::new(-0.02, sign(1), 0.01),
                DVec3::new(0.03, -0.01, sign(2)),
            ];
            let [xy, yz, zx] = [0.5 * (x + y), 0.5 * (y + z), 0.5 * (z + x)];
            faces.extend([[x, xy, zx], [xy, y, yz], [zx, yz, z], [xy, yz, zx]]);
        }
        let triangles = Triangles::new(&faces);
        for _ in 0..2000 {
            let from = 0.2 * vector(random);
            let [a, b, _] = faces[(random.f64() * 31.9) as usize];
            for on_edge in [a, b, a.lerp(b, 0.5), a.lerp(b, random.f64())] {
                assert!(!triangles.is_free(&Ray::half_line(from, on_edge - from), |_| true));
            }
        }
    }

    #[test]
    fn own_triangles_are_not_in_the_way() {
        let corners = [
            DVec3::new(-0.5, 0.0, -0.5),
            DVec3::new(0.5, 0.0, -0.5),
            DVec3::new(0.0, 0.0, 0.5),
        ];
        let triangles = Triangles::new(&[corners]);
        let down = Ray::half_line(0.5 * DVec3::Y, DVec3::NEG_Y);
        assert!(!triangles.is_free(&down, |_| true));
        let [mut from, mut to, mut short] = [down; 3];
        from.from_triangle = 0;
        to.to_triangle = 0;
        short.end = 0.5;
        for own in [from, to, short] {
            assert!(triangles.is_free(&own, |_| true), "{own:?}");
        }
        assert!(Triangles::new(&[]).nearest(&down, |_| true).is_none());
    }
}
