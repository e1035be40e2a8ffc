//! Error estimate pass: how far the image is from independent gathers of some of its pixels.

use super::{Context, gbuffer::GBuffer, receivers::Receivers};
use crate::{
    Result,
    vulkan::{Buffer, Image, Recorder, Resource, shaders::ErrorEstimateParameters},
};

/// Compares the receivers of a list, `count` in all, whose results begin at the first of `results`, and those of a second gather
/// at `second_result`.
pub(crate) fn compare<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    indirect_radiance: &'r Image,
    sample: &'r Receivers,
    (results, second_result): (&'r Buffer, u32),
    (estimates, count): (&'r Buffer, u32),
) -> Result<()> {
    let mut resources = gbuffer.resources();
    resources.extend([
        ("indirect_radiance", Resource::Image(indirect_radiance)),
        ("receivers", Resource::Buffer(&sample.pixels)),
        ("results", Resource::Buffer(results)),
        ("estimates", Resource::Buffer(estimates)),
    ]);
    let parameters = ErrorEstimateParameters {
        receiver_count: count,
        second_result,
    };
    let kernel = ("error_estimate", &[context.plan.brdf_word()][..]);
    context.dispatch(recorder, kernel, &resources, &parameters, [count, 1])
}
