//! The scene's triangles on the device for rays.

use crate::{
    RayKernel, Result, Scene,
    local_space::LocalSpace,
    ray_tree::{RayTree, all_triangle_texels, corners_of, max_box_texels, max_triangle_texels},
    vulkan::{AccelerationStructure, Allocate, BufferUse, CommandPool, Resource, TexelList},
};

/// Iterations of its loops in which a packet goes through a tree, for each halving of its nodes: about seven times what knot takes, by an
/// estimate from the boxes that its rays test.
const TREE_ITERATIONS: f64 = 240.0;
/// The same of the smallest trees, for each node: a lane takes its eight rays two at a time.
const NODE_ITERATIONS: f64 = 5.0;

/// What an acceleration structure takes for a triangle, about, and as much again while it is built.
const STRUCTURE_BYTES: u64 = 128;

/// What `shaders/trace.wgsl` finds a scene's triangles in.
pub(crate) struct RayTriangles {
    triangles: TexelList,
    triangle_count: u32,
    found_by: Finder,
}

/// What leads rays to triangles.
enum Finder {
    Tree {
        boxes: TexelList,
        node_count: u32,
        group_count: u32,
    },
    Device(Box<AccelerationStructure>),
}

/// What the triangles of a scene take.
pub(crate) fn declare(allocate: &impl Allocate, scene: &Scene, kernel: RayKernel) -> Result<()> {
    let triangles = scene.triangle_count();
    if kernel == RayKernel::Query {
        let what = "acceleration structure";
        allocate.buffer(what, triangles * STRUCTURE_BYTES, BufferUse::Device)?;
        allocate.buffer(what, triangles * STRUCTURE_BYTES, BufferUse::Staging)?;
        let texels = max_triangle_texels(triangles);
        return TexelList::declare(allocate, "triangles for rays", texels);
    }
    TexelList::declare(
        allocate,
        "triangles for rays",
        max_triangle_texels(triangles),
    )?;
    TexelList::declare(allocate, "boxes for rays", max_box_texels(triangles))
}

impl RayTriangles {
    pub fn of(
        commands: &CommandPool,
        scene: &Scene,
        space: &LocalSpace,
        kernel: RayKernel,
    ) -> Result<RayTriangles> {
        let corners = corners_of(scene, space);
        let list = |texels| TexelList::new(commands, "triangles for rays", texels);
        if kernel == RayKernel::Query {
            let corners_of_each: Vec<_> = corners
                .iter()
                .map(|corners| corners.map(|corner| corner.to_array()))
                .collect();
            return Ok(RayTriangles {
                triangles: list(all_triangle_texels(&corners))?,
                triangle_count: corners.len() as u32,
                found_by: Finder::Device(Box::new(AccelerationStructure::over(
                    commands,
                    &corners_of_each,
                )?)),
            });
        }
        let tree = RayTree::over(&corners);
        Ok(RayTriangles {
            triangle_count: corners.len() as u32,
            found_by: Finder::Tree {
                node_count: tree.node_count(),
                group_count: tree.group_count(),
                boxes: TexelList::new(commands, "boxes for rays", tree.boxes)?,
            },
            triangles: list(tree.triangles)?,
        })
    }

    /// The word of the kernels that go through these.
    pub fn kernel_word(&self) -> &'static str {
        match self.found_by {
            Finder::Tree {
                node_count: 1.., ..
            } => "tree",
            _ => "",
        }
    }

    /// Iterations of the loops in which eight rays a lane are traced. No bound, but what they are expected to stay far below.
    pub fn loop_iterations(&self, kernel: RayKernel) -> f64 {
        let (groups, nodes) = match self.found_by {
            Finder::Tree {
                group_count,
                node_count,
                ..
            } => (f64::from(group_count), f64::from(node_count)),
            Finder::Device(_) => (0.0, 2.0 * f64::from(self.triangle_count)),
        };
        let in_tree = (TREE_ITERATIONS * (nodes + 1.0).log2()).min(NODE_ITERATIONS * nodes);
        in_tree
            + match kernel {
                RayKernel::Packet => groups,
                RayKernel::Single | RayKernel::Query => 8.0 * groups,
            }
    }

    /// Under the names that the shaders give them.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 2] {
        [
            ("ray_triangles", self.triangles.resource()),
            match &self.found_by {
                Finder::Tree { boxes, .. } => ("ray_boxes", boxes.resource()),
                Finder::Device(structure) => {
                    ("ray_scene", Resource::AccelerationStructure(structure))
                }
            },
        ]
    }
}
