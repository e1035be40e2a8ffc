//! The triangles of the scene's space or of a shared mesh, and the ray tree (BVH) over them.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::{
    aabb::Aabb,
    bvh2::{builder::build_bvh2_from_tris, node::Bvh2Node},
    triangle::Triangle,
};

use super::{
    BOX_SLACK, Texel,
    nodes::{Grid, LEAF, LEAF_CUTOUT, build_parameters, flatten, spread},
    triangles::{TRIANGLE_TEXELS, triangle_texels, triangle_texels_in},
};

/// Triangles outside the tree are stored in groups of this size.
pub(super) const GROUP: usize = 8;
/// Maximum number of triangles outside the tree. A scene with no more triangles needs no tree.
pub(super) const MAX_FACETS: u64 = 64;
/// A triangle is outside the tree if its box has more than this share of the area of the scene's box.
const FACET_SHARE: f32 = 0.004;
/// Levels of a shared mesh's tree whose boxes give the bounds of its instances.
const COVER_LEVELS: u32 = 6;
/// Factor by which the spread of a tree's boxes may grow before camlux builds the tree again. The time of rays grows by about the same
/// factor.
const MOST_GROWTH: f32 = 1.1;

/// The triangles of the scene's space or of a shared mesh, and the ray tree over them.
#[derive(Debug, Default)]
pub(crate) struct MeshTree {
    /// Triangles outside the tree.
    facets: Vec<u32>,
    pub(super) group_count: u32,
    /// First the triangles outside the tree, padded with triangles without area; then the others. Neither order depends on the tree,
    /// because a ray hits the first of several triangles at the same distance.
    pub(super) triangles: Vec<Texel>,
    pub has_instances: bool,
    slack: f32,
    /// The spread of the boxes when the tree was built.
    built_spread: f32,
    pub(super) grid: Grid,
    /// Depth first: pairs of 16 bits for x, y and z (low corner | high corner << 16), and the node after the subtree, or a leaf's one
    /// triangle.
    pub(super) nodes: Vec<Texel>,
}

impl MeshTree {
    /// Builds a tree over the triangles in the scene's space. Triangles whose entry in `cutouts` is not 0 have cut-outs; all of these are
    /// in the tree. In a scene with instances, the grid of the boxes does not depend on how far the triangles reach.
    pub fn of_scene(corners: &[[Vec3; 3]], cutouts: &[u32], has_instances: bool) -> MeshTree {
        let (facets, others) = facets_and_others(corners, cutouts);
        let mut triangles = triangle_texels_in(&facets, corners, cutouts);
        let group_count = facets.len().div_ceil(GROUP).max(1);
        triangles.resize(group_count * GROUP * TRIANGLE_TEXELS, [0.0; 4]);
        let whole = Aabb::from_points(&[Vec3A::NEG_ONE, Vec3A::ONE]);
        let mut tree = MeshTree {
            facets,
            group_count: group_count as u32,
            triangles,
            has_instances,
            slack: BOX_SLACK,
            grid: Grid::around(whole, BOX_SLACK),
            ..MeshTree::default()
        };
        tree.grow(corners, cutouts, &others);
        tree
    }

    /// Builds a tree over the triangles of a mesh in its own space, with the slack that its instances need.
    pub fn of_mesh(corners: &[[Vec3; 3]], slack: f32) -> MeshTree {
        let mut tree = MeshTree {
            slack,
            ..MeshTree::default()
        };
        let all: Vec<u32> = (0..corners.len() as u32).collect();
        tree.grow(corners, &vec![0; corners.len()], &all);
        tree
    }

    /// Moves the triangles and refits the boxes. Returns false if a new tree is better: the boxes have grown, or other triangles are
    /// outside the tree or have cut-outs. Drop the tree in that case.
    pub fn refit_scene(
        &mut self,
        corners: &[[Vec3; 3]],
        cutouts: &[u32],
        has_instances: bool,
    ) -> bool {
        if self.has_instances != has_instances {
            return false;
        }
        let (facets, others) = facets_and_others(corners, cutouts);
        facets == self.facets && self.refit(corners, cutouts, &others)
    }

    /// The same for a tree of [`of_mesh`](MeshTree::of_mesh).
    pub fn refit_mesh(&mut self, corners: &[[Vec3; 3]], slack: f32) -> bool {
        let all: Vec<u32> = (0..corners.len() as u32).collect();
        self.slack == slack && self.refit(corners, &vec![0; corners.len()], &all)
    }

    pub fn triangle_count(&self) -> u32 {
        (self.triangles.len() / TRIANGLE_TEXELS) as u32
    }

    /// The index of the first triangle of the leaves.
    fn first_triangle(&self) -> usize {
        self.group_count as usize * GROUP
    }

    /// Adds the tree over these triangles.
    fn grow(&mut self, corners: &[[Vec3; 3]], cutouts: &[u32], others: &[u32]) {
        let first = self.triangle_count();
        self.triangles
            .extend(triangle_texels_in(others, corners, cutouts));
        if others.is_empty() {
            return;
        }
        let triangle = |&place: &u32| {
            let [v0, v1, v2] = corners[place as usize].map(Into::into);
            Triangle { v0, v1, v2 }
        };
        let inputs: Vec<Triangle> = others.iter().map(triangle).collect();
        let tree = build_bvh2_from_tris(&inputs, build_parameters(), &mut Duration::default());
        self.fit_grid(tree.nodes[0].aabb);
        let leaf = |node: &Bvh2Node| {
            let index = tree.primitive_indices[node.first_index as usize];
            let cutout = match cutouts[others[index as usize] as usize] {
                0 => 0,
                _ => LEAF_CUTOUT,
            };
            LEAF | cutout | (first + index)
        };
        self.nodes = flatten(&tree, leaf, &self.grid, self.slack);
        let boxes = tree.nodes.iter();
        self.built_spread = spread(boxes.map(|node| (node.is_leaf(), &node.aabb)));
    }

    fn refit(&mut self, corners: &[[Vec3; 3]], cutouts: &[u32], others: &[u32]) -> bool {
        let first = self.first_triangle();
        let (triangles, _) = self.triangles.as_chunks_mut::<TRIANGLE_TEXELS>();
        if first + others.len() != triangles.len() {
            return false;
        }
        let facets = (0..).zip(&self.facets);
        for (at, &place) in facets.chain((first..).zip(others)) {
            let [a, b, c, numbers] = &triangles[at];
            let (corners, cutout) = (corners[place as usize], cutouts[place as usize]);
            if (numbers[1] > 0.0) != (cutout > 0) {
                return false;
            }
            let has_moved = [*a, *b, *c].map(bits) != corners.map(|at| bits(at.extend(0.0).into()));
            if has_moved || numbers[1] != cutout as f32 {
                triangles[at] = triangle_texels(corners, [place, cutout]);
            }
        }
        let Some(boxes) = self.fitted_boxes(corners, others) else {
            return true;
        };
        let are_leaves = self.nodes.iter().map(|node| node[3].to_bits() & LEAF != 0);
        if spread(are_leaves.zip(&boxes)) > MOST_GROWTH * self.built_spread {
            return false;
        }
        self.fit_grid(boxes[0]);
        for (texel, bounds) in self.nodes.iter_mut().zip(&boxes) {
            let [x, y, z] = self.grid.words(bounds, self.slack);
            *texel = [x, y, z, texel[3]];
        }
        true
    }

    /// Fits the grid to a box. In a scene with instances, the grid stays that of the whole scene.
    fn fit_grid(&mut self, bounds: Aabb) {
        if !self.has_instances {
            self.grid = Grid::around(bounds, self.slack);
        }
    }

    /// The smallest box around the triangles below each node; `None` without nodes.
    fn fitted_boxes(&self, corners: &[[Vec3; 3]], others: &[u32]) -> Option<Vec<Aabb>> {
        let first = self.first_triangle();
        let mut boxes = vec![Aabb::empty(); self.nodes.len()];
        for node in (0..self.nodes.len()).rev() {
            boxes[node] = match self.nodes[node][3].to_bits() {
                word if word & LEAF != 0 => {
                    let place = others[(word & !(LEAF | LEAF_CUTOUT)) as usize - first];
                    Aabb::from_points(&corners[place as usize].map(Vec3A::from))
                }
                _ => boxes[node + 1].union(&boxes[self.second_child(node)]),
            };
        }
        (!boxes.is_empty()).then_some(boxes)
    }

    /// The second child of a node. The first child follows the node, and the second child follows the first one's subtree.
    fn second_child(&self, node: usize) -> usize {
        match self.nodes[node + 1][3].to_bits() {
            word if word & LEAF != 0 => node + 2,
            next => next as usize,
        }
    }

    /// Boxes that contain the whole mesh: those of the tree's first levels.
    pub(super) fn cover(&self) -> Vec<[Vec3; 2]> {
        let mut boxes = Vec::new();
        let mut open = vec![(0, COVER_LEVELS)];
        while let Some((node, levels)) = open.pop() {
            let texel = &self.nodes[node];
            if levels == 0 || texel[3].to_bits() & LEAF != 0 {
                boxes.push(self.grid.box_of(texel));
                continue;
            }
            let children = [node + 1, self.second_child(node)];
            open.extend(children.map(|child| (child, levels - 1)));
        }
        boxes
    }
}

/// The bits of a corner's position. They distinguish −0 from 0.
fn bits([x, y, z, _]: Texel) -> [u32; 3] {
    [x, y, z].map(f32::to_bits)
}

/// Returns the triangles outside the tree and the others. If there are more than `MAX_FACETS` without cut-outs, the largest come first;
/// otherwise both keep their order.
fn facets_and_others(corners: &[[Vec3; 3]], cutouts: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let is_whole = |&place: &u32| cutouts[place as usize] == 0;
    let places = 0..corners.len() as u32;
    let whole_count = places.clone().filter(is_whole).count();
    let facets: Vec<u32> = if whole_count as u64 <= MAX_FACETS {
        places.clone().filter(is_whole).collect()
    } else {
        let area = |corners: &[Vec3]| {
            let mut bounds = Aabb::empty();
            for &corner in corners {
                bounds.extend(corner.into());
            }
            bounds.half_area()
        };
        let least_area = FACET_SHARE * area(corners.as_flattened());
        let of_whole = places.clone().filter(is_whole);
        let areas = of_whole.map(|place| (area(&corners[place as usize]), place));
        let mut large: Vec<(f32, u32)> = areas.filter(|&(area, _)| area > least_area).collect();
        large.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let large = large.into_iter().map(|(_, place)| place);
        large.take(MAX_FACETS as usize).collect()
    };
    let mut is_facet = vec![false; corners.len()];
    for &place in &facets {
        is_facet[place as usize] = true;
    }
    let others = places.filter(|&place| !is_facet[place as usize]);
    (facets, others.collect())
}
