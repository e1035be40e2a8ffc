//! Standard error pass: what the indirect radiance of each pixel is off by.

use super::Context;
use crate::{
    Result,
    vulkan::{Image, Recorder, Resource, shaders::StderrParameters},
};

/// From what the resolve pass expects, times factors for gathered and for interpolated pixels.
pub(crate) fn fill(
    recorder: &mut Recorder,
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
    context.dispatch(recorder, ("stderr", &[]), &resources, &parameters, size_px)
}
