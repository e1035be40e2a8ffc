//! Averages depths and direct light over the pixels' area, sample by sample. `indirect::pixel_samples` averages the bounce.

use super::{
    FrameImages, ProgressReport, area_light, draw_maps, lights::Lights,
    scene_resources::SceneResources, see,
};
use crate::{
    Result,
    passes::{
        Context,
        direct::{self, DirectImages, SeenAt},
        random::hash,
    },
};

/// Fills the images of direct light and of depths with the means of all samples. Returns the estimated relRMSE of the direct light of
/// lights with an area, the largest of any; `None` without such a light.
pub(super) fn average(
    context: &Context,
    scene: &SceneResources,
    lights: &mut Lights,
    images: &FrameImages,
    progress: &mut ProgressReport,
) -> Result<Option<f64>> {
    let Some(sampled) = &images.sampled else {
        return Ok(None);
    };
    let mut squared_errors = vec![0.0; context.plan.lights.len()];
    let surfaces = scene.surfaces()?;
    let direct_images = DirectImages {
        radiance: &images.direct,
        phasors: images.direct_phasors.as_ref(),
    };
    for (index, sample) in sampled.samples(context).enumerate() {
        let done = sample.share * index as f64;
        // If there is a bounce, it was the first half of the samples' work.
        let done = match context.plan.indirect {
            Some(_) => 0.5 + 0.5 * done,
            None => done,
        };
        progress.report_sample("direct", done)?;
        see(context, scene, sample.offset_px, sample.gbuffer)?;
        for light in 0..context.plan.lights.len() {
            let number = light;
            let (light, dirty) = lights.update(context, light, scene)?;
            let share = sample.share;
            if let (true, Some(sums)) = (light.plan.is_area(), &images.area_light) {
                let error = area_light::shade(
                    context,
                    surfaces,
                    (sample.gbuffer, Some(share)),
                    (number, light, dirty.occluders),
                    (sums, direct_images),
                    hash(context.seed ^ hash(index as u32)),
                    progress,
                )?;
                squared_errors[number] += (share * error).powi(2);
                continue;
            }
            draw_maps(context, surfaces, light, &dirty)?;
            let light = (light, None, dirty.occluders);
            let seen = (sample.gbuffer, SeenAt::Samples { share });
            direct::shade(context, surfaces, seen, light, direct_images)?;
        }
        context.record(|r| sample.add_depth(r, context, &sampled.footprint))?;
    }
    let has_area = context.plan.area_light_error.is_some();
    let worst = squared_errors.into_iter().fold(0.0, f64::max).sqrt();
    Ok(has_area.then_some(worst))
}
