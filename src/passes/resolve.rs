//! Resolve pass: computes the indirect radiance of every pixel from what was gathered or interpolated there.

use super::{
    Context,
    gbuffer::GBuffer,
    refinement::{RefinementCriteria, RefinementImages},
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{
        Image, Resource,
        shaders::{Key, ResolveParameters},
    },
};

pub(super) fn key(plan: &Plan, noisy: bool) -> Key {
    Key::Resolve {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
        noisy,
    }
}

/// Computes L_{P→C} of the bounce for every pixel with a surface, and its expected error; with time of flight also Z.
pub(crate) fn resolve(
    context: &Context,
    gbuffer: &GBuffer,
    images: &RefinementImages,
    indirect_radiance: &Image,
    indirect_phasors: Option<&Image>,
    criteria: RefinementCriteria,
) -> Result<()> {
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.push(("indirect_radiance", Resource::Image(indirect_radiance)));
    resources.extend(indirect_phasors.map(|image| ("indirect_phasors", Resource::Image(image))));
    let plan = context.plan;
    let key = key(plan, images.is_noisy());
    let parameters = ResolveParameters {
        evenness: criteria.noise.evenness as f32,
        variance_rate: criteria.noise.rate as f32,
        relative_noise: criteria.noise.relative as f32,
        least_radiance: criteria.least_radiance(),
        own_share: criteria.own_share(),
    };
    context.dispatch(key, &resources, &parameters, plan.resolution_px)
}
