//! The scene's triangles on the device for rays.

use crate::{
    Plan, Result, Scene,
    local_space::LocalSpace,
    ray_tree::{RayTree, Texel},
    vulkan::{Buffer, Device, Image, ImageShape, Recorder, Resource},
};

/// Texels of a row, as `shaders/trace.wgsl` has it.
const ROW_TEXELS: usize = 1024;

/// A list of texels in an image, row by row.
pub(crate) struct TexelList {
    image: Image,
    texels: Buffer,
}

impl TexelList {
    pub fn new(device: &Device, what: &str, mut texels: Vec<Texel>) -> Result<TexelList> {
        texels.resize(texels.len().max(1).next_multiple_of(ROW_TEXELS), [0.0; 4]);
        let size_px = [ROW_TEXELS as u32, (texels.len() / ROW_TEXELS) as u32];
        Ok(TexelList {
            image: Image::new(device, what, ImageShape::plain(size_px))?,
            texels: Buffer::upload(device, what, &texels)?,
        })
    }

    /// Fills the image; once, before anything reads it.
    pub fn record_copy<'r>(&'r self, recorder: &mut Recorder<'r>) {
        recorder.copy_to_image(&self.texels, &self.image);
    }

    pub fn resource(&self) -> Resource<'_> {
        Resource::Image(&self.image)
    }
}

/// What `shaders/trace.wgsl` finds a scene's triangles in.
pub(crate) struct RayTreeImages {
    boxes: TexelList,
    triangles: TexelList,
    has_tree: bool,
}

impl RayTreeImages {
    /// `None` where nothing casts rays.
    pub fn for_plan(
        device: &Device,
        scene: &Scene,
        plan: &Plan,
        space: &LocalSpace,
    ) -> Result<Option<RayTreeImages>> {
        plan.has_rays()
            .then(|| RayTreeImages::of(device, scene, space))
            .transpose()
    }

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
