//! Error estimate pass: compares the image with independent gathers of some of its pixels.

use super::{
    Context, gbuffer::GBuffer, receivers::Receivers, refinement::RefinementImages,
    sample_counts::SampleCounts,
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{
        Buffer, Image, Recorder, Resource,
        shaders::{ErrorEstimateParameters, Key},
    },
};

/// Vectors of estimates per receiver, without phasors.
pub(crate) const ESTIMATE_VECTORS: usize = 3;

/// The image to compare.
#[derive(Clone, Copy)]
pub(crate) struct Compared<'i> {
    pub indirect_radiance: &'i Image,
    pub indirect_phasors: Option<&'i Image>,
    /// Only if the target is an error of range.
    pub direct_phasors: Option<&'i Image>,
    /// There is no image yet: its errors mean nothing.
    pub is_pilot: bool,
}

pub(super) fn key(plan: &Plan, (noisy, range): (bool, bool)) -> Key {
    Key::ErrorEstimate {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
        noisy,
        range,
    }
}

/// Compares the image at `count` receivers with two gathers. The first gather's results begin at the start of `results`,
/// those of the second at `second_result`. Each receiver has [`ESTIMATE_VECTORS`] of `estimates`;
/// with phasors, one more for each frequency that there can be.
pub(crate) fn compare(
    recorder: &mut Recorder,
    context: &Context,
    gbuffer: &GBuffer,
    image: Compared,
    (images, sample, counts): (&RefinementImages, &Receivers, Option<&SampleCounts>),
    (results, second_result): (&Buffer, u32),
    (estimates, count): (&Buffer, u32),
) -> Result<()> {
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.extend([
        (
            "indirect_radiance",
            Resource::Image(image.indirect_radiance),
        ),
        ("receivers", Resource::Buffer(&sample.pixels)),
        ("results", Resource::Buffer(results)),
        ("estimates", Resource::Buffer(estimates)),
    ]);
    let phasors = [
        ("indirect_phasors", image.indirect_phasors),
        ("direct_phasors", image.direct_phasors),
    ];
    let phasors = phasors.into_iter();
    resources.extend(phasors.filter_map(|(name, image)| Some((name, Resource::Image(image?)))));
    resources.extend(counts.map(|counts| ("sample_ranges", Resource::Buffer(&counts.ranges))));
    let parameters = ErrorEstimateParameters {
        receiver_count: count,
        second_result,
        is_pilot: image.is_pilot.into(),
    };
    let key = key(context.plan, (counts.is_some(), images.has_range()));
    context.dispatch(recorder, key, &resources, &parameters, [count, 1])
}
