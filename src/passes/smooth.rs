//! Smooth pass: models the gathers on a grid by the pixels around them.

use super::{
    Context,
    gbuffer::GBuffer,
    refinement::{RefinementCriteria, RefinementImages},
};
use crate::{
    Result,
    plan::Plan,
    vulkan::shaders::{Key, SmoothParameters},
};

pub(super) fn key(plan: &Plan) -> Key {
    Key::Smooth {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
    }
}

/// Models what was gathered at every `stride_px`-th pixel of each row and column. With `by_ratio`, the model is of the light over that of
/// VPLs without occlusion.
pub(crate) fn smooth(
    context: &Context,
    gbuffer: &GBuffer,
    images: &RefinementImages,
    stride_px: u32,
    by_ratio: bool,
    criteria: RefinementCriteria,
) -> Result<()> {
    let [columns, rows] = context.plan.resolution_px.map(|px| px.div_ceil(stride_px));
    let parameters = SmoothParameters {
        stride: stride_px,
        columns,
        item_count: columns * rows,
        evenness: criteria.noise.evenness as f32,
        variance_rate: criteria.noise.rate as f32,
        by_ratio: by_ratio.into(),
    };
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    let key = key(context.plan);
    let size = [parameters.item_count, 1];
    context.dispatch(key, &resources, &parameters, size)
}
