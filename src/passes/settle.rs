//! Settle pass: the gathered bounce of receivers goes to their pixels, with what it says of the prediction's error.

use super::{
    Context,
    gbuffer::GBuffer,
    predict::BounceImages,
    refine::{Refinement, Run},
};
use crate::{
    Result,
    vulkan::{Buffer, Recorder, Resource, shaders::SettleParameters},
};

/// Takes the first results for the receivers of a run.
pub(crate) fn settle<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    images: &'r BounceImages,
    (refinement, run): (&'r Refinement, Run),
    results: &'r Buffer,
) -> Result<()> {
    let pipeline = context
        .pipelines
        .compute("settle", &[context.plan.brdf_word()])?;
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.extend([
        ("receivers", Resource::Buffer(&refinement.receivers)),
        ("bounced", Resource::Buffer(results)),
    ]);
    let parameters = SettleParameters {
        first_receiver: run.first,
        receiver_count: run.count,
    };
    let groups = run.count.div_ceil(pipeline.module.workgroup_size[0]);
    recorder.pass("settle", |recorder| {
        recorder.dispatch(&pipeline, &resources, &parameters, [groups, 1, 1])
    })
}
