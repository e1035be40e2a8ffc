//! The scene's triangles as rays find them: in a ray tree (BVH) on the device, or in a wider one on the host.

mod collapse;
mod cutouts;
mod host;
mod kept;
mod lanes;
mod mesh_tree;
mod nodes;
mod triangles;
mod wide;

use std::time::Duration;

use glam::{BVec3, DAffine3, DVec3, Vec3};
use obvhs::{
    aabb::Aabb,
    bvh2::{builder::build_bvh2, node::Bvh2Node},
};

pub(crate) use cutouts::{Cutouts, alpha_cutoff, alpha_textures};
pub(crate) use host::{Find, HostTracer};
pub(crate) use kept::{MeshTrees, corners_of_placed};
use mesh_tree::MeshTree;
use nodes::{LEAF, LEAF_INSTANCE, build_parameters, flatten};
pub(crate) use triangles::{TRIANGLE_TEXELS, corners_of, triangle_texels_in};
pub(crate) use wide::Ray;

/// Texels in the list of boxes before the first node.
pub(crate) const HEADER_TEXELS: usize = 3;
/// How much larger a box is than its content, local units. The triangle test sees a ray that is off by up to 16 roundings (2⁻²⁴ each) of an
/// offset within the scene, which is at most 2√3. The products of the box test are off by another 16 roundings of 2.
const BOX_SLACK: f32 = 6e-6;
/// The same for a shared mesh, in the scene's units. Turning the ray into the mesh's space adds 16 roundings of an offset within the scene,
/// and turning the triangle's corners into the scene's space adds four.
const BOX_SLACK_OF_SHARED: f32 = 1e-5;

pub(crate) type Texel = [f32; 4];

/// Maximum number of texels of the boxes over this many triangles and instances: the header, and trees with one of them per leaf.
pub(crate) fn max_box_texels(triangle_count: u64, instance_count: u64) -> u64 {
    HEADER_TEXELS as u64 + 2 * (triangle_count + instance_count)
}

/// A shared mesh for a ray tree, which keeps the order of these meshes.
pub(crate) struct SharedTree<'t> {
    pub tree: &'t MeshTree,
    /// The place of its first triangle in the scene.
    pub first_place: u32,
    /// The transform from its own space to the scene's, for each instance.
    pub to_local: Vec<DAffine3>,
}

/// The two lists of texels of the ray tree (BVH).
#[derive(Debug, Default)]
pub(crate) struct RayTree {
    /// The header: the number of nodes of the scene's own tree, as [`whole_number`]; the low corner of that tree's grid; the grid's steps. Then the nodes of that tree, with those over instances at the end. Then the
    /// grid and the nodes of each shared mesh.
    pub boxes: Vec<Texel>,
    /// The triangles as in [`MeshTree`], mesh after mesh.
    pub triangles: Vec<Texel>,
    /// Nodes of the scene's own tree.
    pub node_count: u32,
    /// The instances, one shared mesh after the other.
    pub instances: Vec<TreeInstance>,
}

/// What a ray needs when it meets the box of an instance.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(crate) struct TreeInstance {
    /// The first triangle of its mesh, among all triangles.
    pub first_triangle: u32,
    pub triangle_count: u32,
    /// The first texel of its mesh's tree in the list of boxes.
    pub first_texel: u32,
    /// The node after the last one of that tree.
    pub node_end: u32,
    /// The node of the scene's tree after the instance's own leaf.
    pub next_node: u32,
}

impl RayTree {
    /// Combines the tree of the scene and those of shared meshes, which are below the boxes of their instances.
    pub fn over(scene: &MeshTree, shared: &[SharedTree]) -> RayTree {
        let mut tree = RayTree {
            boxes: vec![[0.0; 4]; HEADER_TEXELS],
            triangles: scene.triangles.clone(),
            node_count: 0,
            instances: Vec::new(),
        };
        tree.boxes.extend(&scene.nodes);
        let next_nodes = tree.add_instances(scene, shared);
        tree.node_count = (tree.boxes.len() - HEADER_TEXELS) as u32;
        tree.boxes[0][0] = whole_number(tree.node_count);
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

    /// Adds the tree over instances. Returns the node after the leaf of each instance.
    fn add_instances(&mut self, scene: &MeshTree, shared: &[SharedTree]) -> Vec<u32> {
        let bounds = placed_bounds(shared);
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

/// The boxes of all instances, mesh after mesh.
fn placed_bounds(shared: &[SharedTree]) -> Vec<Aabb> {
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
    bounds.collect()
}

/// The rows of an affine transform, in the device's layout.
pub(crate) fn rows_of(transform: DAffine3) -> [[f32; 4]; 3] {
    let rows = transform.matrix3.transpose();
    let row = |row: DVec3, offset: f64| row.as_vec3().extend(offset as f32).to_array();
    let DVec3 { x, y, z } = transform.translation;
    [
        row(rows.x_axis, x),
        row(rows.y_axis, y),
        row(rows.z_axis, z),
    ]
}

/// The slack of the boxes of a mesh with these placements.
fn slack_of_shared(to_local: &[DAffine3]) -> f32 {
    let unit = to_local.iter().map(unit_length);
    let unit = unit.fold(f64::MIN_POSITIVE, f64::max);
    // A power of two, so that the tree does not change if instances grow or shrink a little.
    (f64::from(BOX_SLACK_OF_SHARED) * unit.log2().ceil().exp2()) as f32
}

/// The largest length in a mesh's space of a length of 1 in the scene.
fn unit_length(to_local: &DAffine3) -> f64 {
    let back = to_local.matrix3.inverse().transpose();
    let rows = [back.x_axis, back.y_axis, back.z_axis];
    rows.map(DVec3::length).into_iter().fold(0.0, f64::max)
}

/// A node of a tree that begins farther back in the lists.
fn moved([x, y, z, word]: Texel, nodes: usize, triangles: usize) -> Texel {
    let word = word.to_bits();
    let by = match word & LEAF {
        0 => nodes,
        _ => triangles,
    };
    [x, y, z, f32::from_bits(word + by as u32)]
}

/// Encodes a number below 2²⁹ for `whole_number` of `shaders/shared/instance.wgsl`. The bits are those of a float that is neither subnormal nor
/// NaN.
pub(crate) fn whole_number(number: u32) -> f32 {
    f32::from_bits(number | 1 << 30)
}

fn corners_of_box(low: Vec3, high: Vec3) -> [Vec3; 8] {
    let is_high = |corner: usize| BVec3::new(corner & 1 != 0, corner & 2 != 0, corner & 4 != 0);
    std::array::from_fn(|corner| Vec3::select(is_high(corner), high, low))
}

#[cfg(test)]
mod tests {
    use super::nodes::Grid;
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

    /// The box of a node, by the grid that begins at a texel.
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
        assert_eq!(tree.boxes[0][0], whole_number(node_count as u32));
        // A tree with one triangle per leaf.
        assert_eq!(node_count, 2 * 101 - 1);
        assert_boxes_hold_triangles(&tree);
    }

    /// Checks a tree over [`corners`].
    fn assert_boxes_hold_triangles(tree: &RayTree) {
        let node_count = tree.boxes.len() - HEADER_TEXELS;
        let word = |node: usize| word(tree, node);
        let mut leaves = 0;
        for node in 0..node_count {
            let is_leaf = word(node) & LEAF != 0;
            let end = if is_leaf {
                node + 1
            } else {
                word(node) as usize
            };
            assert!(end > node && end <= node_count);
            let [low, high] = grid_box(tree, 1, node);
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
        assert_eq!(leaves, 101);
    }

    #[test]
    fn a_scene_without_triangles_has_no_nodes() {
        let none = tree_over(&[]);
        assert_eq!((none.boxes.len(), none.node_count), (HEADER_TEXELS, 0));
        assert!(none.triangles.is_empty());
    }

    #[test]
    fn triangles_with_cutouts_are_marked() {
        let mut cutouts = vec![0; 101];
        (cutouts[3], cutouts[100]) = (1, 2);
        let tree = tree_with_cutouts(&corners(), &cutouts);
        assert_eq!(tree.node_count, 2 * 101 - 1);
        let numbers = tree.triangles.iter().skip(3).step_by(TRIANGLE_TEXELS);
        let of_cutouts = numbers.filter(|texel| texel[1] > 0.0);
        let mut of_cutouts: Vec<_> = of_cutouts.map(|texel| [texel[0], texel[1]]).collect();
        of_cutouts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert_eq!(of_cutouts, [[3.0, 1.0], [100.0, 2.0]]);
        let marked = (0..tree.node_count as usize).filter(|&node| {
            let flags = LEAF | nodes::LEAF_CUTOUT;
            word(&tree, node) & flags == flags
        });
        assert_eq!(marked.count(), 2);
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
        assert_eq!(tree.node_count, 2 * 101 - 1 + 2 * 5 - 1);
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
            // Its nodes lead to its own triangles, which store their places.
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

    #[test]
    fn a_tree_is_refitted_as_long_as_its_boxes_stay_small() {
        let cutouts = [0; 101];
        let mut tree = MeshTree::of_scene(&corners(), &cutouts, false);
        let moved = |by: Vec3| {
            let mut moved = corners();
            for corner in moved[..100].as_flattened_mut() {
                *corner += by * (3.0 * corner.x).sin();
            }
            moved
        };
        for by in [0.0003 * Vec3::Y, Vec3::ZERO, 0.02 * Vec3::X] {
            assert!(tree.refit_scene(&moved(by), &cutouts, false));
            let refitted = RayTree::over(&tree, &[]);
            let built = tree_over(&moved(by));
            assert_eq!(refitted.triangles, built.triangles);
            assert_boxes_hold_triangles(&refitted);
        }
        // Every second triangle is far from its neighbours.
        let mut apart = corners();
        for corner in apart[..100].iter_mut().step_by(2).flatten() {
            corner.y += 0.5;
        }
        assert!(!tree.refit_scene(&apart, &cutouts, false));
    }

    #[test]
    fn a_tree_over_other_triangles_is_not_refitted() {
        let tree = || MeshTree::of_scene(&corners(), &[0; 101], false);
        assert!(!tree().refit_scene(&corners()[..100], &[0; 100], false));
        assert!(!tree().refit_scene(&corners(), &[0; 101], true));
        let mut cutouts = [0; 101];
        cutouts[5] = 1;
        assert!(!tree().refit_scene(&corners(), &cutouts, false));
        let mesh = || MeshTree::of_mesh(&corners(), 1e-5);
        assert!(mesh().refit_mesh(&corners(), 1e-5));
        assert!(!mesh().refit_mesh(&corners(), 2e-5));
    }

    /// No word of a box has the bits of a NaN, which a driver might change.
    #[test]
    fn words_are_numbers() {
        let tree = tree_over(&corners());
        let mut words = tree.boxes.as_flattened().iter();
        assert!(words.all(|word| word.is_finite()));
    }

    /// The tree is as bad as possible, but there is one.
    #[test]
    fn equal_triangles_have_a_tree() {
        let tree = tree_over(&vec![[Vec3::ZERO, 0.01 * Vec3::X, 0.01 * Vec3::Y]; 1000]);
        assert_eq!(tree.boxes.len(), HEADER_TEXELS + 2 * 1000 - 1);
    }
}
