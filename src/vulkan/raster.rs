//! Draws triangles into images.

use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;

use super::{
    Image,
    pipeline::Pipeline,
    recorder::{Recorder, Resource},
};
use crate::Result;

/// The images that a draw writes to.
pub(crate) struct Target<'t> {
    pub colors: &'t [&'t Image],
    /// Scratch image, without layers.
    pub depth: &'t Image,
    /// Layer of the colour images.
    pub layer: u32,
    /// Value of the pixels without a surface, for each colour image.
    pub clear: &'t [[f32; 4]],
}

impl Recorder {
    /// Clears the target and records the draws of `record` into it.
    pub fn render(
        &mut self,
        target: &Target,
        record: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        // The previous rendering may have used the same depth image.
        self.barrier();
        let size_px = target.depth.shape.size_px;
        let images = target.colors.iter().chain([&target.depth]);
        self.kept.extend(images.map(|image| image.keep()));
        let colors = target.colors.iter().zip(target.clear);
        let colors: Vec<_> = colors
            .map(|(image, &clear)| {
                cleared(image.handles().layer_views[target.layer as usize], clear)
            })
            .collect();
        // Reversed depth: 0 is infinitely far.
        let depth = cleared(target.depth.handles().view, [0.0; 4]);
        self.begin_rendering(size_px, &colors, Some(&depth));
        let viewport = vk::Viewport {
            width: size_px[0] as f32,
            height: size_px[1] as f32,
            max_depth: 1.0,
            ..vk::Viewport::default()
        };
        let raw = self.device.raw();
        // SAFETY: the command buffer is being recorded.
        unsafe {
            raw.cmd_set_viewport(self.commands, 0, &[viewport]);
            raw.cmd_set_scissor(self.commands, 0, &[area(size_px)]);
        }
        let result = record(self);
        self.end_rendering();
        result
    }

    pub(super) fn begin_rendering(
        &mut self,
        size_px: [u32; 2],
        colors: &[vk::RenderingAttachmentInfo],
        depth: Option<&vk::RenderingAttachmentInfo>,
    ) {
        let mut rendering = vk::RenderingInfo::default()
            .render_area(area(size_px))
            .layer_count(1)
            .color_attachments(colors);
        if let Some(depth) = depth {
            rendering = rendering.depth_attachment(depth);
        }
        let raw = self.device.raw();
        // SAFETY: the command buffer is being recorded and the images are kept.
        unsafe { raw.cmd_begin_rendering(self.commands, &rendering) };
    }

    pub(super) fn end_rendering(&mut self) {
        // SAFETY: rendering was begun.
        unsafe { self.device.raw().cmd_end_rendering(self.commands) };
    }

    /// Binds a raster pipeline and its resources for the following draws.
    pub fn bind_raster(
        &mut self,
        pipeline: &Arc<Pipeline>,
        resources: &[(&str, Resource)],
    ) -> Result<()> {
        self.bind(vk::PipelineBindPoint::GRAPHICS, pipeline, resources)
    }

    /// Draws triangles of the bound index buffer, three corners each, for instances. Both ranges are given as first and count.
    pub fn draw<T: Pod>(
        &mut self,
        pipeline: &Pipeline,
        immediate: &T,
        [first_triangle, triangle_count]: [u32; 2],
        [first_instance, instance_count]: [u32; 2],
    ) {
        self.push(pipeline, immediate);
        let (first, count) = (3 * first_triangle, 3 * triangle_count);
        // SAFETY: called between `bind_raster` and the end of the rendering.
        unsafe {
            self.device
                .raw()
                .cmd_draw(self.commands, count, instance_count, first, first_instance)
        };
    }
}

/// An attachment whose pixels are all cleared to one value before drawing; a depth attachment uses the first component.
pub(super) fn cleared(
    view: vk::ImageView,
    float32: [f32; 4],
) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue {
            color: vk::ClearColorValue { float32 },
        })
}

fn area([width, height]: [u32; 2]) -> vk::Rect2D {
    vk::Extent2D { width, height }.into()
}
