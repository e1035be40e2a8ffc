//! Averages depths and direct light over the pixels' area, sample by sample. `indirect::antialiased_bounce` averages the bounce.

use super::{
    FrameImages, ProgressReport,
    direct::{draw_maps, see, shade},
    lights::Lights,
    scene_resources::SceneResources,
};
use crate::{
    Result,
    passes::{Context, random::hash},
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
    let surfaces = scene.surfaces()?;
    let mut squared_errors = vec![None; context.plan.lights.len()];
    for (index, sample) in sampled.samples(context).enumerate() {
        let done = sample.share * index as f64;
        // If there is a bounce, it was the first half of the samples' work.
        let done = match context.plan.indirect {
            Some(_) => 0.5 + 0.5 * done,
            None => done,
        };
        progress.report_sample("direct", done)?;
        let share = Some(sample.share);
        let emission = images.emission.as_ref();
        let seen = see(
            context,
            scene,
            sample.offset_px,
            share,
            sample.gbuffer,
            emission,
        )?;
        let seed = hash(context.seed ^ hash(index as u32));
        for (light, squared_error) in squared_errors.iter_mut().enumerate() {
            let light = lights.update(context, light, scene)?;
            draw_maps(context, surfaces, &light)?;
            if let Some(error) = shade(context, seen, &light, images, seed, progress)? {
                *squared_error.get_or_insert(0.0) += (sample.share * error).powi(2);
            }
        }
        sample.add_depth(context, &sampled.footprint)?;
    }
    let worst = squared_errors.into_iter().flatten().reduce(f64::max);
    Ok(worst.map(f64::sqrt))
}
