//! Smooth-residuals pass: lowers the noise of the gathers on a grid by their models, and removes the bias of these.

use super::{Context, gbuffer::GBuffer, refinement::RefinementImages};
use crate::{
    Result,
    plan::Plan,
    vulkan::shaders::{Key, SmoothResidualsParameters},
};

pub(super) fn key(plan: &Plan) -> Key {
    Key::SmoothResiduals {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
    }
}

/// Replaces what was gathered at every `stride_px`-th pixel of each row and column that has a model.
pub(crate) fn smooth(
    context: &Context,
    gbuffer: &GBuffer,
    images: &RefinementImages,
    stride_px: u32,
) -> Result<()> {
    let [columns, rows] = context.plan.resolution_px.map(|px| px.div_ceil(stride_px));
    let parameters = SmoothResidualsParameters {
        stride: stride_px,
        columns,
        item_count: columns * rows,
    };
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    let key = key(context.plan);
    let size = [parameters.item_count, 1];
    context.dispatch(key, &resources, &parameters, size)
}
