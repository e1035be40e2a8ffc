//! The triangles of the scene's space or of a shared mesh, and the ray tree (BVH) over them.

use std::{
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use glam::{Vec3, Vec3A};
use obvhs::{
    aabb::Aabb,
    bvh2::{builder::build_bvh2_from_tris, node::Bvh2Node},
    triangle::Triangle,
};

use super::{
    BOX_SLACK, Texel,
    collapse::Binary,
    nodes::{Grid, LEAF, LEAF_CUTOUT, build_parameters, flatten, spread},
    triangles::{TRIANGLE_TEXELS, triangle_texels, triangle_texels_in},
    wide::WideTree,
};
use crate::parallel::for_each;

/// Levels of a shared mesh's tree whose boxes give the bounds of its instances.
const COVER_LEVELS: u32 = 6;
/// Triangles or nodes that a thread takes at a time.
const AT_ONCE: usize = 1 << 13;
/// Factor by which the spread of a tree's boxes may grow before camlux builds the tree again. The time of rays grows by about the same
/// factor.
const MOST_GROWTH: f32 = 1.1;

/// The triangles of the scene's space or of a shared mesh, and the ray tree over them.
#[derive(Debug, Default)]
pub(crate) struct MeshTree {
    /// In the order of the meshes, because a ray hits the first of several triangles at the same distance.
    pub(super) triangles: Vec<Texel>,
    pub has_instances: bool,
    pub(super) slack: f32,
    /// The spread of the boxes when the tree was built.
    built_spread: f32,
    pub(super) grid: Grid,
    /// Depth first: pairs of 16 bits for x, y and z (low corner | high corner << 16), and the node after the subtree, or a leaf's one
    /// triangle.
    pub(super) nodes: Vec<Texel>,
    wide: OnceLock<Arc<WideTree>>,
}

impl MeshTree {
    /// Builds a tree over the triangles in the scene's space. Triangles whose entry in `cutouts` is not 0 have cut-outs. In a scene with
    /// instances, the grid of the boxes does not depend on how far the triangles reach.
    pub fn of_scene(corners: &[[Vec3; 3]], cutouts: &[u32], has_instances: bool) -> MeshTree {
        let whole = Aabb::from_points(&[Vec3A::NEG_ONE, Vec3A::ONE]);
        let mut tree = MeshTree {
            has_instances,
            slack: BOX_SLACK,
            grid: Grid::around(whole, BOX_SLACK),
            ..MeshTree::default()
        };
        tree.grow(corners, cutouts);
        tree
    }

    /// Builds a tree over the triangles of a mesh in its own space, with the slack that its instances need.
    pub fn of_mesh(corners: &[[Vec3; 3]], slack: f32) -> MeshTree {
        let mut tree = MeshTree {
            slack,
            ..MeshTree::default()
        };
        tree.grow(corners, &vec![0; corners.len()]);
        tree
    }

    /// Moves the triangles and refits the boxes. Returns false if a new tree is better: the boxes have grown, or other triangles have
    /// cut-outs. Drop the tree in that case.
    pub fn refit_scene(
        &mut self,
        corners: &[[Vec3; 3]],
        cutouts: &[u32],
        has_instances: bool,
    ) -> bool {
        self.has_instances == has_instances && self.refit(corners, cutouts)
    }

    /// The same for a tree of [`of_mesh`](MeshTree::of_mesh).
    pub fn refit_mesh(&mut self, corners: &[[Vec3; 3]], slack: f32) -> bool {
        self.slack == slack && self.refit(corners, &vec![0; corners.len()])
    }

    pub fn triangle_count(&self) -> u32 {
        (self.triangles.len() / TRIANGLE_TEXELS) as u32
    }

    /// Adds the triangles and the tree over them.
    fn grow(&mut self, corners: &[[Vec3; 3]], cutouts: &[u32]) {
        let order: Vec<u32> = (0..corners.len() as u32).collect();
        self.triangles = triangle_texels_in(&order, corners, cutouts);
        if corners.is_empty() {
            return;
        }
        let triangle = |corners: &[Vec3; 3]| {
            let [v0, v1, v2] = corners.map(Into::into);
            Triangle { v0, v1, v2 }
        };
        let inputs: Vec<Triangle> = corners.iter().map(triangle).collect();
        let tree = build_bvh2_from_tris(&inputs, build_parameters(), &mut Duration::default());
        self.fit_grid(tree.nodes[0].aabb);
        let leaf = |node: &Bvh2Node| {
            let triangle = tree.primitive_indices[node.first_index as usize];
            let cutout = match cutouts[triangle as usize] {
                0 => 0,
                _ => LEAF_CUTOUT,
            };
            LEAF | cutout | triangle
        };
        self.nodes = flatten(&tree, leaf, &self.grid, self.slack);
        let boxes = tree.nodes.iter();
        self.built_spread = spread(boxes.map(|node| (node.is_leaf(), &node.aabb)));
    }

    fn refit(&mut self, corners: &[[Vec3; 3]], cutouts: &[u32]) -> bool {
        let (triangles, _) = self.triangles.as_chunks_mut::<TRIANGLE_TEXELS>();
        if corners.len() != triangles.len() {
            return false;
        }
        let moved = corners.chunks(AT_ONCE).zip(cutouts.chunks(AT_ONCE));
        let have_same_cutouts = AtomicBool::new(true);
        let parts = triangles.chunks_mut(AT_ONCE).zip(moved).enumerate();
        for_each(parts, |(part, (triangles, (corners, cutouts)))| {
            let moved = corners.iter().zip(cutouts).zip((part * AT_ONCE) as u32..);
            for (triangle, ((&corners, &cutout), place)) in triangles.iter_mut().zip(moved) {
                let [a, b, c, numbers] = &triangle;
                if (numbers[1] > 0.0) != (cutout > 0) {
                    have_same_cutouts.store(false, Ordering::Relaxed);
                    return;
                }
                let moved_to = corners.map(|at| bits(at.extend(0.0).into()));
                let has_moved = [*a, *b, *c].map(bits) != moved_to;
                if has_moved || numbers[1] != cutout as f32 {
                    *triangle = triangle_texels(corners, [place, cutout]);
                }
            }
        });
        if !have_same_cutouts.into_inner() {
            return false;
        }
        let boxes = self.fitted_boxes();
        let Some(&whole) = boxes.first() else {
            return true;
        };
        let are_leaves = self.nodes.iter().map(|node| node[3].to_bits() & LEAF != 0);
        if spread(are_leaves.zip(&boxes)) > MOST_GROWTH * self.built_spread {
            return false;
        }
        self.fit_grid(whole);
        let parts = self.nodes.chunks_mut(AT_ONCE).zip(boxes.chunks(AT_ONCE));
        for_each(parts, |(nodes, boxes)| {
            for (texel, bounds) in nodes.iter_mut().zip(boxes) {
                let [x, y, z] = self.grid.words(bounds, self.slack);
                *texel = [x, y, z, texel[3]];
            }
        });
        match self.wide.get_mut().and_then(Arc::get_mut) {
            Some(wide) => wide.refit(&self.triangles, self.slack),
            None => self.wide = OnceLock::new(),
        }
        true
    }

    /// Fits the grid to a box. In a scene with instances, the grid stays that of the whole scene.
    fn fit_grid(&mut self, bounds: Aabb) {
        if !self.has_instances {
            self.grid = Grid::around(bounds, self.slack);
        }
    }

    /// The same tree for rays that the host traces. It is made on first use.
    pub(super) fn wide(&self) -> Arc<WideTree> {
        let make = || {
            let (tree, boxes) = (self, self.fitted_boxes());
            WideTree::over(&Fitted { tree, boxes }, &self.triangles, self.slack).into()
        };
        self.wide.get_or_init(make).clone()
    }

    /// The smallest box around the triangles below each node.
    fn fitted_boxes(&self) -> Vec<Aabb> {
        let mut boxes: Vec<Aabb> = bytemuck::zeroed_vec(self.nodes.len());
        // Small subtrees, and the nodes above them.
        let (mut parts, mut above) = (Vec::new(), Vec::new());
        let (mut rest, mut node) = (&mut boxes[..], 0);
        while node < self.nodes.len() {
            let size = self.end(node) - node;
            let is_small = size <= AT_ONCE;
            let taken = if is_small { size } else { 1 };
            let (part, after) = rest.split_at_mut(taken);
            match is_small {
                true => parts.push((node, part)),
                false => above.push(node),
            }
            (rest, node) = (after, node + taken);
        }
        for_each(parts.into_iter(), |(root, boxes)| {
            for node in (root..root + boxes.len()).rev() {
                boxes[node - root] = match self.children(node) {
                    Ok(children) => union_of(boxes, children.map(|child| child - root)),
                    Err(triangle) => {
                        let texels = &self.triangles[TRIANGLE_TEXELS * triangle as usize..][..3];
                        let corner = |corner: usize| Vec3A::from_slice(&texels[corner]);
                        Aabb::from_points(&[0, 1, 2].map(corner))
                    }
                };
            }
        });
        for node in above.into_iter().rev() {
            if let Ok(children) = self.children(node) {
                boxes[node] = union_of(&boxes, children);
            }
        }
        boxes
    }

    /// The node after a node's subtree.
    fn end(&self, node: usize) -> usize {
        match self.nodes[node][3].to_bits() {
            word if word & LEAF != 0 => node + 1,
            next => next as usize,
        }
    }

    /// The children of a node, or the triangle of a leaf. The first child follows the node, and the second one follows the first one's
    /// subtree.
    pub(super) fn children(&self, node: usize) -> Result<[usize; 2], u32> {
        let word = self.nodes[node][3].to_bits();
        if word & LEAF != 0 {
            return Err(word & !(LEAF | LEAF_CUTOUT));
        }
        Ok([node + 1, self.end(node + 1)])
    }

    /// Boxes that contain the whole mesh: those of the tree's first levels.
    pub(super) fn cover(&self) -> Vec<[Vec3; 2]> {
        let mut boxes = Vec::new();
        let mut open = vec![(0, COVER_LEVELS)];
        while let Some((node, levels)) = open.pop() {
            match self.children(node) {
                Ok(children) if levels > 0 => {
                    open.extend(children.map(|child| (child, levels - 1)));
                }
                _ => boxes.push(self.grid.box_of(&self.nodes[node])),
            }
        }
        boxes
    }
}

fn union_of(boxes: &[Aabb], [first, second]: [usize; 2]) -> Aabb {
    boxes[first].union(&boxes[second])
}

/// A tree with boxes that fit.
struct Fitted<'t> {
    tree: &'t MeshTree,
    boxes: Vec<Aabb>,
}

impl Binary for Fitted<'_> {
    fn children(&self, node: usize) -> Result<[usize; 2], u32> {
        self.tree.children(node)
    }

    fn bounds(&self, node: usize) -> [Vec3A; 2] {
        [self.boxes[node].min, self.boxes[node].max]
    }

    fn count(&self, node: usize) -> usize {
        // Below n leaves are n - 1 inner nodes.
        match self.boxes.is_empty() {
            true => 0,
            false => (self.tree.end(node) - node).div_ceil(2),
        }
    }
}

/// The bits of a corner's position. They distinguish −0 from 0.
fn bits([x, y, z, _]: Texel) -> [u32; 3] {
    [x, y, z].map(f32::to_bits)
}
