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
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.push(("indirect_radiance", Resource::Image(indirect_radiance)));
    let plan = context.plan;
    let kernel = ("resolve", &[plan.brdf_word()][..]);
    context.dispatch::<[u32; 0]>(recorder, kernel, &resources, &[], plan.resolution_px)
}
