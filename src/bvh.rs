//! A tree of boxes over the scene's triangles, flattened for traversal without a stack.

use std::time::Duration;

use glam::{DVec3, Vec3};
use obvhs::{
    BvhBuildParams, aabb::Aabb, bvh2::Bvh2, bvh2::builder::build_bvh2_from_tris,
    triangle::Triangle as Corners,
};

use crate::{LocalSpace, Scene};

/// A node as the shaders read it: low corner of its box, the node that follows its subtree, high corner, and its triangles
/// as `count << 24 | first`; 0 for an inner node. The box's coordinates are bits of f32.
pub(crate) type Node = [u32; 8];

/// A triangle as the shaders read it: the corners, each with a component of the unit normal behind it.
pub(crate) type Triangle = [[f32; 4]; 3];

/// Bytes of the nodes over so many triangles at most; those of the triangles are fewer.
pub(crate) fn max_bytes(triangle_count: u64) -> u64 {
    2 * triangle_count * size_of::<Node>() as u64
}

/// Triangles of a leaf at most. On lavapipe 2, 4 and 8 are equally fast within the noise.
const LEAF_TRIANGLES: u32 = 4;

/// By how much a box is larger than what it holds, local units. The ray that the triangle test sees is off by up to 16
/// roundings (2⁻²⁴ each) of an offset within the scene, and that is at most 2√3.
const BOX_SLACK: f32 = 3.9e-6;

/// Depth first: the first child of an inner node follows it.
#[derive(Debug, Default)]
pub(crate) struct Bvh {
    pub nodes: Vec<Node>,
    /// In the order of the leaves.
    pub triangles: Vec<Triangle>,
}

impl Bvh {
    /// The tree over a valid scene's surfaces; empty where there are none.
    pub fn of(scene: &Scene, space: &LocalSpace) -> Bvh {
        let corners: Vec<[Vec3; 3]> = scene
            .meshes
            .iter()
            .flat_map(|mesh| {
                let local = |corner: u32| space.to_local(mesh.positions_m[corner as usize]).into();
                mesh.triangles.iter().map(move |corners| corners.map(local))
            })
            .collect();
        Bvh::over(&corners)
    }

    fn over(corners: &[[Vec3; 3]]) -> Bvh {
        if corners.is_empty() {
            return Bvh::default();
        }
        let inputs: Vec<Corners> = corners
            .iter()
            .map(|&[v0, v1, v2]| Corners {
                v0: v0.into(),
                v1: v1.into(),
                v2: v2.into(),
            })
            .collect();
        let parameters = BvhBuildParams {
            max_prims_per_leaf: LEAF_TRIANGLES,
            ..BvhBuildParams::medium_build()
        };
        let tree = build_bvh2_from_tris(&inputs, parameters, &mut Duration::default());
        let in_leaf_order = |&index: &u32| triangle(corners[index as usize]);
        Bvh {
            nodes: flatten(&tree),
            triangles: tree.primitive_indices.iter().map(in_leaf_order).collect(),
        }
    }
}

fn triangle(corners: [Vec3; 3]) -> Triangle {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    // In f64, so that slivers have a normal that is right to rounding. One without area has none, and is never hit.
    let normal: DVec3 = (b - a).cross(c - a).normalize_or_zero();
    let normal = normal.as_vec3().to_array();
    std::array::from_fn(|i| corners[i].extend(normal[i]).to_array())
}

fn flatten(tree: &Bvh2) -> Vec<Node> {
    enum Step {
        Enter(usize),
        /// Every node of this node's subtree is there.
        Leave(usize),
    }
    let mut nodes: Vec<Node> = Vec::with_capacity(tree.nodes.len());
    // Not by recursion: a tree may be as deep as it has triangles.
    let mut steps = vec![Step::Enter(0)];
    while let Some(step) = steps.pop() {
        match step {
            Step::Enter(index) => {
                let node = &tree.nodes[index];
                steps.push(Step::Leave(nodes.len()));
                let first = node.first_index;
                if node.prim_count == 0 {
                    steps.push(Step::Enter(first as usize + 1));
                    steps.push(Step::Enter(first as usize));
                    nodes.push(words(&node.aabb, 0));
                } else {
                    nodes.push(words(&node.aabb, node.prim_count << 24 | first));
                }
            }
            Step::Leave(index) => nodes[index][3] = nodes.len() as u32,
        }
    }
    nodes
}

fn words(bounds: &Aabb, triangles: u32) -> Node {
    let [low_x, low_y, low_z] = (bounds.min - BOX_SLACK).to_array().map(f32::to_bits);
    let [high_x, high_y, high_z] = (bounds.max + BOX_SLACK).to_array().map(f32::to_bits);
    [low_x, low_y, low_z, 0, high_x, high_y, high_z, triangles]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn box_of(node: &Node) -> (DVec3, DVec3) {
        let [low_x, low_y, low_z, _, high_x, high_y, high_z, _] =
            node.map(|w| f64::from(f32::from_bits(w)));
        (
            DVec3::new(low_x, low_y, low_z),
            DVec3::new(high_x, high_y, high_z),
        )
    }

    fn triangles_of(node: &Node) -> std::ops::Range<usize> {
        let first = (node[7] & 0xff_ffff) as usize;
        first..first + (node[7] >> 24) as usize
    }

    /// Möller and Trumbore, between the two ends.
    fn is_hit(triangle: &Triangle, from: DVec3, to: DVec3) -> bool {
        let [a, b, c] =
            triangle.map(|[x, y, z, _]| DVec3::new(f64::from(x), f64::from(y), f64::from(z)));
        let (ray, edge1, edge2, offset) = (to - from, b - a, c - a, from - a);
        let p = ray.cross(edge2);
        let q = offset.cross(edge1);
        let determinant = edge1.dot(p);
        let u = offset.dot(p) / determinant;
        let v = ray.dot(q) / determinant;
        let t = edge2.dot(q) / determinant;
        u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < 1.0
    }

    fn meets(node: &Node, from: DVec3, to: DVec3) -> bool {
        let (low, high) = box_of(node);
        let inverse = (to - from).recip();
        let (a, b) = ((low - from) * inverse, (high - from) * inverse);
        a.min(b).max_element().max(0.0) <= a.max(b).min_element().min(1.0)
    }

    /// What the shaders do, in f64. Also how many nodes that took.
    fn is_blocked(bvh: &Bvh, from: DVec3, to: DVec3) -> (bool, usize) {
        let (mut index, mut visits) = (0, 0);
        while let Some(node) = bvh.nodes.get(index) {
            visits += 1;
            if !meets(node, from, to) {
                index = node[3] as usize;
                continue;
            }
            if bvh.triangles[triangles_of(node)]
                .iter()
                .any(|triangle| is_hit(triangle, from, to))
            {
                return (true, visits);
            }
            index += 1;
        }
        (false, visits)
    }

    /// Uniform in [−1, 1], the same each time (splitmix64).
    struct Random(u64);

    impl Random {
        fn number(&mut self) -> f32 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z >> 40) as f32) / ((1u64 << 23) as f32) - 1.0
        }

        fn vector(&mut self) -> Vec3 {
            Vec3::new(self.number(), self.number(), self.number())
        }
    }

    fn soup(count: usize, size: f32) -> Vec<[Vec3; 3]> {
        let mut random = Random(7);
        (0..count)
            .map(|_| {
                let centre = (1.0 - size) * random.vector();
                [(); 3].map(|()| centre + size * random.vector())
            })
            .collect()
    }

    /// Every node's subtree ends where its skip index says, and its box holds what is in it.
    fn assert_is_sound(bvh: &Bvh) {
        let bytes = size_of_val(&bvh.nodes[..]).max(size_of_val(&bvh.triangles[..]));
        assert!(bytes as u64 <= max_bytes(bvh.triangles.len() as u64));
        let mut next_triangle = vec![0; bvh.triangles.len()];
        for (index, node) in bvh.nodes.iter().enumerate() {
            let end = node[3] as usize;
            assert!(end > index && end <= bvh.nodes.len());
            let is_leaf = node[7] != 0;
            assert_eq!(is_leaf, end == index + 1);
            let (low, high) = box_of(node);
            for below in &bvh.nodes[index..end] {
                assert!(below[3] as usize <= end);
                for triangle in &bvh.triangles[triangles_of(below)] {
                    for [x, y, z, _] in triangle {
                        let corner = DVec3::new(f64::from(*x), f64::from(*y), f64::from(*z));
                        assert!((corner - low).min_element() > 3.5e-6);
                        assert!((high - corner).min_element() > 3.5e-6);
                    }
                }
            }
            triangles_of(node).for_each(|triangle| next_triangle[triangle] += 1);
        }
        assert!(next_triangle.iter().all(|&leaves| leaves == 1));
        assert_eq!(
            bvh.nodes.first().map(|root| root[3] as usize),
            Some(bvh.nodes.len())
        );
    }

    #[test]
    fn traversal_finds_what_brute_force_finds() {
        for (count, size) in [(1, 0.5), (2, 0.5), (5, 0.3), (40, 0.3), (3000, 0.05)] {
            let corners = soup(count, size);
            let bvh = Bvh::over(&corners);
            assert_is_sound(&bvh);
            let mut random = Random(11);
            let (mut blocked, mut visits) = (0, 0);
            for _ in 0..2000 {
                let from = random.vector().as_dvec3();
                let to = 1.5 * random.vector().as_dvec3();
                let found = is_blocked(&bvh, from, to);
                let brute = bvh.triangles.iter().any(|t| is_hit(t, from, to));
                assert_eq!(found.0, brute);
                blocked += usize::from(brute);
                visits += found.1;
            }
            println!("{count} triangles: {blocked} blocked, {visits} visits");
            assert!((19..2000).contains(&blocked));
            // Culls: measured 73 visits a ray of 3000 triangles.
            assert!(visits < 2000 * 100);
        }
    }

    /// All in one place: the tree is as bad as can be, but there is one.
    #[test]
    fn equal_triangles_have_a_tree() {
        let corners = vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; 1000];
        let bvh = Bvh::over(&corners);
        assert_is_sound(&bvh);
        let ray = |x| is_blocked(&bvh, DVec3::new(x, 0.2, -1.0), DVec3::new(x, 0.2, 1.0)).0;
        assert!(ray(0.2) && !ray(0.9));
    }

    #[test]
    fn triangles_keep_corners_and_normal() {
        let corners = [
            Vec3::ZERO,
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(0.5, 1e-7, 0.0),
        ];
        let of_sliver = triangle(corners);
        for (corner, [x, y, z, _]) in corners.iter().zip(of_sliver) {
            assert_eq!(*corner, Vec3::new(x, y, z));
        }
        assert_eq!(of_sliver.map(|[.., n]| n), [0.0, 0.0, 1.0]);
        let of_line = triangle([Vec3::ZERO, Vec3::X, Vec3::X]);
        assert_eq!(of_line.map(|[.., n]| n), [0.0; 3]);
        assert!(Bvh::over(&[]).nodes.is_empty());
    }
}
