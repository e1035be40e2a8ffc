//! The scene's triangles as rays meet them on the device: the large ones alone, the others in a tree of boxes.

use std::time::Duration;

use glam::{BVec3, DAffine3, DVec3, UVec3, Vec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    aabb::Aabb,
    bvh2::{
        Bvh2,
        builder::{build_bvh2, build_bvh2_from_tris},
        node::Bvh2Node,
    },
    triangle::Triangle,
};

use crate::{LocalSpace, scene::Mesh};

/// Triangles that stand alone come in groups of as many.
const GROUP: usize = 8;
/// Texels of a triangle: its corners, each with a component of the unit normal; its place in the scene, and that of its cut-outs.
pub(crate) const TRIANGLE_TEXELS: usize = 4;
/// Triangles of a scene without a tree, and those beside a tree, at most.
const MAX_FACETS: u64 = 64;
/// A triangle whose box has more than this share of the scene's surface stands alone.
const FACET_SHARE: f32 = 0.004;
/// What the word of a leaf has beside its triangle.
const LEAF: u32 = 1 << 30;
/// And where that has cut-outs.
const LEAF_CUTOUT: u32 = 1 << 29;
/// That of an instance.
const LEAF_INSTANCE: u32 = 1 << 28;
/// Texels of the list of boxes before the first node.
pub(crate) const HEADER_TEXELS: usize = 3;
/// Levels of a shared mesh's tree whose boxes tell how far its instances reach.
const COVER_LEVELS: u32 = 6;
/// By how much the boxes of a tree may grow before it is built again, over that of the whole: rays go through it about as much longer.
const MOST_GROWTH: f32 = 1.1;
/// Steps of the grid that boxes are rounded to, along an axis. Below 2¹⁵, so that no pair of them is the bits of a NaN.
const GRID_STEPS: f32 = 32_000.0;
/// By how much a box is larger than what it holds, local units. The ray that the triangle test sees is off by up to 16
/// roundings (2⁻²⁴ each) of an offset within the scene, and that is at most 2√3; the products of the box test by another
/// 16 of 2.
const BOX_SLACK: f32 = 6e-6;
/// The same of a shared mesh in the scene's units: the ray is turned into its space with another 16 roundings of an offset within the scene,
/// and the triangle's corners into the scene's with four.
const BOX_SLACK_OF_SHARED: f32 = 1e-5;

pub(crate) type Texel = [f32; 4];

/// Texels of so many triangles at most. Boxes have fewer.
pub(crate) fn max_triangle_texels(triangle_count: u64) -> u64 {
    TRIANGLE_TEXELS as u64 * (triangle_count + GROUP as u64)
}

/// Texels of the boxes over so many triangles and instances at most: the header, and trees with one of them a leaf.
pub(crate) fn max_box_texels(triangle_count: u64, instance_count: u64) -> u64 {
    let in_trees = match triangle_count {
        0..=MAX_FACETS => instance_count,
        _ => triangle_count + instance_count,
    };
    HEADER_TEXELS as u64 + 2 * in_trees
}

/// The triangles of the scene's space or of a shared mesh, and a tree over them.
#[derive(Debug, Default)]
pub(crate) struct MeshTree {
    /// Triangles that stand alone.
    facets: Vec<u32>,
    group_count: u32,
    /// Those that stand alone, filled up with triangles without area; then the others. Both in an order that does not depend on the tree, for of
    /// triangles that a ray meets at one distance the first is hit.
    triangles: Vec<Texel>,
    pub has_instances: bool,
    slack: f32,
    /// Of the boxes when the tree was built.
    built_cost: f32,
    grid: Grid,
    /// Depth first: pairs of 16 bits for x, y and z, low corner | high corner << 16, and what follows the subtree, or a leaf's one triangle.
    nodes: Vec<Texel>,
}

/// To which boxes are rounded: the low corner, and the steps.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
struct Grid {
    low: Vec3,
    step: Vec3,
}

/// A shared mesh in the order in which a ray tree has them.
pub(crate) struct SharedTree<'t> {
    pub tree: &'t MeshTree,
    /// The place of its first triangle.
    pub first_place: u32,
    /// From its own space to the scene's, for each instance.
    pub to_local: Vec<DAffine3>,
}

/// Two lists of texels.
#[derive(Debug, Default)]
pub(crate) struct RayTree {
    /// First the groups of triangles that stand alone and the number of nodes of the scene's own tree, as [`whole_number`]; its grid's low
    /// corner; its steps. Then the nodes of that tree, at its end those over instances; then for each shared mesh its grid and its nodes.
    pub boxes: Vec<Texel>,
    /// As in [`MeshTree`], mesh after mesh.
    pub triangles: Vec<Texel>,
    pub group_count: u32,
    /// Of the scene's own tree: 0 where all triangles stand alone.
    pub node_count: u32,
    /// Shared mesh by shared mesh.
    pub instances: Vec<TreeInstance>,
}

/// What a ray goes through that meets the box of an instance.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(crate) struct TreeInstance {
    /// Of its mesh, among all.
    pub first_triangle: u32,
    pub triangle_count: u32,
    /// Of its mesh's tree in the list of boxes.
    pub first_texel: u32,
    /// The node behind the last of that tree.
    pub node_end: u32,
    /// The node of the scene's tree behind its own.
    pub next_node: u32,
}

impl MeshTree {
    /// Over the triangles that lie in the scene's space, of which those of other numbers than 0 have cut-outs: these are all in the tree.
    /// Beside instances its boxes do not depend on how far the triangles reach.
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

    /// Over the triangles of a mesh in its own space, with the slack that its instances need.
    pub fn of_mesh(corners: &[[Vec3; 3]], slack: f32) -> MeshTree {
        let mut tree = MeshTree {
            slack,
            ..MeshTree::default()
        };
        let all: Vec<u32> = (0..corners.len() as u32).collect();
        tree.grow(corners, &vec![0; corners.len()], &all);
        tree
    }

    /// Moves the triangles and fits the boxes to them. False where a new tree is better: the boxes have grown, or other triangles stand alone
    /// or have cut-outs. Such a tree is to be dropped.
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

    /// The same of [`of_mesh`](MeshTree::of_mesh).
    pub fn refit_mesh(&mut self, corners: &[[Vec3; 3]], slack: f32) -> bool {
        let all: Vec<u32> = (0..corners.len() as u32).collect();
        self.slack == slack && self.refit(corners, &vec![0; corners.len()], &all)
    }

    pub fn triangle_count(&self) -> u32 {
        (self.triangles.len() / TRIANGLE_TEXELS) as u32
    }

    /// Of those of the leaves.
    fn first_triangle(&self) -> usize {
        self.group_count as usize * GROUP
    }

    /// Adds the tree over some triangles.
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
        let inner = tree.nodes.iter().filter(|node| !node.is_leaf());
        self.built_cost = cost(inner.map(|node| node.aabb), &tree.nodes[0].aabb);
    }

    fn refit(&mut self, corners: &[[Vec3; 3]], cutouts: &[u32], others: &[u32]) -> bool {
        let first = self.first_triangle();
        let facets = (0..).zip(&self.facets);
        let numbers = facets.chain((first..).zip(others));
        let (triangles, _) = self.triangles.as_chunks_mut::<TRIANGLE_TEXELS>();
        if first + others.len() != triangles.len() {
            return false;
        }
        for (at, &place) in numbers {
            let [of_corners @ .., numbers] = &triangles[at];
            let had_cutouts = numbers[1] > 0.0;
            let place_corners = corners[place as usize];
            let cutout = cutouts[place as usize];
            if had_cutouts != (cutout > 0) {
                return false;
            }
            let is_there = of_corners
                .iter()
                .zip(&place_corners)
                .all(|(texel, corner)| texel[..3] == corner.to_array());
            if is_there && numbers[1] == cutout as f32 {
                continue;
            }
            triangles[at] = triangle_texels(place_corners, [place, cutout]);
        }
        let Some(boxes) = self.fitted_boxes(corners, others) else {
            return true;
        };
        let is_inner = |node: &usize| self.nodes[*node][3].to_bits() & LEAF == 0;
        let inner = (0..boxes.len()).filter(is_inner);
        let grown = cost(inner.map(|node| boxes[node]), &boxes[0]) / self.built_cost;
        if grown > MOST_GROWTH {
            return false;
        }
        self.fit_grid(boxes[0]);
        for (texel, bounds) in self.nodes.iter_mut().zip(&boxes) {
            let [x, y, z] = self.grid.words(bounds, self.slack);
            *texel = [x, y, z, texel[3]];
        }
        true
    }

    /// Beside instances it stays that of the whole scene.
    fn fit_grid(&mut self, bounds: Aabb) {
        if !self.has_instances {
            self.grid = Grid::around(bounds, self.slack);
        }
    }

    /// The least box around the triangles below each node. None without nodes.
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

    /// Of a node with children. The first one follows the node, and the second one the first one's subtree.
    fn second_child(&self, node: usize) -> usize {
        match self.nodes[node + 1][3].to_bits() {
            word if word & LEAF != 0 => node + 2,
            next => next as usize,
        }
    }

    /// Boxes that hold all of it: those of its first levels.
    fn cover(&self) -> Vec<[Vec3; 2]> {
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

impl RayTree {
    /// The tree of the scene, and those of shared meshes below the boxes of their instances.
    pub fn over(scene: &MeshTree, shared: &[SharedTree]) -> RayTree {
        let mut tree = RayTree {
            boxes: vec![[0.0; 4]; HEADER_TEXELS],
            triangles: scene.triangles.clone(),
            group_count: scene.group_count,
            node_count: 0,
            instances: Vec::new(),
        };
        tree.boxes.extend(&scene.nodes);
        let next_nodes = tree.add_instances(scene, shared);
        tree.node_count = (tree.boxes.len() - HEADER_TEXELS) as u32;
        let [groups, nodes] = [tree.group_count, tree.node_count].map(whole_number);
        tree.boxes[0] = [groups, nodes, 0.0, 0.0];
        tree.boxes[1..HEADER_TEXELS].copy_from_slice(&scene.grid.texels());
        let mut next_nodes = next_nodes.into_iter();
        for mesh in shared {
            let added = tree.add_mesh(mesh);
            let placed = next_nodes.by_ref().take(mesh.to_local.len());
            tree.instances
                .extend(placed.map(|next_node| TreeInstance { next_node, ..added }));
        }
        tree
    }

    /// Adds the tree over instances, and says which node is behind that of each.
    fn add_instances(&mut self, scene: &MeshTree, shared: &[SharedTree]) -> Vec<u32> {
        let bounds = shared.iter().flat_map(|mesh| {
            let cover = mesh.tree.cover();
            let bounds = move |to_local: &DAffine3| {
                let mut bounds = Aabb::empty();
                for corner in cover
                    .iter()
                    .flat_map(|&[low, high]| corners_of_box(low, high))
                {
                    bounds.extend(to_local.transform_point3(corner.as_dvec3()).as_vec3a());
                }
                bounds
            };
            mesh.to_local.iter().map(bounds)
        });
        let bounds: Vec<Aabb> = bounds.collect();
        if bounds.is_empty() {
            return Vec::new();
        }
        let tree = build_bvh2(&bounds, build_parameters(), &mut Duration::default());
        let leaf = |node: &Bvh2Node| {
            LEAF | LEAF_INSTANCE | tree.primitive_indices[node.first_index as usize]
        };
        let first = self.boxes.len() - HEADER_TEXELS;
        let nodes = flatten(&tree, leaf, &scene.grid, BOX_SLACK);
        self.boxes
            .extend(nodes.into_iter().map(|node| moved(node, first, 0)));
        let mut next_nodes = vec![0; bounds.len()];
        for (node, texel) in self
            .boxes
            .iter()
            .skip(HEADER_TEXELS)
            .enumerate()
            .skip(first)
        {
            let word = texel[3].to_bits();
            if word & LEAF != 0 {
                next_nodes[(word & !(LEAF | LEAF_INSTANCE)) as usize] = node as u32 + 1;
            }
        }
        next_nodes
    }

    /// Adds the tree of a shared mesh.
    fn add_mesh(&mut self, mesh: &SharedTree) -> TreeInstance {
        let first_triangle = self.triangles.len() / TRIANGLE_TEXELS;
        let first_texel = self.boxes.len();
        self.boxes.extend(mesh.tree.grid.texels());
        let first_node = self.boxes.len() - HEADER_TEXELS;
        let nodes = mesh.tree.nodes.iter();
        self.boxes
            .extend(nodes.map(|&node| moved(node, first_node, first_triangle)));
        for triangle in mesh.tree.triangles.as_chunks::<TRIANGLE_TEXELS>().0 {
            let [corners @ .., [place, more @ ..]] = triangle;
            let place = place + mesh.first_place as f32;
            let [second, third, fourth] = *more;
            self.triangles.extend(corners);
            self.triangles.push([place, second, third, fourth]);
        }
        TreeInstance {
            first_triangle: first_triangle as u32,
            triangle_count: mesh.tree.triangle_count(),
            first_texel: first_texel as u32,
            node_end: (first_node + mesh.tree.nodes.len()) as u32,
            next_node: 0,
        }
    }
}

/// By how much the boxes of a mesh that is placed like this are larger than what they hold.
pub(crate) fn slack_of_shared(to_local: &[DAffine3]) -> f32 {
    let unit = to_local.iter().map(unit_length);
    let unit = unit.fold(f64::MIN_POSITIVE, f64::max);
    // A power of two, so that the tree stays as it is where instances grow and shrink a little.
    (f64::from(BOX_SLACK_OF_SHARED) * unit.log2().ceil().exp2()) as f32
}

/// How long a length of 1 in the scene is in the space of a mesh, at most.
fn unit_length(to_local: &DAffine3) -> f64 {
    let back = to_local.matrix3.inverse().transpose();
    let rows = [back.x_axis, back.y_axis, back.z_axis];
    rows.map(DVec3::length).into_iter().fold(0.0, f64::max)
}

/// A node of a tree that begins farther back.
fn moved([x, y, z, word]: Texel, nodes: usize, triangles: usize) -> Texel {
    let word = word.to_bits();
    let by = match word & LEAF {
        0 => nodes,
        _ => triangles,
    };
    [x, y, z, f32::from_bits(word + by as u32)]
}

/// A number below 2²⁹ for `whole_number` of `shaders/instance.wgsl`: its bits are those of a float that is neither subnormal nor NaN.
pub(crate) fn whole_number(number: u32) -> f32 {
    f32::from_bits(number | 1 << 30)
}

fn build_parameters() -> BvhBuildParams {
    BvhBuildParams {
        max_prims_per_leaf: 1,
        ..BvhBuildParams::medium_build()
    }
}

fn corners_of_box(low: Vec3, high: Vec3) -> [Vec3; 8] {
    let is_high = |corner: usize| BVec3::new(corner & 1 != 0, corner & 2 != 0, corner & 4 != 0);
    std::array::from_fn(|corner| Vec3::select(is_high(corner), high, low))
}

impl Grid {
    fn around(bounds: Aabb, slack: f32) -> Grid {
        let extent: Vec3 = (bounds.max - bounds.min + 4.0 * slack).into();
        Grid {
            low: (bounds.min - 2.0 * slack).into(),
            step: extent / GRID_STEPS,
        }
    }

    /// A box rounded outwards.
    fn words(&self, bounds: &Aabb, slack: f32) -> [f32; 3] {
        let (min, max): (Vec3, Vec3) = (bounds.min.into(), bounds.max.into());
        // An extent of nothing has no steps.
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

    fn texels(&self) -> [Texel; 2] {
        [self.low, self.step].map(|corner| corner.extend(0.0).to_array())
    }

    fn box_of(&self, node: &Texel) -> [Vec3; 2] {
        let words = [0, 1, 2].map(|axis| node[axis].to_bits());
        [0, 16].map(|shift| {
            let on_grid = words.map(|word| (word >> shift & 0xffff) as f32);
            self.low + self.step * Vec3::from_array(on_grid)
        })
    }
}

/// The triangles that stand alone, large ones first where there are others; and these in their own order.
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

/// What a ray through the whole has to test, but for a factor: the areas of the boxes over that of the whole.
fn cost(boxes: impl Iterator<Item = Aabb>, whole: &Aabb) -> f32 {
    boxes.map(|bounds| bounds.half_area()).sum::<f32>() / whole.half_area().max(f32::MIN_POSITIVE)
}

fn flatten(tree: &Bvh2, leaf: impl Fn(&Bvh2Node) -> u32, grid: &Grid, slack: f32) -> Vec<Texel> {
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
        let [x, y, z] = grid.words(&node.aabb, slack);
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

/// The corners of a valid mesh's triangles in a space of the device.
pub(crate) fn corners_of(mesh: &Mesh, space: &LocalSpace) -> Vec<[Vec3; 3]> {
    let local = |corner: u32| space.to_local(mesh.positions_m[corner as usize]).into();
    let triangles = mesh.triangles.iter();
    triangles.map(|corners| corners.map(local)).collect()
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

    /// Small triangles in a row, and a large one.
    fn corners() -> Vec<[Vec3; 3]> {
        let small = |i: usize| {
            let at = vec3(i as f32 / 100.0 - 0.5, 0.1, 0.0);
            [at, at + 0.005 * Vec3::X, at + 0.005 * Vec3::Y]
        };
        let large = [-Vec3::ONE, vec3(1.0, -1.0, 1.0), vec3(0.0, 1.0, 1.0)];
        (0..100).map(small).chain([large]).collect()
    }

    fn tree_with_cutouts(corners: &[[Vec3; 3]], cutouts: &[u32]) -> RayTree {
        RayTree::over(&MeshTree::of_scene(corners, cutouts, false), &[])
    }

    fn tree_over(corners: &[[Vec3; 3]]) -> RayTree {
        tree_with_cutouts(corners, &vec![0; corners.len()])
    }

    /// Of a node by the grid that begins at a texel.
    fn grid_box(tree: &RayTree, grid: usize, node: usize) -> [Vec3; 2] {
        let [low, step] = [0, 1].map(|i| Vec3::from_slice(&tree.boxes[grid + i][..3]));
        Grid { low, step }.box_of(&tree.boxes[HEADER_TEXELS + node])
    }

    fn word(tree: &RayTree, node: usize) -> u32 {
        tree.boxes[HEADER_TEXELS + node][3].to_bits()
    }

    #[test]
    fn boxes_hold_the_triangles_below_them() {
        let tree = tree_over(&corners());
        let node_count = tree.boxes.len() - HEADER_TEXELS;
        assert_eq!(tree.boxes[0][..2], [1, node_count as u32].map(whole_number));
        // A tree of one triangle a leaf.
        assert_eq!(node_count, 2 * 100 - 1);
        let word = |node: usize| word(&tree, node);
        let mut leaves = 0;
        for node in 0..node_count {
            let is_leaf = word(node) & LEAF != 0;
            let end = if is_leaf {
                node + 1
            } else {
                word(node) as usize
            };
            assert!(end > node && end <= node_count);
            let [low, high] = grid_box(&tree, 1, node);
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
        assert_eq!(few.boxes[0][..2], [2, 0].map(whole_number));
        assert_eq!(few.triangles.len(), 2 * GROUP * TRIANGLE_TEXELS);
        let none = tree_over(&[]);
        assert_eq!(none.triangles, [[0.0; 4]; GROUP * TRIANGLE_TEXELS]);
    }

    #[test]
    fn triangles_with_cutouts_are_in_the_tree() {
        let mut cutouts = vec![0; 101];
        (cutouts[3], cutouts[100]) = (1, 2);
        let tree = tree_with_cutouts(&corners(), &cutouts);
        assert_eq!(tree.node_count, 2 * 101 - 1);
        let numbers = tree.triangles.iter().skip(3).step_by(TRIANGLE_TEXELS);
        let of_cutouts = numbers.filter(|texel| texel[1] > 0.0);
        let mut of_cutouts: Vec<_> = of_cutouts.map(|texel| [texel[0], texel[1]]).collect();
        of_cutouts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert_eq!(of_cutouts, [[3.0, 1.0], [100.0, 2.0]]);
        let few = tree_with_cutouts(&corners()[..9], &cutouts[..9]);
        assert_eq!((few.group_count, few.node_count), (1, 1));
    }

    #[test]
    fn instances_share_a_tree_and_lie_in_their_boxes() {
        let to_local: Vec<DAffine3> = (0..5)
            .map(|i| {
                let turn = DAffine3::from_rotation_y(f64::from(i))
                    * DAffine3::from_scale(DVec3::splat(0.1));
                DAffine3::from_translation(DVec3::splat(0.1 * f64::from(i))) * turn
            })
            .collect();
        let own = corners();
        let mesh = MeshTree::of_mesh(&own, slack_of_shared(&to_local));
        let scene = MeshTree::of_scene(&corners(), &[0; 101], true);
        let shared = SharedTree {
            tree: &mesh,
            first_place: 101,
            to_local: to_local.clone(),
        };
        let tree = RayTree::over(&scene, &[shared]);
        let own_nodes = 2 * 101 - 1;
        assert_eq!(tree.node_count, 2 * 100 - 1 + 2 * 5 - 1);
        let nodes = tree.node_count + 2 + own_nodes;
        assert_eq!(tree.boxes.len(), HEADER_TEXELS + nodes as usize);
        for (i, (instance, to_local)) in tree.instances.iter().zip(&to_local).enumerate() {
            let leaf = instance.next_node as usize - 1;
            assert_eq!(word(&tree, leaf), LEAF | LEAF_INSTANCE | i as u32);
            let [low, high] = grid_box(&tree, 1, leaf);
            for corner in own.as_flattened() {
                let placed = to_local.transform_point3(corner.as_dvec3()).as_vec3();
                assert!(placed.cmpgt(low).all() && placed.cmplt(high).all());
            }
            assert_eq!(
                instance.first_texel as usize,
                HEADER_TEXELS + tree.node_count as usize
            );
            assert_eq!(instance.node_end, nodes);
            assert_eq!(instance.triangle_count, 101);
            // Its nodes lead to its own triangles, which know their places.
            let first_node = instance.first_texel as usize + 2 - HEADER_TEXELS;
            assert_eq!(word(&tree, first_node), nodes);
            let leaves = (first_node..nodes as usize).map(|node| word(&tree, node));
            let leaves = leaves.filter(|word| word & LEAF != 0);
            let mut places: Vec<f32> = leaves
                .map(|word| tree.triangles[TRIANGLE_TEXELS * (word & !LEAF) as usize + 3][0])
                .collect();
            places.sort_by(f32::total_cmp);
            let all: Vec<f32> = (101..202).map(|place| place as f32).collect();
            assert_eq!(places, all);
        }
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
        assert_eq!(tree.boxes.len(), HEADER_TEXELS + 2 * (1000 - 64) - 1);
    }
}
