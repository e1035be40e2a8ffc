//! Scatter pass: the results of a gather go to the pixels of its receivers, with what they say of the prediction's error.

use super::{
    Context,
    gbuffer::GBuffer,
    receivers::{ReceiverRange, Receivers},
    refinement::{RefinementCriteria, RefinementImages},
};
use crate::{
    Result,
    vulkan::{Buffer, Recorder, Resource, shaders::ScatterParameters},
};

/// Takes the first results for the receivers of a range. Where there is noise and pixels may be interpolated, a gather counts as far
/// as it differs from its prediction by more than noise.
pub(crate) fn scatter<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    images: &'r RefinementImages,
    (receivers, range): (&'r Receivers, ReceiverRange),
    results: &'r Buffer,
    criteria: RefinementCriteria,
) -> Result<()> {
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.extend([
        ("receivers", Resource::Buffer(&receivers.pixels)),
        ("results", Resource::Buffer(results)),
    ]);
    let parameters = ScatterParameters {
        first_receiver: range.first,
        receiver_count: range.count,
        least_radiance: criteria.least_radiance(),
        own_share: criteria.own_share(),
        is_grid: criteria.tolerance.is_none().into(),
        variance_scale: criteria.variance_scale as f32,
    };
    let words = [context.plan.brdf_word(), images.noise_word()];
    let size = [range.count, 1];
    context.dispatch(recorder, ("scatter", &words), &resources, &parameters, size)
}
