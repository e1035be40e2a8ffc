//! Standard error pass: computes the standard error of each pixel's indirect radiance.

use super::Context;
use crate::{
    Result,
    vulkan::{
        Image, Resource,
        shaders::{Key, StderrParameters},
    },
};

/// Multiplies the error that the resolve pass expects by a factor for gathered pixels and one for interpolated pixels.
pub(crate) fn fill(
    context: &Context,
    indirect_radiance: &Image,
    stderr: &Image,
    [gathered_factor, interpolated_factor]: [f64; 2],
) -> Result<()> {
    let resources = [
        ("indirect_radiance", Resource::Image(indirect_radiance)),
        ("stderr_radiance", Resource::Image(stderr)),
    ];
    let parameters = StderrParameters {
        gathered_factor: gathered_factor as f32,
        interpolated_factor: interpolated_factor as f32,
    };
    let size_px = context.plan.resolution_px;
    context.dispatch(Key::Stderr {}, &resources, &parameters, size_px)
}
