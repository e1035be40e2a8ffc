//! Indirect light of a frame.

mod adaptive;
mod antialiased_bounce;
mod error_estimate;
mod expected_errors;
mod image_estimate;
mod judge;
mod limits;
mod listed_pixels;
mod probe_pixels;
mod refine;
mod resources;
mod sample_budget;
mod shared_light_rays;
mod smoothed;

pub(crate) use antialiased_bounce::AntialiasedBounceResources;
use refine::Refiner;
pub(crate) use resources::RefinementResources;
use shared_light_rays::SharedLightRays;

use super::{FrameImages, ProgressReport, lights::Lights, scene_resources::SceneResources};
use crate::{
    Error, Result,
    output::StopReason,
    passes::{Context, final_gather::FinalGather, gather::Gather, gatherer::Gatherer},
    plan::{GatherPlan, IndirectPlan},
};

/// The engine's estimates of its errors, relRMSE; of the indirect light unless stated otherwise.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ErrorEstimates {
    /// Error of final gathering against the true bounce.
    pub error: Option<f64>,
    /// Upper bound of `error` with a confidence of 95 %.
    pub error_upper: Option<f64>,
    /// Error of range of the worst frequency, metres, and its upper bound; only if a target was requested for it.
    pub range_errors_m: Option<[f64; 2]>,
    /// Why final gathering stopped; `None` if the light is too dark to be estimated.
    pub stop: Option<StopReason>,
    /// Rays and milliseconds of the least frame with an estimate: no limit lowers them.
    pub least: Option<(u64, f64)>,
    /// Error of interpolation against the sum at every pixel, if a target was requested for it.
    pub interpolation_error: Option<f64>,
    /// Error of the direct light of lights with an area: the largest of any of them.
    pub area_light_error: Option<f64>,
}

/// Fills the indirect radiance, gathered by the scene's estimator.
pub(super) fn gather(
    context: &Context,
    plan: IndirectPlan,
    scene: &SceneResources,
    lights: &Lights,
    images: &FrameImages,
    progress: &mut ProgressReport,
) -> Result<ErrorEstimates> {
    let sampled = images.sampled.as_ref();
    let (indirect_radiance, indirect_phasors) = match sampled {
        None => (images.indirect.as_ref(), images.indirect_phasors.as_ref()),
        Some(sampled) => (
            sampled.centre_indirect.as_ref(),
            sampled.centre_phasors.as_ref(),
        ),
    };
    let no_room = || Error::internal("there is no room for indirect light");
    let indirect_radiance = indirect_radiance.ok_or_else(no_room)?;
    let gbuffer = &images.gbuffer;
    let gathered = sampled.and_then(|sampled| sampled.gathered.as_ref());
    let mut run = |gatherer: &mut dyn Gatherer| {
        let mut refiner = Refiner {
            context,
            gbuffer,
            indirect_radiance,
            indirect_phasors,
            direct_phasors: images.direct_phasors.as_ref(),
            indirect_stderr: images.indirect_stderr.as_ref(),
            gathered,
            samples_of_pixel: None,
            gathered_pixels: 0,
            smooths_ratio: false,
            light_rays: SharedLightRays::default(),
            gatherer,
            progress,
        };
        let estimates = adaptive::gather(&mut refiner, plan.refinement)?;
        let gathered_at = limits::Spent::so_far(context).seconds;
        context.cost.borrow_mut().gathered_at = gathered_at;
        if let Some((gathered, indirect)) = gathered.zip(images.indirect.as_ref()) {
            antialiased_bounce::average(&mut refiner, scene, images, gathered, indirect)?;
        }
        Ok(estimates)
    };
    match plan.gather {
        GatherPlan::VplSum { sum, kernel } => {
            let vpls = lights.vpls.as_ref().ok_or_else(no_room)?;
            let lights: Vec<_> = lights
                .on_device()
                .into_iter()
                .zip(lights.listed())
                .collect();
            let found = if lights.iter().all(|(_, listed)| listed.count() == 0) {
                ErrorEstimates::default()
            } else {
                run(&mut Gather {
                    context,
                    sum,
                    kernel,
                    vpls,
                    lights,
                })?
            };
            let is_requested = plan.refinement.target_error.is_some();
            Ok(ErrorEstimates {
                // Without interpolation there is no error.
                interpolation_error: is_requested
                    .then_some(found.interpolation_error.unwrap_or(0.0)),
                ..found
            })
        }
        GatherPlan::FinalGather { .. } => {
            let (scene, lattice) = (scene.hit_scene()?, scene.lattice()?);
            run(&mut FinalGather::new(
                context,
                scene,
                lattice,
                lights.on_device(),
            )?)
        }
    }
}
