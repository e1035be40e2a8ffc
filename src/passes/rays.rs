//! The scene's triangles on the device for rays.

use crate::{
    Result, Scene,
    local_space::LocalSpace,
    ray_tree::{RayTree, max_box_texels, max_triangle_texels},
    vulkan::{Allocate, Device, Recorder, Resource, TexelList},
};

/// What `shaders/trace.wgsl` finds a scene's triangles in.
pub(crate) struct RayTreeImages {
    boxes: TexelList,
    triangles: TexelList,
    has_tree: bool,
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
    pub fn of(device: &Device, scene: &Scene, space: &LocalSpace) -> Result<RayTreeImages> {
        let tree = RayTree::of(scene, space);
        Ok(RayTreeImages {
            has_tree: tree.node_count() > 0,
            boxes: TexelList::new(device, "boxes for rays", tree.boxes)?,
            triangles: TexelList::new(device, "triangles for rays", tree.triangles)?,
        })
    }

    /// The word of the kernels that go through these.
    pub fn kernel_word(&self) -> &'static str {
        if self.has_tree { "tree" } else { "" }
    }

    /// Fills the images; once, before anything reads them.
    pub fn record_copy<'r>(&'r self, recorder: &mut Recorder<'r>) {
        self.boxes.record_copy(recorder);
        self.triangles.record_copy(recorder);
    }

    /// The images under the names that the shaders give them.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 2] {
        [
            ("ray_boxes", self.boxes.resource()),
            ("ray_triangles", self.triangles.resource()),
        ]
    }
}
