//! The scene's triangles on the device for rays.

use crate::{
    Plan, Result, Scene,
    bvh::Bvh,
    local_space::LocalSpace,
    vulkan::{Buffer, Device, Resource},
};

/// The tree of boxes and its triangles.
pub(crate) struct RayTriangles {
    nodes: Buffer,
    triangles: Buffer,
    pub node_count: u32,
}

impl RayTriangles {
    /// Builds the tree; `None` where nothing casts rays.
    pub fn for_plan(
        device: &Device,
        scene: &Scene,
        plan: &Plan,
        space: &LocalSpace,
    ) -> Result<Option<RayTriangles>> {
        if !plan.has_rays() {
            return Ok(None);
        }
        let bvh = Bvh::of(scene, space);
        Ok(Some(RayTriangles {
            nodes: Buffer::upload(device, "tree of boxes", &bvh.nodes)?,
            triangles: Buffer::upload(device, "triangles for rays", &bvh.triangles)?,
            node_count: bvh.nodes.len() as u32,
        }))
    }

    /// The buffers under the names that the shaders give them.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 2] {
        [
            ("nodes", Resource::Buffer(&self.nodes)),
            ("ray_triangles", Resource::Buffer(&self.triangles)),
        ]
    }
}
