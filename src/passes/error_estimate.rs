//! Error estimate pass: compares the image with independent gathers of some of its pixels.

use super::{
    Context, gbuffer::GBuffer, receivers::Receivers, refinement::RefinementImages,
    sample_counts::SampleCounts,
};
use crate::{
    Result,
    plan::Plan,
    scene::MAX_FREQUENCIES,
    vulkan::{
        Buffer, BufferUse, Image, Resource,
        shaders::{ErrorEstimateParameters, Key},
    },
};

/// Vectors of estimates per receiver, without phasors.
pub(crate) const ESTIMATE_VECTORS: usize = 3;

/// The image, and what it is compared with.
pub(crate) struct Comparison<'c> {
    pub gbuffer: &'c GBuffer,
    pub images: &'c RefinementImages,
    pub indirect_radiance: &'c Image,
    pub indirect_phasors: Option<&'c Image>,
    /// Only if the target is an error of range.
    pub direct_phasors: Option<&'c Image>,
    /// There is no image yet: its errors mean nothing.
    pub is_pilot: bool,
    pub receivers: &'c Receivers,
    pub receiver_count: u32,
    /// Only if gathers have noise. There are results of two gathers then, one after the other.
    pub counts: Option<&'c SampleCounts>,
    pub results: &'c Buffer,
}

pub(super) fn key(plan: &Plan, noisy: bool, range: bool) -> Key {
    Key::ErrorEstimate {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
        noisy,
        range,
    }
}

/// Vectors that the pass writes for a receiver: [`ESTIMATE_VECTORS`]; with phasors, one more for each frequency that there can be.
pub(crate) fn vectors_of_receiver(plan: &Plan) -> usize {
    match plan.bounced_tof() {
        None => ESTIMATE_VECTORS,
        Some(_) => ESTIMATE_VECTORS + MAX_FREQUENCIES,
    }
}

/// Records the comparison of the image with gathers at some receivers. The host can read the estimates after the submission.
pub(crate) fn compare(context: &Context, comparison: Comparison) -> Result<Buffer> {
    let Comparison {
        images,
        counts,
        receiver_count,
        ..
    } = comparison;
    let vectors = receiver_count as usize * vectors_of_receiver(context.plan);
    let bytes = (vectors * size_of::<[f32; 4]>()) as u64;
    let usage = BufferUse::Readback;
    let estimates = Buffer::new(context.device, "error estimates", bytes, usage)?;
    let indirect_radiance = Resource::Image(comparison.indirect_radiance);
    let mut resources = comparison.gbuffer.resources();
    resources.extend(images.resources());
    resources.extend([
        ("indirect_radiance", indirect_radiance),
        ("receivers", Resource::Buffer(&comparison.receivers.pixels)),
        ("results", Resource::Buffer(comparison.results)),
        ("estimates", Resource::Buffer(&estimates)),
    ]);
    let phasors = [
        ("indirect_phasors", comparison.indirect_phasors),
        ("direct_phasors", comparison.direct_phasors),
    ];
    let phasors = phasors.into_iter();
    resources.extend(phasors.filter_map(|(name, image)| Some((name, Resource::Image(image?)))));
    resources.extend(counts.map(|counts| ("sample_ranges", Resource::Buffer(&counts.ranges))));
    let parameters = ErrorEstimateParameters {
        receiver_count,
        second_result: counts.map_or(0, |_| receiver_count),
        is_pilot: comparison.is_pilot.into(),
    };
    let key = key(context.plan, counts.is_some(), images.has_range());
    let size = [receiver_count, 1];
    context.dispatch(key, &resources, &parameters, size)?;
    Ok(estimates)
}
