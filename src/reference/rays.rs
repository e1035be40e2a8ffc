//! Rays among triangles: a tree of boxes with four children, whose boxes are f32 and whose triangles are f64.
//!
//! Boxes only cull. They are widened by more than the rounding of f32 rays, so no hit is lost, and what is hit is decided
//! in f64 by a watertight test: Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013).

use std::time::Duration;

use glam::{DVec3, Vec3A, Vec4};
use obvhs::{BvhBuildParams, aabb::Aabb, bvh2::Bvh2, bvh2::builder::build_bvh2};

/// Triangles of a leaf, tested side by side.
const LANES: usize = 4;

/// By how much the boxes are larger than what they hold, in units of the scene's size: f32 rays within the scene are
/// off by up to 2⁻²⁴ in origin, direction and each step of the slab test.
const BOX_SLACK: f32 = 1e-6;

/// Marks a triangle that is not there, and a ray that starts on none.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// The triangles of a scene, coordinates within −1 and 1.
#[derive(Debug, Default)]
pub struct Triangles {
    nodes: Vec<Node>,
    packs: Vec<Pack>,
}

/// A segment or a half line.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    pub origin: DVec3,
    /// Any length but zero.
    pub direction: DVec3,
    /// Ends at origin + end · direction; infinite for a half line.
    pub end: f64,
    /// The triangle that the ray starts on, which it cannot hit.
    pub from_triangle: u32,
    /// The triangle that it leads to, which is not in its way.
    pub to_triangle: u32,
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// In lengths of the ray's direction.
    pub distance: f64,
    /// In the order in which the triangles were given.
    pub triangle: u32,
    /// Barycentric coordinates of the three corners.
    pub weights: [f64; 3],
}

/// Up to four children.
#[derive(Debug, Clone, Copy)]
struct Node {
    low: [Vec4; 3],
    high: [Vec4; 3],
    children: [Child; LANES],
    /// Bits of the children that are there.
    present: u32,
}

#[derive(Debug, Clone, Copy)]
enum Child {
    Node(u32),
    Packs { first: u32, count: u32 },
}

/// Corners by axis and lane.
#[derive(Debug, Clone, Copy)]
struct Pack {
    corners: [[[f64; LANES]; 3]; 3],
    triangles: [u32; LANES],
}

impl Triangles {
    pub fn new(corners: &[[DVec3; 3]]) -> Triangles {
        let mut triangles = Triangles::default();
        if corners.is_empty() {
            return triangles;
        }
        let boxes: Vec<Aabb> = corners.iter().map(bounds).collect();
        let parameters = BvhBuildParams {
            max_prims_per_leaf: LANES as u32,
            ..BvhBuildParams::medium_build()
        };
        let tree = build_bvh2(&boxes, parameters, &mut Duration::default());
        triangles.add_node(&tree, &[0], corners);
        triangles
    }

    /// Appends the node over up to four nodes of a binary tree, of which inner ones are opened while there is room.
    fn add_node(&mut self, tree: &Bvh2, roots: &[usize], corners: &[[DVec3; 3]]) -> u32 {
        let mut opened = roots.to_vec();
        while opened.len() < LANES {
            let half_area = |&slot: &usize| tree.nodes[opened[slot]].aabb().half_area();
            let largest = (0..opened.len())
                .filter(|&slot| !tree.nodes[opened[slot]].is_leaf())
                .max_by(|a, b| half_area(a).total_cmp(&half_area(b)));
            let Some(slot) = largest else { break };
            let first = tree.nodes[opened[slot]].first_index as usize;
            opened[slot] = first;
            opened.push(first + 1);
        }
        let index = self.nodes.len();
        self.nodes.push(Node {
            low: [Vec4::ZERO; 3],
            high: [Vec4::ZERO; 3],
            children: [Child::Node(0); LANES],
            present: (1 << opened.len()) - 1,
        });
        for (slot, &binary) in opened.iter().enumerate() {
            let source = &tree.nodes[binary];
            let (min, max) = (source.aabb().min, source.aabb().max);
            for axis in 0..3 {
                self.nodes[index].low[axis][slot] = min[axis] - BOX_SLACK;
                self.nodes[index].high[axis][slot] = max[axis] + BOX_SLACK;
            }
            let first = source.first_index as usize;
            self.nodes[index].children[slot] = if source.is_leaf() {
                let range = first..first + source.prim_count as usize;
                self.add_packs(&tree.primitive_indices[range], corners)
            } else {
                Child::Node(self.add_node(tree, &[first, first + 1], corners))
            };
        }
        index as u32
    }

    fn add_packs(&mut self, members: &[u32], corners: &[[DVec3; 3]]) -> Child {
        let first = self.packs.len() as u32;
        for members in members.chunks(LANES) {
            let mut pack = Pack {
                // Triangles of no area are never hit.
                corners: [[[0.0; LANES]; 3]; 3],
                triangles: [NO_TRIANGLE; LANES],
            };
            for (lane, &triangle) in members.iter().enumerate() {
                pack.triangles[lane] = triangle;
                for (corner, position) in corners[triangle as usize].iter().enumerate() {
                    for axis in 0..3 {
                        pack.corners[corner][axis][lane] = position[axis];
                    }
                }
            }
            self.packs.push(pack);
        }
        Child::Packs {
            first,
            count: self.packs.len() as u32 - first,
        }
    }

    /// The first triangle on the ray.
    pub fn nearest(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        self.visit(ray, |hit| {
            nearest = Some(hit);
            Some(hit.distance)
        });
        nearest
    }

    /// Whether nothing is between the two ends.
    pub fn is_free(&self, ray: &Ray) -> bool {
        let mut is_free = true;
        self.visit(ray, |_| {
            is_free = false;
            None
        });
        is_free
    }

    /// Calls `on_hit` for hits before the ray's end, which it may move nearer; `None` ends the search.
    fn visit(&self, ray: &Ray, mut on_hit: impl FnMut(Hit) -> Option<f64>) {
        let Some(slabs) = Slabs::new(ray).filter(|_| !self.nodes.is_empty()) else {
            return;
        };
        let shear = Shear::new(ray);
        let mut end = ray.end;
        let mut stack = Stack::default();
        stack.push(Child::Node(0), 0.0);
        while let Some((child, entry)) = stack.pop() {
            if f64::from(entry) + slabs.start > end {
                continue;
            }
            match child {
                Child::Node(index) => {
                    let node = &self.nodes[index as usize];
                    let (entries, is_hit) = slabs.meet(node, end);
                    stack.push_sorted(&node.children, entries, is_hit);
                }
                Child::Packs { first, count } => {
                    for pack in &self.packs[first as usize..(first + count) as usize] {
                        let Some(hit) = shear.nearest(pack, ray, end) else {
                            continue;
                        };
                        match on_hit(hit) {
                            Some(nearer) => end = nearer,
                            None => return,
                        }
                    }
                }
            }
        }
    }
}

/// Rounded outwards.
fn bounds(corners: &[DVec3; 3]) -> Aabb {
    let [a, b, c] = corners;
    let vec3a = |v: DVec3| Vec3A::new(v.x as f32, v.y as f32, v.z as f32);
    // The slack of the nodes covers the rounding of these.
    Aabb::new(vec3a(a.min(*b).min(*c)), vec3a(a.max(*b).max(*c)))
}

/// Nodes to be looked at. Trees of millions of triangles are 40 levels deep; what does not fit goes to the heap.
struct Stack {
    near: [(Child, f32); 64],
    len: usize,
    spilled: Vec<(Child, f32)>,
}

impl Default for Stack {
    fn default() -> Self {
        Stack {
            near: [(Child::Node(0), 0.0); 64],
            len: 0,
            spilled: Vec::new(),
        }
    }
}

impl Stack {
    fn push(&mut self, child: Child, entry: f32) {
        match self.near.get_mut(self.len) {
            Some(place) => {
                *place = (child, entry);
                self.len += 1;
            }
            None => self.spilled.push((child, entry)),
        }
    }

    fn pop(&mut self) -> Option<(Child, f32)> {
        if let Some(spilled) = self.spilled.pop() {
            return Some(spilled);
        }
        self.len = self.len.checked_sub(1)?;
        Some(self.near[self.len])
    }

    /// The nearest child comes to the top.
    fn push_sorted(&mut self, children: &[Child; LANES], entries: [f32; LANES], is_hit: u32) {
        let mut hit = is_hit;
        while hit != 0 {
            let mut farthest = hit.trailing_zeros() as usize;
            let mut rest = hit & (hit - 1);
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize;
                if entries[lane] > entries[farthest] {
                    farthest = lane;
                }
                rest &= rest - 1;
            }
            self.push(children[farthest], entries[farthest]);
            hit &= !(1 << farthest);
        }
    }
}

/// A ray in f32 for boxes, from where it enters the scene's bounds.
struct Slabs {
    /// Distance at which the f32 ray starts.
    start: f64,
    origin: [Vec4; 3],
    inverse_direction: [Vec4; 3],
}

impl Slabs {
    /// `None` for a ray that passes the scene by.
    fn new(ray: &Ray) -> Option<Slabs> {
        let inverse = ray.direction.recip();
        let bound = DVec3::splat(1.0 + 2.0 * f64::from(BOX_SLACK));
        // Along a face of these bounds a ray gives NaN and is culled; they are wider than the scene, so nothing is there.
        let (a, b) = (
            (-bound - ray.origin) * inverse,
            (bound - ray.origin) * inverse,
        );
        let pick = |f: fn(f64, f64) -> f64, axis: usize| f(a[axis], b[axis]);
        let start = (0..3).map(|axis| pick(f64::min, axis)).fold(0.0, f64::max);
        let end = (0..3)
            .map(|axis| pick(f64::max, axis))
            .fold(ray.end, f64::min);
        if start > end {
            return None;
        }
        let origin = ray.origin + start * ray.direction;
        // The smallest slope whose inverse, times a length of 2, is still finite.
        let steep = |slope: f64| (slope as f32).abs().max(1e-37).copysign(slope as f32);
        Some(Slabs {
            start,
            origin: origin.to_array().map(|value| Vec4::splat(value as f32)),
            inverse_direction: ray
                .direction
                .to_array()
                .map(|slope| Vec4::splat(steep(slope).recip())),
        })
    }

    /// Distances from `start` at which the ray enters the children, and bits of those that it meets.
    fn meet(&self, node: &Node, end: f64) -> ([f32; LANES], u32) {
        let mut entry = Vec4::ZERO;
        // To the next larger f32; what is farther than the scene is wide does not matter.
        let mut exit = Vec4::splat(((end - self.start) as f32) * (1.0 + f32::EPSILON));
        for axis in 0..3 {
            let a = (node.low[axis] - self.origin[axis]) * self.inverse_direction[axis];
            let b = (node.high[axis] - self.origin[axis]) * self.inverse_direction[axis];
            entry = entry.max(a.min(b));
            exit = exit.min(a.max(b));
        }
        (entry.to_array(), entry.cmple(exit).bitmask() & node.present)
    }
}

/// The transform that turns a ray into the z axis.
struct Shear {
    axes: [usize; 3],
    slope_x: f64,
    slope_y: f64,
    scale_z: f64,
}

impl Shear {
    fn new(ray: &Ray) -> Shear {
        let magnitude = ray.direction.abs();
        let z = (0..3).fold(0, |most, axis| {
            if magnitude[axis] > magnitude[most] {
                axis
            } else {
                most
            }
        });
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let [dx, dy, dz] = axes.map(|axis| ray.direction[axis]);
        Shear {
            axes,
            slope_x: dx / dz,
            slope_y: dy / dz,
            scale_z: 1.0 / dz,
        }
    }

    /// The nearest hit of a pack before `end`.
    fn nearest(&self, pack: &Pack, ray: &Ray, end: f64) -> Option<Hit> {
        let [ox, oy, oz] = self.axes.map(|axis| ray.origin[axis]);
        let mut x = [[0.0; LANES]; 3];
        let mut y = [[0.0; LANES]; 3];
        let mut z = [[0.0; LANES]; 3];
        for corner in 0..3 {
            let [cx, cy, cz] = self.axes.map(|axis| &pack.corners[corner][axis]);
            for lane in 0..LANES {
                z[corner][lane] = cz[lane] - oz;
                x[corner][lane] = (cx[lane] - ox) - self.slope_x * z[corner][lane];
                y[corner][lane] = (cy[lane] - oy) - self.slope_y * z[corner][lane];
            }
        }
        let mut weights = [[0.0; LANES]; 3];
        for (corner, weights) in weights.iter_mut().enumerate() {
            let (next, after) = ((corner + 1) % 3, (corner + 2) % 3);
            for lane in 0..LANES {
                weights[lane] = x[after][lane] * y[next][lane] - y[after][lane] * x[next][lane];
            }
        }
        let mut determinant = [0.0; LANES];
        let mut depth = [0.0; LANES];
        let mut is_inside = [false; LANES];
        for lane in 0..LANES {
            let [u, v, w] = [0, 1, 2].map(|corner| weights[corner][lane]);
            determinant[lane] = u + v + w;
            depth[lane] = u * z[0][lane] + v * z[1][lane] + w * z[2][lane];
            // On an edge, both of its triangles are hit.
            is_inside[lane] = (u.min(v).min(w) >= 0.0) | (u.max(v).max(w) <= 0.0);
        }
        if is_inside == [false; LANES] {
            return None;
        }
        let mut nearest: Option<Hit> = None;
        let mut end = end;
        for lane in 0..LANES {
            let triangle = pack.triangles[lane];
            if !is_inside[lane]
                || determinant[lane] == 0.0
                || triangle == ray.from_triangle
                || triangle == ray.to_triangle
            {
                continue;
            }
            let inverse = 1.0 / determinant[lane];
            let distance = depth[lane] * inverse * self.scale_z;
            if distance > 0.0 && distance < end {
                end = distance;
                nearest = Some(Hit {
                    distance,
                    triangle,
                    weights: [0, 1, 2].map(|corner| weights[corner][lane] * inverse),
                });
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in −1 to 1 that repeat from run to run.
    struct Numbers(fastrand::Rng);

    impl Numbers {
        fn new(seed: u64) -> Self {
            Numbers(fastrand::Rng::with_seed(seed))
        }

        fn next(&mut self) -> f64 {
            2.0 * self.0.f64() - 1.0
        }

        fn vector(&mut self) -> DVec3 {
            DVec3::new(self.next(), self.next(), self.next())
        }
    }

    fn ray(origin: DVec3, direction: DVec3) -> Ray {
        Ray {
            origin,
            direction,
            end: f64::INFINITY,
            from_triangle: NO_TRIANGLE,
            to_triangle: NO_TRIANGLE,
        }
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
        let mut numbers = Numbers::new(1);
        for size in [0.02, 0.2, 1.0] {
            let corners: Vec<[DVec3; 3]> = (0..500)
                .map(|_| {
                    let centre = numbers.vector() * (1.0 - size);
                    [0; 3].map(|_| centre + size * numbers.vector())
                })
                .collect();
            let triangles = Triangles::new(&corners);
            let mut hits = 0;
            for index in 0..4000 {
                // From within, from outside, from far away, and along an axis.
                let from = numbers.vector() * [0.9, 3.0, 1e4, 0.9][index % 4];
                let mut direction = numbers.vector() - from * f64::from(index % 4 != 0);
                if index % 4 == 3 {
                    direction = DVec3::AXES[index / 4 % 3] * direction.x.signum();
                }
                let ray = ray(from, direction);
                let all = corners
                    .iter()
                    .filter_map(|corners| distance_to(corners, &ray));
                let expected = all.fold(f64::INFINITY, f64::min);
                let found = triangles.nearest(&ray);
                let distance = found.map_or(f64::INFINITY, |hit| hit.distance);
                assert!(
                    distance == expected || (distance / expected - 1.0).abs() < 1e-9,
                    "{ray:?}: {distance} for {expected}"
                );
                assert_eq!(triangles.is_free(&ray), expected.is_infinite());
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
                    assert!(triangles.is_free(&beyond));
                }
            }
            assert!(hits > 25, "{hits} hits at size {size}");
        }
    }

    /// Rays from a point to the edges and corners of a closed mesh around it never slip out between its triangles.
    #[test]
    fn shared_edges_and_corners_are_tight() {
        let mut numbers = Numbers::new(2);
        // An octahedron whose faces are cut in four, with uneven corners.
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
            let from = 0.2 * numbers.vector();
            let [a, b, _] = faces[(numbers.next().abs() * 31.9) as usize];
            for on_edge in [a, b, a.lerp(b, 0.5), a.lerp(b, numbers.next().abs())] {
                assert!(!triangles.is_free(&ray(from, on_edge - from)));
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
        let down = ray(DVec3::new(0.0, 0.5, 0.0), DVec3::NEG_Y);
        assert!(!triangles.is_free(&down));
        for own in [
            Ray {
                from_triangle: 0,
                ..down
            },
            Ray {
                to_triangle: 0,
                ..down
            },
            Ray { end: 0.5, ..down },
        ] {
            assert!(triangles.is_free(&own), "{own:?}");
        }
        assert!(Triangles::new(&[]).nearest(&down).is_none());
    }
}
