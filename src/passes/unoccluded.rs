//! Unoccluded pass: the light of VPLs at every pixel, as if nothing hid them.

use std::time::Instant;

use super::{Context, cost::Work, gbuffer::GBuffer, refinement::RefinementImages};
use crate::{
    Result,
    vulkan::{
        Image, Resource,
        shaders::{Key, UnoccludedParameters},
    },
};

/// Pairs of the first submission, before the device's speed is known.
const FIRST_SUBMISSION_PAIRS: f64 = (1u64 << 26) as f64;

/// Sums over the first `vpl_count` VPLs. `proceed` is called between submissions; its error ends the pass.
pub(crate) fn fill(
    context: &Context,
    gbuffer: &GBuffer,
    images: &RefinementImages,
    (vpls, vpl_count): (&Image, u32),
    proceed: &mut dyn FnMut() -> Result<()>,
) -> Result<()> {
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.push(("vpls", Resource::Image(vpls)));
    let key = Key::Unoccluded {
        brdf: context.plan.brdf(),
    };
    let pixels = context.plan.resolution_px.iter().product();
    let mut first_pixel = 0;
    while first_pixel < pixels {
        let cost = context.cost;
        let budget = cost.borrow().budget("unoccluded", FIRST_SUBMISSION_PAIRS);
        // Whole workgroups. `as` saturates.
        let count = (budget / f64::from(vpl_count) / 64.0).max(1.0) as u32;
        let count = count.saturating_mul(64).min(pixels - first_pixel);
        let parameters = UnoccludedParameters {
            vpl_count,
            first_pixel,
        };
        let start = Instant::now();
        context.record(|recorder| {
            context.dispatch(recorder, key, &resources, &parameters, [count, 1])
        })?;
        context.finish_work(Work {
            pass: "unoccluded",
            kernel: "unoccluded",
            amount: u64::from(count) * u64::from(vpl_count),
            along: 0,
            start,
        })?;
        first_pixel += count;
        proceed()?;
    }
    Ok(())
}
