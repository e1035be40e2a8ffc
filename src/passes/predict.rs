//! Predict pass: interpolates the pixels between those of a grid, where interpolation is good enough.

use super::{
    Context,
    gbuffer::GBuffer,
    receivers::Receivers,
    refinement::{RefinementCriteria, RefinementImages},
};
use crate::{
    Result,
    plan::{GridStep, Plan},
    vulkan::{
        Resource,
        shaders::{
            Key, PredictParameters,
            constants::{CENTRES, EDGES},
        },
    },
};

pub(super) fn key(plan: &Plan, noisy: bool, range: bool) -> Key {
    Key::Predict {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
        noisy,
        range,
    }
}

/// Interpolates pixels of a step. The others become candidates, unless they were gathered before.
/// Does nothing for the coarsest grid, which has no neighbours to predict from.
pub(crate) fn predict(
    context: &Context,
    gbuffer: &GBuffer,
    images: &RefinementImages,
    receivers: &Receivers,
    step: GridStep,
    criteria: RefinementCriteria,
) -> Result<()> {
    let (pattern, reach) = match step {
        GridStep::Base { .. } => return Ok(()),
        GridStep::Centres { reach } => (CENTRES, reach),
        GridStep::Edges { reach } => (EDGES, reach),
    };
    let plan = context.plan;
    let key = key(plan, images.is_noisy(), images.has_range());
    let [columns, rows] = step.extent(plan.resolution_px);
    let parameters = PredictParameters {
        reach,
        pattern,
        columns,
        item_count: columns * rows,
        tolerance: criteria.tolerance.unwrap_or(-1.0).min(f32::MAX.into()) as f32,
        least_radiance: criteria.least_radiance(),
        own_share: criteria.own_share(),
    };
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.push(("candidates", Resource::Buffer(&receivers.candidates)));
    let size = [columns * rows, 1];
    context.dispatch(key, &resources, &parameters, size)
}
