//! Unoccluded pass: the light of VPLs at every pixel, as if nothing hid them.

use super::{Context, cost::WorkKind, gbuffer::GBuffer, refinement::RefinementImages};
use crate::{
    Result,
    vulkan::{
        Image, Resource,
        shaders::{Key, UnoccludedParameters},
    },
};

/// Pairs of a pixel and a VPL.
const PAIRS: WorkKind = WorkKind {
    pass: "unoccluded",
    kernel: "unoccluded",
    done_by: &["unoccluded"],
    first: (1u64 << 26) as f64,
};

/// Sums over the first `vpl_count` VPLs. `proceed` is called between submissions; its error ends the pass.
pub(crate) fn fill(
    context: &Context,
    gbuffer: &GBuffer,
    images: &RefinementImages,
    vpls: &Image,
    vpl_count: u32,
    proceed: &mut dyn FnMut() -> Result<()>,
) -> Result<()> {
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.push(("vpls", Resource::Image(vpls)));
    let key = Key::Unoccluded {
        brdf: context.plan.brdf(),
    };
    let pixels = context.plan.resolution_px.iter().product();
    context.begin_work(PAIRS)?;
    let mut first_pixel = 0;
    while first_pixel < pixels {
        let room = context.room_for(PAIRS);
        // Whole workgroups. `as` saturates.
        let count = (room / f64::from(vpl_count) / 64.0).max(1.0) as u32;
        let count = count.saturating_mul(64).min(pixels - first_pixel);
        let parameters = UnoccludedParameters {
            vpl_count,
            first_pixel,
        };
        context.dispatch(key, &resources, &parameters, [count, 1])?;
        let pairs = u64::from(count) * u64::from(vpl_count);
        context.add_work(PAIRS, pairs, 0)?;
        first_pixel += count;
        proceed()?;
    }
    Ok(())
}
