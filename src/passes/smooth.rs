//! Smooth pass: lowers the noise of the gathers on a grid by what the pixels around them say.

use super::{
    Context,
    gbuffer::GBuffer,
    refinement::{RefinementCriteria, RefinementImages},
};
use crate::{
    Result,
    vulkan::{Allocate, BufferUse, Device, Recorder, Resource, shaders::SmoothParameters},
};

/// A grid over the image, and room for its new values.
pub(crate) struct Smoothing<A: Allocate = Device> {
    stride_px: u32,
    columns: u32,
    item_count: u32,
    smoothed: A::Buffer,
}

impl<A: Allocate> Smoothing<A> {
    /// Of every `stride_px`-th pixel.
    pub fn new(allocate: &A, resolution_px: [u32; 2], stride_px: u32) -> Result<Smoothing<A>> {
        let [columns, rows] = resolution_px.map(|px| px.div_ceil(stride_px));
        let item_count = columns * rows;
        let bytes = u64::from(item_count) * 2 * size_of::<[f32; 4]>() as u64;
        Ok(Smoothing {
            stride_px,
            columns,
            item_count,
            smoothed: allocate.buffer("smoothed light", bytes, BufferUse::Device)?,
        })
    }
}

impl Smoothing {
    /// Replaces what was gathered on the grid.
    pub fn smooth(
        &self,
        recorder: &mut Recorder,
        context: &Context,
        gbuffer: &GBuffer,
        images: &RefinementImages,
        criteria: RefinementCriteria,
    ) -> Result<()> {
        let parameters = SmoothParameters {
            stride: self.stride_px,
            columns: self.columns,
            item_count: self.item_count,
            evenness: criteria.noise.evenness as f32,
            variance_rate: criteria.noise.rate as f32,
        };
        let mut resources = gbuffer.resources();
        resources.extend(images.resources());
        resources.push(("smoothed", Resource::Buffer(&self.smoothed)));
        for kernel in ["fit", "store"] {
            let words = [kernel, context.plan.brdf_word()];
            let size = [self.item_count, 1];
            context.dispatch(recorder, ("smooth", &words), &resources, &parameters, size)?;
        }
        Ok(())
    }
}
