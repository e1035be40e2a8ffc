//! Range weights pass: what errors of Z are worth in each pixel, because of the errors of range that they make.

use super::{Context, refinement::RefinementImages};
use crate::{
    Result,
    scene::MAX_FREQUENCIES,
    vulkan::{
        Image, Resource,
        shaders::{Key, RangeWeightParameters},
    },
};

/// Fills the weights. `least_squares` is the least |Z|² of a pixel that counts, of each frequency. Without `indirect_phasors` there is no
/// image yet.
pub(crate) fn fill(
    context: &Context,
    images: &RefinementImages,
    direct_phasors: &Image,
    indirect_phasors: Option<&Image>,
    least_squares: [f32; MAX_FREQUENCIES],
) -> Result<()> {
    let mut resources = images.resources();
    resources.extend([
        ("direct_phasors", Resource::Image(direct_phasors)),
        (
            "indirect_phasors",
            Resource::Image(indirect_phasors.unwrap_or(direct_phasors)),
        ),
    ]);
    let parameters = RangeWeightParameters {
        least_squares,
        has_bounce: indirect_phasors.is_some().into(),
        ..Default::default()
    };
    let key = Key::RangeWeights {};
    let size = context.plan.resolution_px;
    context.dispatch(key, &resources, &parameters, size)
}
