//! The nodes of a ray tree (BVH).

use glam::{UVec3, Vec3};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node},
};

use super::Texel;

/// The bit that marks a leaf in a node's word, beside the leaf's triangle.
pub(super) const LEAF: u32 = 1 << 30;
/// The bit of a leaf whose triangle has cut-outs.
pub(super) const LEAF_CUTOUT: u32 = 1 << 29;
/// The bit of a leaf that is an instance.
pub(super) const LEAF_INSTANCE: u32 = 1 << 28;
/// Steps of the grid that boxes are rounded to, along an axis. Below 2¹⁵, so that no pair of them has the bits of a NaN.
const GRID_STEPS: f32 = 32_000.0;

/// The grid that boxes are rounded to: the low corner and the steps.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    pub(super) low: Vec3,
    pub(super) step: Vec3,
}

impl Grid {
    pub(super) fn around(bounds: Aabb, slack: f32) -> Grid {
        let extent: Vec3 = (bounds.max - bounds.min + 4.0 * slack).into();
        Grid {
            low: (bounds.min - 2.0 * slack).into(),
            step: extent / GRID_STEPS,
        }
    }

    /// Encodes a box, rounded outwards.
    pub(super) fn words(&self, bounds: &Aabb, slack: f32) -> [f32; 3] {
        let (min, max): (Vec3, Vec3) = (bounds.min.into(), bounds.max.into());
        // Avoids a division by the step of an extent of 0.
        let safe_step = self.step.max(Vec3::splat(1e-30));
        let on_grid = |v: Vec3| (v - self.low) / safe_step;
        let last = Vec3::splat(GRID_STEPS + 2.0);
        let from = on_grid(min - slack).clamp(Vec3::ZERO, last).as_uvec3();
        let to = on_grid(max + slack).clamp(Vec3::ZERO, last);
        let whole = to.as_uvec3();
        let is_between = whole.as_vec3().cmplt(to);
        let to = whole + UVec3::select(is_between, UVec3::ONE, UVec3::ZERO);
        let words: UVec3 = from | to << 16;
        words.to_array().map(f32::from_bits)
    }

    pub(super) fn texels(&self) -> [Texel; 2] {
        [self.low, self.step].map(|corner| corner.extend(0.0).to_array())
    }

    pub(super) fn box_of(&self, node: &Texel) -> [Vec3; 2] {
        let words = [0, 1, 2].map(|axis| node[axis].to_bits());
        [0, 16].map(|shift| {
            let on_grid = words.map(|word| (word >> shift & 0xffff) as f32);
            self.low + self.step * Vec3::from_array(on_grid)
        })
    }
}

pub(super) fn build_parameters() -> BvhBuildParams {
    BvhBuildParams {
        max_prims_per_leaf: 1,
        ..BvhBuildParams::medium_build()
    }
}

/// Boxes larger than this share of the first one do not count for [`spread`]: walls would hide what happens to small triangles.
const LARGE_SHARE: f32 = 0.004;

/// The area of the inner boxes relative to the area of the leaves: what a ray has to test relative to what it may hit. Each box comes with
/// whether it is a leaf; the first one is the whole tree's.
pub(super) fn spread<'b>(boxes: impl Iterator<Item = (bool, &'b Aabb)>) -> f32 {
    let mut areas = [0.0, 0.0];
    let mut largest = None;
    for (is_leaf, bounds) in boxes {
        let area = bounds.half_area();
        if area <= *largest.get_or_insert(LARGE_SHARE * area) {
            areas[usize::from(is_leaf)] += area;
        }
    }
    areas[0] / f32::max(areas[1], f32::MIN_POSITIVE)
}

pub(super) fn flatten(
    tree: &Bvh2,
    leaf: impl Fn(&Bvh2Node) -> u32,
    grid: &Grid,
    slack: f32,
) -> Vec<Texel> {
    let mut depth_first = Vec::with_capacity(tree.nodes.len());
    // Without recursion, because a tree may be as deep as it has triangles.
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
        let [x, y, z] = grid.words(&node.aabb, slack);
        let word = if node.is_leaf() {
            leaf(node)
        } else {
            // The first child is the next node. The second child follows the first one's subtree. The next node after both follows the
            // second one's subtree.
            next[i] = next[next[i + 1]];
            next[i] as u32
        };
        texels[i] = [x, y, z, f32::from_bits(word)];
    }
    texels
}
