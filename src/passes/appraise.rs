//! Appraise pass: how far the image is from independent gathers of some of its pixels.

use super::{Context, gbuffer::GBuffer, refine::Refinement};
use crate::{
    Result,
    vulkan::{Buffer, Image, Recorder, Resource, shaders::AppraiseParameters},
};

/// Compares the receivers of a list, `count` in all, whose results begin at the first of `results`, and those of a second gather
/// at `second_result`.
pub(crate) fn appraise<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    indirect_radiance: &'r Image,
    sample: &'r Refinement,
    (results, second_result): (&'r Buffer, u32),
    (appraisals, count): (&'r Buffer, u32),
) -> Result<()> {
    let pipeline = context
        .pipelines
        .compute("appraise", &[context.plan.brdf_word()])?;
    let mut resources = gbuffer.resources();
    resources.extend([
        ("indirect_radiance", Resource::Image(indirect_radiance)),
        ("receivers", Resource::Buffer(&sample.receivers)),
        ("bounced", Resource::Buffer(results)),
        ("appraisals", Resource::Buffer(appraisals)),
    ]);
    let parameters = AppraiseParameters {
        receiver_count: count,
        second_result,
    };
    let groups = count.div_ceil(pipeline.module.workgroup_size[0]);
    recorder.pass("appraise", |recorder| {
        recorder.dispatch(&pipeline, &resources, &parameters, [groups, 1, 1])
    })
}
