//! What the pixels show over their area: depths and direct light, sample by sample. `indirect::pixel_samples` has the bounce.

use super::{
    FrameImages, ProgressReport, draw_maps, lights::Lights, scene_resources::SceneResources, see,
};
use crate::{
    Result,
    passes::{
        Context,
        direct::{self, DirectImages, SeenAt},
    },
};

/// Fills the images of direct light and of depths with those of all samples.
pub(super) fn average(
    context: &Context,
    scene: &SceneResources,
    lights: &mut Lights,
    images: &FrameImages,
    progress: &mut ProgressReport,
) -> Result<()> {
    let Some(sampled) = &images.sampled else {
        return Ok(());
    };
    let surfaces = scene.surfaces()?;
    let direct_images = DirectImages {
        radiance: &images.direct,
        phasors: images.direct_phasors.as_ref(),
    };
    for (index, sample) in sampled.samples(context).enumerate() {
        let done = sample.share * index as f64;
        // The bounce, where there is one, was half of it.
        let done = match context.plan.indirect {
            Some(_) => 0.5 + 0.5 * done,
            None => done,
        };
        progress.report_sample("direct", done)?;
        context.record(|r| see(r, context, scene, sample.offset_px, sample.gbuffer))?;
        for light in 0..context.plan.lights.len() {
            let (light, dirty) = lights.update(context, light, scene)?;
            context.record(|r| {
                draw_maps(r, context, surfaces, light, &dirty)?;
                let light = (light, dirty.occluders);
                let share = sample.share;
                let seen = (sample.gbuffer, SeenAt::Samples { share });
                direct::shade(r, context, surfaces, seen, light, direct_images)
            })?;
        }
        context.record(|r| sample.add_depth(r, context, &sampled.footprint))?;
    }
    Ok(())
}
