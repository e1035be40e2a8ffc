//! The scene's triangles on the device for rays.

use crate::{
    RayKernel, Result, Scene,
    local_space::LocalSpace,
    ray_tree::{RayTree, max_box_texels, max_triangle_texels},
    vulkan::{Allocate, CommandPool, Resource, TexelList},
};

/// Iterations of its loops in which a packet goes through a tree, for each halving of its nodes: about seven times what knot takes, by an
/// estimate from the boxes that its rays test.
const TREE_ITERATIONS: f64 = 240.0;
/// The same of the smallest trees, for each node: a lane takes its eight rays two at a time.
const NODE_ITERATIONS: f64 = 5.0;

/// What `shaders/trace.wgsl` finds a scene's triangles in.
pub(crate) struct RayTreeImages {
    boxes: TexelList,
    triangles: TexelList,
    node_count: u32,
    group_count: u32,
}

/// What the triangles of a scene take.
pub(crate) fn declare(allocate: &impl Allocate, scene: &Scene) -> Result<()> {
    let triangles = scene.triangle_count();
    TexelList::declare(
        allocate,
        "triangles for rays",
        max_triangle_texels(triangles),
    )?;
    TexelList::declare(allocate, "boxes for rays", max_box_texels(triangles))
}

impl RayTreeImages {
    pub fn of(commands: &CommandPool, scene: &Scene, space: &LocalSpace) -> Result<RayTreeImages> {
        let tree = RayTree::of(scene, space);
        Ok(RayTreeImages {
            node_count: tree.node_count(),
            group_count: tree.group_count(),
            boxes: TexelList::new(commands, "boxes for rays", tree.boxes)?,
            triangles: TexelList::new(commands, "triangles for rays", tree.triangles)?,
        })
    }

    /// The word of the kernels that go through these.
    pub fn kernel_word(&self) -> &'static str {
        if self.node_count > 0 { "tree" } else { "" }
    }

    /// Iterations of the loops in which eight rays a lane are traced. No bound, but what they are expected to stay far below.
    pub fn loop_iterations(&self, kernel: RayKernel) -> f64 {
        let groups = f64::from(self.group_count);
        let nodes = f64::from(self.node_count);
        let in_tree = (TREE_ITERATIONS * (nodes + 1.0).log2()).min(NODE_ITERATIONS * nodes);
        in_tree
            + match kernel {
                RayKernel::Packet => groups,
                RayKernel::Single => 8.0 * groups,
            }
    }

    /// The images under the names that the shaders give them.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 2] {
        [
            ("ray_boxes", self.boxes.resource()),
            ("ray_triangles", self.triangles.resource()),
        ]
    }
}
