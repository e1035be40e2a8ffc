//! Resolve pass: indirect radiance of every pixel from what was gathered or interpolated there.

use super::{Context, gbuffer::GBuffer, refinement::RefinementImages};
use crate::{
    Result,
    vulkan::{Image, Recorder, Resource},
};

/// L_{P→C} by the bounce, for every pixel with a surface.
pub(crate) fn resolve<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    images: &'r RefinementImages,
    indirect_radiance: &'r Image,
) -> Result<()> {
    let pipeline = context
        .pipelines
        .compute("resolve", &[context.plan.brdf_word()])?;
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.push(("indirect_radiance", Resource::Image(indirect_radiance)));
    let [width, height] = context.plan.resolution_px;
    let [x, y, _] = pipeline.module.workgroup_size;
    let groups = [width.div_ceil(x), height.div_ceil(y), 1];
    recorder.pass("resolve", |recorder| {
        recorder.dispatch::<[u32; 0]>(&pipeline, &resources, &[], groups)
    })
}
