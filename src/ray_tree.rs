//! The scene's triangles as rays meet them on the device: some alone, the others in trees of eight boxes a node.

use std::time::Duration;

use glam::{DVec3, Vec3};
use obvhs::{
    BvhBuildParams, aabb::Aabb, bvh2::Bvh2, bvh2::builder::build_bvh2_from_tris,
    triangle::Triangle,
};

use crate::{LocalSpace, Scene};

/// Children of a node, triangles of a leaf: as many as a subgroup has lanes.
const WIDTH: usize = 8;
/// Texels of a node: low corners and links of the children, then their high corners.
const NODE_TEXELS: usize = 2 * WIDTH;
/// Texels of a triangle: its corners, each with a component of the unit normal; its place in the scene.
const TRIANGLE_TEXELS: usize = 4;
/// What a box is of, beside its high corner: 0 where there is none.
const OF_NODE: f32 = 1.0;
const OF_LEAF: f32 = 2.0;
/// Levels of nodes that a ray keeps waiting children of.
const MAX_LEVELS: usize = 8;
/// Triangles that every ray is tested against at most.
const MAX_FACETS: usize = 64;
/// Trees that every ray is tested against at most.
const MAX_TREES: usize = 24;
/// A leaf whose box has more than this share of the scene's surface stands alone.
const FACET_SHARE: f32 = 0.01;
/// By how much a box is larger than what it holds, local units. The ray that the triangle test sees is off by up to 16
/// roundings (2⁻²⁴ each) of an offset within the scene, and that is at most 2√3.
const BOX_SLACK: f32 = 3.9e-6;

pub(crate) type Texel = [f32; 4];

/// Two lists of texels.
#[derive(Debug, Default)]
pub(crate) struct RayTree {
    /// Node 0: groups of triangles that stand alone, number of trees. Then the trees: low corner and root, high corner. Then
    /// the nodes.
    pub boxes: Vec<Texel>,
    /// Those that stand alone, then the leaves; in groups of eight, filled up with triangles without area.
    pub triangles: Vec<Texel>,
}

impl RayTree {
    /// The trees over a valid scene's surfaces.
    pub fn of(scene: &Scene, space: &LocalSpace) -> RayTree {
        let mut corners: Vec<[Vec3; 3]> = Vec::new();
        for mesh in &scene.meshes {
            let local = |corner: u32| space.to_local(mesh.positions_m[corner as usize]).into();
            corners.extend(mesh.triangles.iter().map(|corners| corners.map(local)));
        }
        RayTree::over(&corners)
    }

    fn over(corners: &[[Vec3; 3]]) -> RayTree {
        let binary = Binary::over(corners);
        let is_balanced = false;
        Builder::build(corners, &binary, is_balanced)
            .or_else(|| {
                // Deeper than a ray can keep in mind. Halves of 2²⁴ triangles are eight levels.
                let halves = Binary::of_halves(corners);
                Builder::build(corners, &halves, !is_balanced)
            })
            .unwrap_or_default()
    }
}

/// A tree of two children a node.
#[derive(Debug, Default)]
struct Binary {
    nodes: Vec<BinaryNode>,
    /// Triangles in the order of the leaves.
    order: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct BinaryNode {
    bounds: Aabb,
    /// None for a leaf.
    children: Option<[usize; 2]>,
    /// Place of its first triangle in the order, and how many it has.
    first: usize,
    count: usize,
}

impl Binary {
    /// By the surface area heuristic.
    fn over(corners: &[[Vec3; 3]]) -> Binary {
        if corners.is_empty() {
            return Binary::default();
        }
        let inputs: Vec<Triangle> = corners
            .iter()
            .map(|&[v0, v1, v2]| Triangle {
                v0: v0.into(),
                v1: v1.into(),
                v2: v2.into(),
            })
            .collect();
        let parameters = BvhBuildParams {
            max_prims_per_leaf: 4,
            ..BvhBuildParams::medium_build()
        };
        let tree = build_bvh2_from_tris(&inputs, parameters, &mut Duration::default());
        Binary::flattened(&tree)
    }

    /// Depth first, so that a subtree's triangles are neighbours in the order.
    fn flattened(tree: &Bvh2) -> Binary {
        enum Step {
            Enter(usize, Option<(usize, usize)>),
            Leave(usize),
        }
        let mut binary = Binary::default();
        // Not by recursion: a tree may be as deep as it has triangles.
        let mut steps = vec![Step::Enter(0, None)];
        while let Some(step) = steps.pop() {
            match step {
                Step::Enter(index, parent) => {
                    let node = &tree.nodes[index];
                    let place = binary.nodes.len();
                    if let Some((parent, side)) = parent
                        && let Some(children) = &mut binary.nodes[parent].children
                    {
                        children[side] = place;
                    }
                    let first = node.first_index as usize;
                    let is_leaf = node.prim_count > 0;
                    binary.nodes.push(BinaryNode {
                        bounds: node.aabb,
                        children: (!is_leaf).then_some([0; 2]),
                        first: binary.order.len(),
                        count: 0,
                    });
                    steps.push(Step::Leave(place));
                    if is_leaf {
                        let triangles = first..first + node.prim_count as usize;
                        binary.order.extend(&tree.primitive_indices[triangles]);
                    } else {
                        steps.push(Step::Enter(first + 1, Some((place, 1))));
                        steps.push(Step::Enter(first, Some((place, 0))));
                    }
                }
                Step::Leave(place) => {
                    let count = binary.order.len() - binary.nodes[place].first;
                    binary.nodes[place].count = count;
                }
            }
        }
        binary
    }

    /// By halving the list of triangles, sorted along the longest axis: never deep.
    fn of_halves(corners: &[[Vec3; 3]]) -> Binary {
        let mut binary = Binary {
            nodes: Vec::new(),
            order: (0..corners.len() as u32).collect(),
        };
        binary.halve(corners, 0, corners.len());
        binary
    }

    fn halve(&mut self, corners: &[[Vec3; 3]], first: usize, count: usize) -> usize {
        let triangles = &mut self.order[first..first + count];
        let mut bounds = Aabb::empty();
        for &triangle in triangles.iter() {
            for corner in corners[triangle as usize] {
                bounds.extend(corner.into());
            }
        }
        let place = self.nodes.len();
        self.nodes.push(BinaryNode {
            bounds,
            children: None,
            first,
            count,
        });
        if count > WIDTH / 2 {
            let extent = bounds.max - bounds.min;
            let axis = (0..3)
                .max_by(|&a, &b| extent[a].total_cmp(&extent[b]))
                .unwrap_or(0);
            let key = |&triangle: &u32| -> f32 {
                corners[triangle as usize].iter().map(|c| c[axis]).sum()
            };
            let half = count / 2;
            triangles.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)));
            let low = self.halve(corners, first, half);
            let high = self.halve(corners, first + half, count - half);
            self.nodes[place].children = Some([low, high]);
        }
        place
    }
}

struct Builder<'b> {
    corners: &'b [[Vec3; 3]],
    binary: &'b Binary,
    /// Opens the nodes with the most triangles first, not those with the largest boxes.
    is_balanced: bool,
    tree: RayTree,
}

impl<'b> Builder<'b> {
    /// `None`: a tree is too deep.
    fn build(corners: &'b [[Vec3; 3]], binary: &'b Binary, is_balanced: bool) -> Option<RayTree> {
        let mut builder = Builder {
            corners,
            binary,
            is_balanced,
            tree: RayTree::default(),
        };
        builder.fill()?;
        Some(builder.tree)
    }

    fn fill(&mut self) -> Option<()> {
        let (facets, trees) = self.top();
        for group in facets.chunks(WIDTH) {
            self.push_triangles(group);
        }
        let header = [
            facets.len().div_ceil(WIDTH) as f32,
            trees.len() as f32,
            0.0,
            0.0,
        ];
        self.tree.boxes = vec![[0.0; 4]; NODE_TEXELS];
        self.tree.boxes[0] = header;
        // A tree that is none, where there are none.
        let room = (2 * trees.len().max(1)).next_multiple_of(NODE_TEXELS);
        self.tree
            .boxes
            .resize(NODE_TEXELS + room, [0.0, 0.0, 0.0, 0.0]);
        for (index, &tree) in trees.iter().enumerate() {
            let root = self.push_node(tree, 1)?;
            let [low, high] = box_texels(&self.binary.nodes[tree].bounds, root, OF_NODE);
            self.tree.boxes[NODE_TEXELS + 2 * index] = low;
            self.tree.boxes[NODE_TEXELS + 2 * index + 1] = high;
        }
        if self.tree.triangles.is_empty() {
            self.push_triangles(&[]);
        }
        Some(())
    }

    /// Triangles that stand alone, and roots of trees: the nodes with the largest boxes are opened first.
    fn top(&self) -> (Vec<u32>, Vec<usize>) {
        let nodes = &self.binary.nodes;
        if self.corners.len() <= MAX_FACETS {
            return (self.binary.order.clone(), Vec::new());
        }
        let scene_area = nodes[0].bounds.half_area();
        let (mut facets, mut trees, mut closed) = (Vec::new(), vec![0], Vec::new());
        while trees.len() + closed.len() < MAX_TREES {
            let area = |&place: &usize| nodes[place].bounds.half_area();
            let Some(largest) =
                (0..trees.len()).max_by(|&a, &b| area(&trees[a]).total_cmp(&area(&trees[b])))
            else {
                break;
            };
            let place = trees.swap_remove(largest);
            let node = &nodes[place];
            let is_large = node.bounds.half_area() > FACET_SHARE * scene_area;
            match node.children {
                Some(children) => trees.extend(children),
                None if is_large && facets.len() + node.count <= MAX_FACETS => {
                    facets.extend(&self.binary.order[node.first..node.first + node.count]);
                }
                None => closed.push(place),
            }
        }
        trees.extend(closed);
        (facets, trees)
    }

    /// Appends a node and what is below it; returns its index. `None`: too deep.
    fn push_node(&mut self, place: usize, level: usize) -> Option<u32> {
        if level > MAX_LEVELS {
            return None;
        }
        let index = self.tree.boxes.len() / NODE_TEXELS;
        self.tree
            .boxes
            .resize((index + 1) * NODE_TEXELS, [0.0; 4]);
        for (child, place) in self.children(place).into_iter().enumerate() {
            let node = self.binary.nodes[place];
            let (link, kind) = if node.count <= WIDTH {
                let triangles = &self.binary.order[node.first..node.first + node.count];
                (self.push_triangles(triangles), OF_LEAF)
            } else {
                (self.push_node(place, level + 1)?, OF_NODE)
            };
            let [low, high] = box_texels(&node.bounds, link, kind);
            self.tree.boxes[index * NODE_TEXELS + child] = low;
            self.tree.boxes[index * NODE_TEXELS + WIDTH + child] = high;
        }
        Some(index as u32)
    }

    /// Up to eight descendants that make up a node: those with the largest boxes are opened first.
    fn children(&self, place: usize) -> Vec<usize> {
        let nodes = &self.binary.nodes;
        let mut children = vec![place];
        while children.len() < WIDTH {
            let can_open = |&at: &usize| {
                let node = &nodes[children[at]];
                node.children.is_some() && node.count > WIDTH
            };
            let size = |at: usize| match &nodes[children[at]] {
                node if self.is_balanced => node.count as f32,
                node => node.bounds.half_area(),
            };
            let largest = (0..children.len())
                .filter(can_open)
                .max_by(|&a, &b| size(a).total_cmp(&size(b)));
            let Some(largest) = largest else {
                break;
            };
            let Some(opened) = nodes[children.swap_remove(largest)].children else {
                break;
            };
            children.extend(opened);
        }
        children
    }

    /// Appends a group of up to eight triangles; returns its index.
    fn push_triangles(&mut self, triangles: &[u32]) -> u32 {
        let group = self.tree.triangles.len() / (WIDTH * TRIANGLE_TEXELS);
        for &triangle in triangles {
            let texels = triangle_texels(self.corners[triangle as usize], triangle);
            self.tree.triangles.extend(texels);
        }
        let end = (group + 1) * WIDTH * TRIANGLE_TEXELS;
        self.tree.triangles.resize(end, [0.0; 4]);
        group as u32
    }
}

fn box_texels(bounds: &Aabb, link: u32, kind: f32) -> [Texel; 2] {
    let [low_x, low_y, low_z] = (bounds.min - BOX_SLACK).to_array();
    let [high_x, high_y, high_z] = (bounds.max + BOX_SLACK).to_array();
    [
        [low_x, low_y, low_z, link as f32],
        [high_x, high_y, high_z, kind],
    ]
}

fn triangle_texels(corners: [Vec3; 3], place: u32) -> [Texel; TRIANGLE_TEXELS] {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    // In f64, so that slivers have a normal that is right to rounding. One without area has none, and is never hit.
    let normal: DVec3 = (b - a).cross(c - a).normalize_or_zero();
    let normal = normal.as_vec3();
    let [a, b, c] = [0, 1, 2].map(|i| corners[i].extend(normal[i]).to_array());
    [a, b, c, [place as f32, 0.0, 0.0, 0.0]]
}
