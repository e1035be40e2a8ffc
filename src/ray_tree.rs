//! The scene's triangles as rays meet them on the device: the large ones alone, the others in a tree of boxes.

use std::time::Duration;

use glam::{DVec3, Vec3};
use obvhs::{
    BvhBuildParams, aabb::Aabb, bvh2::Bvh2, bvh2::builder::build_bvh2_from_tris,
    bvh2::node::Bvh2Node, triangle::Triangle,
};

use crate::{LocalSpace, Scene};

/// Triangles that stand alone come in groups of as many.
const GROUP: usize = 8;
/// Texels of a triangle: its corners, each with a component of the unit normal; its place in the scene, and that of its cut-outs.
pub(crate) const TRIANGLE_TEXELS: usize = 4;
/// Triangles of a scene without a tree, and those beside a tree, at most.
const MAX_FACETS: usize = 64;
/// A triangle whose box has more than this share of the scene's surface stands alone.
const FACET_SHARE: f32 = 0.004;
/// What the word of a leaf has beside its triangle.
const LEAF: u32 = 1 << 30;
/// And where that has cut-outs.
const LEAF_CUTOUT: u32 = 1 << 29;
/// Steps of the grid that boxes are rounded to, along an axis. Below 2¹⁵, so that no pair of them is the bits of a NaN.
const GRID_STEPS: f32 = 32_000.0;
/// By how much a box is larger than what it holds, local units. The ray that the triangle test sees is off by up to 16
/// roundings (2⁻²⁴ each) of an offset within the scene, and that is at most 2√3; the products of the box test by another
/// 16 of 2.
const BOX_SLACK: f32 = 6e-6;

pub(crate) type Texel = [f32; 4];

/// Texels of so many triangles at most. Boxes have fewer.
pub(crate) fn max_triangle_texels(triangle_count: u64) -> u64 {
    TRIANGLE_TEXELS as u64 * (triangle_count + GROUP as u64)
}

/// Texels of the boxes over so many triangles at most: the header, and a tree with one triangle a leaf.
pub(crate) fn max_box_texels(triangle_count: u64) -> u64 {
    3 + if triangle_count <= MAX_FACETS as u64 {
        0
    } else {
        2 * triangle_count - 1
    }
}

/// Two lists of texels.
#[derive(Debug, Default)]
pub(crate) struct RayTree {
    /// First the groups of triangles that stand alone and the number of nodes; the grid's low corner; its step. Then the
    /// nodes, depth first: pairs of 16 bits for x, y and z, low corner | high corner << 16, and what follows the subtree,
    /// or a leaf's one triangle.
    pub boxes: Vec<Texel>,
    /// Those that stand alone, filled up with triangles without area; then those of the leaves.
    pub triangles: Vec<Texel>,
}

impl RayTree {
    /// The tree over triangles, of which those of other numbers than 0 have cut-outs: these are all in the tree.
    pub fn over(corners: &[[Vec3; 3]], cutouts: &[u32]) -> RayTree {
        let (facets, others) = facets_and_others(corners, cutouts);
        let mut triangles = Vec::new();
        for &place in &facets {
            triangles.extend(triangle_texels(corners[place as usize], [place, 0]));
        }
        let groups = facets.len().div_ceil(GROUP).max(1);
        triangles.resize(groups * GROUP * TRIANGLE_TEXELS, [0.0; 4]);
        let mut tree = RayTree {
            boxes: vec![[groups as f32, 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4]],
            triangles,
        };
        if !others.is_empty() {
            tree.grow(corners, cutouts, &others);
        }
        tree
    }

    /// Groups of eight triangles that stand alone.
    pub fn group_count(&self) -> u32 {
        self.boxes[0][0] as u32
    }

    /// 0 where all triangles stand alone.
    pub fn node_count(&self) -> u32 {
        self.boxes[0][1] as u32
    }

    /// Adds the tree over some triangles.
    fn grow(&mut self, corners: &[[Vec3; 3]], cutouts: &[u32], places: &[u32]) {
        let triangle = |&place: &u32| {
            let [v0, v1, v2] = corners[place as usize].map(Into::into);
            Triangle { v0, v1, v2 }
        };
        let inputs: Vec<Triangle> = places.iter().map(triangle).collect();
        let parameters = BvhBuildParams {
            max_prims_per_leaf: 1,
            ..BvhBuildParams::medium_build()
        };
        let tree = build_bvh2_from_tris(&inputs, parameters, &mut Duration::default());
        let first = (self.triangles.len() / TRIANGLE_TEXELS) as u32;
        for &index in &tree.primitive_indices {
            let place = places[index as usize];
            let numbers = [place, cutouts[place as usize]];
            let texels = triangle_texels(corners[place as usize], numbers);
            self.triangles.extend(texels);
        }
        let root = &tree.nodes[0].aabb;
        let low: Vec3 = (root.min - 2.0 * BOX_SLACK).into();
        let extent: Vec3 = (root.max - root.min + 4.0 * BOX_SLACK).into();
        let step = extent / GRID_STEPS;
        let leaf = |node: &Bvh2Node| {
            let place = places[tree.primitive_indices[node.first_index as usize] as usize];
            let cutout = match cutouts[place as usize] {
                0 => 0,
                _ => LEAF_CUTOUT,
            };
            LEAF | cutout | (first + node.first_index)
        };
        let nodes = flatten(&tree, leaf, low, step);
        self.boxes[0][1] = nodes.len() as f32;
        self.boxes[1] = low.extend(0.0).to_array();
        self.boxes[2] = step.extend(0.0).to_array();
        self.boxes.extend(nodes);
    }
}

/// The triangles that stand alone, and the others.
fn facets_and_others(corners: &[[Vec3; 3]], cutouts: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let places = 0..corners.len() as u32;
    let (mut places, mut with_cutouts): (Vec<u32>, Vec<u32>) =
        places.partition(|&place| cutouts[place as usize] == 0);
    if places.len() <= MAX_FACETS {
        return (places, with_cutouts);
    }
    let bounds = |corners: &[Vec3]| {
        let mut bounds = Aabb::empty();
        for &corner in corners {
            bounds.extend(corner.into());
        }
        bounds.half_area()
    };
    let scene_area = bounds(corners.as_flattened());
    let area = |place: u32| bounds(&corners[place as usize]);
    places.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
    let is_large = |&&place: &&u32| area(place) > FACET_SHARE * scene_area;
    let count = places.iter().take(MAX_FACETS).take_while(is_large).count();
    with_cutouts.extend(places.split_off(count));
    (places, with_cutouts)
}

fn flatten(tree: &Bvh2, leaf: impl Fn(&Bvh2Node) -> u32, low: Vec3, step: Vec3) -> Vec<Texel> {
    let mut depth_first = Vec::with_capacity(tree.nodes.len());
    // Not by recursion: a tree may be as deep as it has triangles.
    let mut open = vec![0];
    while let Some(index) = open.pop() {
        let node = &tree.nodes[index as usize];
        depth_first.push(node);
        if !node.is_leaf() {
            open.extend([node.first_index + 1, node.first_index]);
        }
    }
    let mut texels = vec![[0.0; 4]; depth_first.len()];
    let mut next: Vec<usize> = (1..=depth_first.len()).collect();
    for (i, node) in depth_first.into_iter().enumerate().rev() {
        let [x, y, z] = box_words(&node.aabb, low, step);
        let word = if node.is_leaf() {
            leaf(node)
        } else {
            // The first child comes next; behind its subtree lies the second, and behind that one's what follows both.
            next[i] = next[next[i + 1]];
            next[i] as u32
        };
        texels[i] = [x, y, z, f32::from_bits(word)];
    }
    texels
}

/// A box rounded outwards to the grid.
fn box_words(bounds: &Aabb, low: Vec3, step: Vec3) -> [f32; 3] {
    let (min, max): (Vec3, Vec3) = (bounds.min.into(), bounds.max.into());
    // An extent of nothing has no steps.
    let safe_step = step.max(Vec3::splat(1e-30));
    let from = ((min - BOX_SLACK - low) / safe_step).floor();
    let to = ((max + BOX_SLACK - low) / safe_step).ceil();
    let on_grid = |v: f32| v.clamp(0.0, GRID_STEPS + 2.0) as u32;
    std::array::from_fn(|axis| f32::from_bits(on_grid(from[axis]) | on_grid(to[axis]) << 16))
}

/// The corners of a valid scene's triangles.
pub(crate) fn corners_of(scene: &Scene, space: &LocalSpace) -> Vec<[Vec3; 3]> {
    let mut corners = Vec::new();
    for mesh in &scene.meshes {
        let local = |corner: u32| space.to_local(mesh.positions_m[corner as usize]).into();
        corners.extend(mesh.triangles.iter().map(|corners| corners.map(local)));
    }
    corners
}

/// Triangles in this order, for rays that need no tree.
pub(crate) fn triangle_texels_in(
    order: &[u32],
    corners: &[[Vec3; 3]],
    cutouts: &[u32],
) -> Vec<Texel> {
    let texels = order.iter().map(|&place| {
        let at = place as usize;
        triangle_texels(corners[at], [place, cutouts[at]])
    });
    texels.flatten().collect()
}

fn triangle_texels(corners: [Vec3; 3], numbers: [u32; 2]) -> [Texel; TRIANGLE_TEXELS] {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    // In f64, so that slivers have a normal that is right to rounding. One without area has none, and is never hit.
    let normal: DVec3 = (b - a).cross(c - a).normalize_or_zero();
    let normal = normal.as_vec3();
    let [a, b, c] = [0, 1, 2].map(|i| corners[i].extend(normal[i]).to_array());
    let [place, cutout] = numbers.map(|number| number as f32);
    [a, b, c, [place, cutout, 0.0, 0.0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    const HEADER: usize = 3;

    /// Small triangles in a row, and a large one.
    fn corners() -> Vec<[Vec3; 3]> {
        let small = |i: usize| {
            let at = vec3(i as f32 / 100.0 - 0.5, 0.1, 0.0);
            [at, at + 0.005 * Vec3::X, at + 0.005 * Vec3::Y]
        };
        let large = [-Vec3::ONE, vec3(1.0, -1.0, 1.0), vec3(0.0, 1.0, 1.0)];
        (0..100).map(small).chain([large]).collect()
    }

    fn tree_over(corners: &[[Vec3; 3]]) -> RayTree {
        RayTree::over(corners, &vec![0; corners.len()])
    }

    fn grid_box(tree: &RayTree, node: usize) -> [Vec3; 2] {
        let [low, step] = [1, 2].map(|texel| Vec3::from_slice(&tree.boxes[texel][..3]));
        let words = [0, 1, 2].map(|axis| tree.boxes[HEADER + node][axis].to_bits());
        [0, 16].map(|shift| {
            let on_grid = words.map(|word| (word >> shift & 0xffff) as f32);
            low + step * Vec3::from_array(on_grid)
        })
    }

    #[test]
    fn boxes_hold_the_triangles_below_them() {
        let tree = tree_over(&corners());
        let node_count = tree.boxes.len() - HEADER;
        assert_eq!(tree.boxes[0][..2], [1.0, node_count as f32]);
        // A tree of one triangle a leaf.
        assert_eq!(node_count, 2 * 100 - 1);
        let word = |node: usize| tree.boxes[HEADER + node][3].to_bits();
        let mut leaves = 0;
        for node in 0..node_count {
            let is_leaf = word(node) & LEAF != 0;
            let end = if is_leaf {
                node + 1
            } else {
                word(node) as usize
            };
            assert!(end > node && end <= node_count);
            let [low, high] = grid_box(&tree, node);
            for leaf in (node..end).filter(|&below| word(below) & LEAF != 0) {
                leaves += usize::from(leaf == node);
                let first = TRIANGLE_TEXELS * (word(leaf) & !LEAF) as usize;
                for corner in &tree.triangles[first..first + 3] {
                    let corner = Vec3::from_slice(&corner[..3]);
                    assert!((corner - low).min_element() > 0.9 * BOX_SLACK);
                    assert!((high - corner).min_element() > 0.9 * BOX_SLACK);
                }
            }
        }
        assert_eq!(leaves, 100);
    }

    #[test]
    fn large_triangles_stand_alone_in_full_groups() {
        let tree = tree_over(&corners());
        assert_eq!(tree.triangles[3][0], 100.0);
        let filled_up = &tree.triangles[TRIANGLE_TEXELS..GROUP * TRIANGLE_TEXELS];
        assert_eq!(filled_up, [[0.0; 4]; 28]);
        let few = tree_over(&corners()[..9]);
        assert_eq!(few.boxes[0][..2], [2.0, 0.0]);
        assert_eq!(few.triangles.len(), 2 * GROUP * TRIANGLE_TEXELS);
        let none = tree_over(&[]);
        assert_eq!(none.triangles, [[0.0; 4]; GROUP * TRIANGLE_TEXELS]);
    }

    #[test]
    fn triangles_with_cutouts_are_in_the_tree() {
        let mut cutouts = vec![0; 101];
        (cutouts[3], cutouts[100]) = (1, 2);
        let tree = RayTree::over(&corners(), &cutouts);
        assert_eq!(tree.node_count(), 2 * 101 - 1);
        let numbers = tree.triangles.iter().skip(3).step_by(TRIANGLE_TEXELS);
        let of_cutouts = numbers.filter(|texel| texel[1] > 0.0);
        let mut of_cutouts: Vec<_> = of_cutouts.map(|texel| [texel[0], texel[1]]).collect();
        of_cutouts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert_eq!(of_cutouts, [[3.0, 1.0], [100.0, 2.0]]);
        let few = RayTree::over(&corners()[..9], &cutouts[..9]);
        assert_eq!((few.group_count(), few.node_count()), (1, 1));
    }

    /// No box's words are the bits of a NaN, which a driver might change.
    #[test]
    fn words_are_numbers() {
        let tree = tree_over(&corners());
        let mut words = tree.boxes.as_flattened().iter();
        assert!(words.all(|word| word.is_finite()));
    }

    /// The tree is as bad as can be, but there is one.
    #[test]
    fn equal_triangles_have_a_tree() {
        let tree = tree_over(&vec![[Vec3::ZERO, 0.01 * Vec3::X, 0.01 * Vec3::Y]; 1000]);
        assert_eq!(tree.boxes.len(), HEADER + 2 * (1000 - 64) - 1);
    }
}
