//! Smooth pass: the noise of the gathers on a lattice is lowered by what the pixels around them say.

use super::{
    Context,
    gbuffer::GBuffer,
    predict::{BounceImages, Judgement},
};
use crate::{
    Result,
    vulkan::{Buffer, BufferUse, Recorder, Resource, groups_in_rows, shaders::SmoothParameters},
};

/// A lattice over the image, and room for its new values.
pub(crate) struct Smoothing {
    stride_px: u32,
    columns: u32,
    item_count: u32,
    smoothed: Buffer,
}

impl Smoothing {
    /// Of every `stride_px`-th pixel.
    pub fn new(context: &Context, stride_px: u32) -> Result<Smoothing> {
        let [columns, rows] = context.plan.resolution_px.map(|px| px.div_ceil(stride_px));
        let item_count = columns * rows;
        let bytes = u64::from(item_count) * 2 * size_of::<[f32; 4]>() as u64;
        Ok(Smoothing {
            stride_px,
            columns,
            item_count,
            smoothed: Buffer::new(context.device, "smoothed light", bytes, BufferUse::Device)?,
        })
    }

    /// Replaces what was gathered on the lattice.
    pub fn smooth<'r>(
        &'r self,
        recorder: &mut Recorder<'r>,
        context: &Context,
        gbuffer: &'r GBuffer,
        images: &'r BounceImages,
        judgement: Judgement,
    ) -> Result<()> {
        let parameters = SmoothParameters {
            stride: self.stride_px,
            columns: self.columns,
            item_count: self.item_count,
            variance_of_spread: judgement.variance_of_spread as f32,
        };
        let mut resources = gbuffer.resources();
        resources.extend(images.resources());
        resources.push(("smoothed", Resource::Buffer(&self.smoothed)));
        recorder.pass("smooth", |recorder| {
            for kernel in ["fit", "put"] {
                let pipeline = context
                    .pipelines
                    .compute("smooth", &[kernel, context.plan.brdf_word()])?;
                let groups = self.item_count.div_ceil(pipeline.module.workgroup_size[0]);
                recorder.barrier();
                recorder.dispatch(&pipeline, &resources, &parameters, groups_in_rows(groups))?;
            }
            Ok(())
        })
    }
}
