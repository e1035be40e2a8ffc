//! Scatter pass: writes the results of a gather to the pixels of its receivers, with what they show about the prediction's error.

use super::{
    Context,
    receivers::ListedReceivers,
    refinement::{RefinementCriteria, RefinementImages},
    sample_counts::SampleCounts,
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{
        Buffer, Resource,
        shaders::{Key, ScatterParameters},
    },
};

pub(super) fn key(plan: &Plan, noisy: bool, range: bool) -> Key {
    Key::Scatter {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
        noisy,
        range,
    }
}

/// Takes the first results for the receivers. With noise, and where pixels may be interpolated, a gather changes its
/// prediction only as far as it differs from it by more than noise.
pub(crate) fn scatter(
    context: &Context,
    images: &RefinementImages,
    receivers: ListedReceivers,
    results: &Buffer,
    counts: Option<&SampleCounts>,
    criteria: RefinementCriteria,
) -> Result<()> {
    let mut resources = receivers.gbuffer.resources();
    resources.extend(images.resources());
    resources.extend([
        ("receivers", Resource::Buffer(&receivers.list.pixels)),
        ("results", Resource::Buffer(results)),
    ]);
    resources.extend(counts.map(|counts| ("sample_ranges", Resource::Buffer(&counts.ranges))));
    let parameters = ScatterParameters {
        first_receiver: receivers.range.first,
        receiver_count: receivers.range.count,
        least_radiance: criteria.least_radiance(),
        own_share: criteria.own_share(),
        evenness: criteria.noise.evenness as f32,
        variance_rate: criteria.noise.rate as f32,
    };
    let key = key(context.plan, images.is_noisy(), images.has_range());
    let size = [receivers.range.count, 1];
    context.dispatch(key, &resources, &parameters, size)
}
