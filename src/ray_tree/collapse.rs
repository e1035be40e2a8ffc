//! Makes a wide tree from a binary one, and fits its boxes again to triangles that have moved. All threads take part.

use glam::Vec3A;

use super::Texel;
use super::lanes::LANES;
use super::wide::{LEAF, Leaf, Node, WideNodes, WideTree};
use crate::parallel::for_each;

/// Items below a node whose part of the tree one thread makes.
const ITEMS_OF_PART: usize = 1 << 13;
/// Leaves that a thread fills at a time.
const LEAVES_AT_ONCE: usize = 1 << 10;

/// A binary tree that a wide one is made from.
pub(super) trait Binary: Sync {
    /// The children of a node, or the item of a leaf.
    fn children(&self, node: usize) -> Result<[usize; 2], u32>;
    fn bounds(&self, node: usize) -> [Vec3A; 2];
    /// Items below a node; 0 for the first node of a tree without nodes.
    fn count(&self, node: usize) -> usize;
}

/// What becomes of a binary tree.
struct Collapse<'b, B> {
    binary: &'b B,
    /// Most items of a leaf.
    max_items: usize,
    /// How much larger boxes are than their content.
    slack: f32,
}

/// The nodes below a node of the binary tree, and the nodes of that tree that become leaves.
#[derive(Default)]
struct Part {
    nodes: Vec<Node>,
    leaves: Vec<usize>,
    /// What is left out: the children of these nodes, and their nodes in the binary tree.
    cut: Vec<(usize, usize, usize)>,
}

impl<'b, B: Binary> Collapse<'b, B> {
    fn new(binary: &'b B, max_items: usize, slack: f32) -> Self {
        Collapse {
            binary,
            max_items,
            slack,
        }
    }

    /// The nodes from a root on, without those that have up to `min_items` items.
    fn part(&self, root: usize, min_items: usize) -> Part {
        let binary = self.binary;
        let mut part = Part {
            nodes: vec![Node::EMPTY],
            ..Part::default()
        };
        let mut open = Vec::new();
        if binary.count(root) > 0 {
            open.push((0, root));
        }
        while let Some((own, node)) = open.pop() {
            let mut children = vec![node];
            // Divides the child with the largest surface until the node is full.
            while children.len() < LANES {
                let inner = children.iter().enumerate();
                let inner = inner.filter(|&(_, &child)| binary.count(child) > self.max_items);
                let areas = inner.map(|(place, &child)| (place, half_area(binary.bounds(child))));
                let Some((place, _)) = areas.max_by(|(_, a), (_, b)| a.total_cmp(b)) else {
                    break;
                };
                let Ok(parts) = binary.children(children[place]) else {
                    break;
                };
                children.swap_remove(place);
                children.extend(parts);
            }
            for (lane, &child) in children.iter().enumerate() {
                let count = binary.count(child);
                let word = if count <= self.max_items {
                    part.leaves.push(child);
                    LEAF | (part.leaves.len() as u32 - 1)
                } else if count <= min_items {
                    part.cut.push((own, lane, child));
                    0
                } else {
                    part.nodes.push(Node::EMPTY);
                    open.push((part.nodes.len() - 1, child));
                    part.nodes.len() as u32 - 1
                };
                let [low, high] = binary.bounds(child);
                part.nodes[own].set_box(lane, [low - self.slack, high + self.slack]);
                part.nodes[own].children[lane] = word;
            }
        }
        part
    }

    /// All nodes. A node comes before those below it.
    fn all(&self) -> Part {
        // A small tree is one part: it takes less time than starting threads.
        let is_small = self.binary.count(0) <= ITEMS_OF_PART;
        let mut all = self.part(0, if is_small { 0 } else { ITEMS_OF_PART });
        let cut = std::mem::take(&mut all.cut);
        let mut parts: Vec<Part> = cut.iter().map(|_| Part::default()).collect();
        for_each(parts.iter_mut().zip(&cut), |(part, &(.., root))| {
            *part = self.part(root, 0);
        });
        all.nodes
            .reserve(parts.iter().map(|part| part.nodes.len()).sum());
        for ((own, lane, _), mut part) in cut.into_iter().zip(parts) {
            let [node, leaf] = [all.nodes.len(), all.leaves.len()].map(|first| first as u32);
            all.nodes[own].children[lane] = node;
            for child in part.nodes.iter_mut().flat_map(|node| &mut node.children) {
                *child += match *child {
                    0 => 0,
                    child if child & LEAF != 0 => leaf,
                    _ => node,
                };
            }
            all.nodes.append(&mut part.nodes);
            all.leaves.append(&mut part.leaves);
        }
        all
    }
}

impl WideNodes {
    /// Collapses a binary tree into one whose leaves are its items.
    pub(super) fn over(binary: &impl Binary, slack: f32) -> WideNodes {
        let Part {
            mut nodes, leaves, ..
        } = Collapse::new(binary, 1, slack).all();
        for child in nodes.iter_mut().flat_map(|node| &mut node.children) {
            if *child & LEAF != 0 {
                let leaf = leaves[(*child & !LEAF) as usize];
                *child = LEAF | binary.children(leaf).err().unwrap_or_default();
            }
        }
        WideNodes { nodes }
    }
}

impl WideTree {
    /// A tree over triangles, which are the items of a binary tree. `slack`: how much larger boxes are than their content.
    pub(super) fn over(binary: &impl Binary, triangles: &[Texel], slack: f32) -> WideTree {
        let Part { nodes, leaves, .. } = Collapse::new(binary, LANES, slack).all();
        let mut filled: Vec<Leaf> = bytemuck::zeroed_vec(leaves.len());
        let parts = leaves
            .chunks(LEAVES_AT_ONCE)
            .zip(filled.chunks_mut(LEAVES_AT_ONCE));
        for_each(parts, |(roots, leaves)| {
            for (leaf, &root) in leaves.iter_mut().zip(roots) {
                leaf.fill(&items_below(binary, root), triangles);
            }
        });
        WideTree {
            nodes: WideNodes { nodes },
            leaves: filled,
        }
    }

    /// Moves the triangles, and fits the boxes to them.
    pub(super) fn refit(&mut self, triangles: &[Texel], slack: f32) {
        let mut boxes: Vec<[Vec3A; 2]> = vec![Default::default(); self.leaves.len()];
        let parts = self.leaves.chunks_mut(LEAVES_AT_ONCE);
        for_each(
            parts.zip(boxes.chunks_mut(LEAVES_AT_ONCE)),
            |(leaves, boxes)| {
                for (leaf, bounds) in leaves.iter_mut().zip(boxes) {
                    let items = leaf.items;
                    leaf.fill(&items[..leaf.count], triangles);
                    let [low, high] = leaf.whole_box();
                    *bounds = [low - slack, high + slack];
                }
            },
        );
        let nodes = &mut self.nodes.nodes;
        for own in (0..nodes.len()).rev() {
            for lane in 0..LANES {
                let bounds = match nodes[own].children[lane] {
                    0 => continue,
                    child if child & LEAF != 0 => boxes[(child & !LEAF) as usize],
                    child => nodes[child as usize].whole_box(),
                };
                nodes[own].set_box(lane, bounds);
            }
        }
    }
}

fn half_area([low, high]: [Vec3A; 2]) -> f32 {
    let extent = high - low;
    extent.dot(Vec3A::new(extent.y, extent.z, extent.x))
}

/// In order, so that the tree does not depend on how the binary one was built.
fn items_below(binary: &impl Binary, node: usize) -> Vec<u32> {
    let mut items = Vec::new();
    let mut open = vec![node];
    while let Some(node) = open.pop() {
        match binary.children(node) {
            Ok(children) => open.extend(children),
            Err(item) => items.push(item),
        }
    }
    items.sort_unstable();
    items
}
