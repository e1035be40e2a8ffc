//! Settle pass: the gathered bounce of receivers goes to their pixels, with what it says of the prediction's error.

use super::{
    Context,
    compact::Run,
    gbuffer::GBuffer,
    predict::{BounceImages, Judgement},
    refine::Refinement,
};
use crate::{
    Result,
    vulkan::{Buffer, Recorder, Resource, shaders::SettleParameters},
};

/// Takes the first results for the receivers of a run. Where there is noise and pixels may be interpolated, a gather is trusted as far as
/// it differs from its prediction by more than noise.
pub(crate) fn settle<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    images: &'r BounceImages,
    (refinement, run): (&'r Refinement, Run),
    results: &'r Buffer,
    judgement: Judgement,
) -> Result<()> {
    let pipeline = context
        .pipelines
        .compute("settle", &[context.plan.brdf_word(), images.noise_word()])?;
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.extend([
        ("receivers", Resource::Buffer(&refinement.receivers)),
        ("bounced", Resource::Buffer(results)),
    ]);
    let parameters = SettleParameters {
        first_receiver: run.first,
        receiver_count: run.count,
        inverse_radiance: (1.0 / judgement.radiance) as f32,
        is_lattice: judgement.tolerance.is_none().into(),
        variance_of_spread: judgement.variance_of_spread as f32,
    };
    let groups = run.count.div_ceil(pipeline.module.workgroup_size[0]);
    recorder.pass("settle", |recorder| {
        recorder.dispatch(&pipeline, &resources, &parameters, [groups, 1, 1])
    })
}
