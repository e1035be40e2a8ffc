//! Settle pass: the gathered bounce of receivers goes to their pixels, with what it says of the prediction's error.

use super::{Context, gbuffer::GBuffer, predict::BounceImages};
use crate::{
    Result,
    vulkan::{Buffer, Recorder, Resource, shaders::SettleParameters},
};

/// Takes the first `count` results for the receivers from `first` on.
pub(crate) fn settle<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    images: &'r BounceImages,
    receivers: &'r Buffer,
    results: &'r Buffer,
    (first, count): (u32, u32),
) -> Result<()> {
    let pipeline = context
        .pipelines
        .compute("settle", &[context.plan.brdf_word()])?;
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.extend([
        ("receivers", Resource::Buffer(receivers)),
        ("bounced", Resource::Buffer(results)),
    ]);
    let parameters = SettleParameters {
        first_receiver: first,
        receiver_count: count,
    };
    let groups = count.div_ceil(pipeline.module.workgroup_size[0]);
    recorder.pass("settle", |recorder| {
        recorder.dispatch(&pipeline, &resources, &parameters, [groups, 1, 1])
    })
}
