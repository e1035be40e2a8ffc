//! Indirect light of a frame.

mod adaptive;
mod error_estimate;
mod refine;
mod sample_budget;

pub(crate) use refine::RefinementResources;
use refine::Refiner;

use super::{FrameImages, ProgressReport, lights::Lights, scene_resources::SceneResources};
use crate::{
    Error, Result,
    passes::{Context, final_gather::FinalGather, gather::Gather, gatherer::Gatherer},
    plan::{GatherPlan, IndirectPlan},
};

/// The relRMSE of the indirect light as the engine estimates it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ErrorEstimates {
    /// Against the true bounce: of final gathering.
    pub error: Option<f64>,
    /// Against the sum at every pixel: where one was requested.
    pub interpolation_error: Option<f64>,
}

/// Fills the indirect radiance, gathered by the estimator that the scene wants.
pub(super) fn gather(
    context: &Context,
    plan: IndirectPlan,
    scene: &SceneResources,
    lights: &Lights,
    images: &FrameImages,
    progress: &mut ProgressReport,
) -> Result<ErrorEstimates> {
    let indirect_radiance = images.indirect.as_ref();
    let (Some(vpls), Some(indirect_radiance)) = (lights.vpls.as_ref(), indirect_radiance) else {
        return Err(Error::internal("there is no room for indirect light"));
    };
    let gbuffer = &images.gbuffer;
    let mut run = |gatherer: &mut dyn Gatherer| {
        let refiner = Refiner {
            context,
            gbuffer,
            indirect_radiance,
            gatherer,
            progress,
        };
        adaptive::gather(refiner, plan.refinement)
    };
    match plan.gather {
        GatherPlan::VplSum { sum, kernel } => {
            let lights = lights.listed();
            let estimate = if lights.iter().all(|listed| listed.count() == 0) {
                None
            } else {
                run(&mut Gather {
                    context,
                    sum,
                    kernel,
                    gbuffer,
                    vpls,
                    lights,
                })?
            };
            let is_requested = plan.refinement.target_error.is_some();
            Ok(ErrorEstimates {
                error: None,
                // Where nothing is interpolated there is no error.
                interpolation_error: is_requested.then_some(estimate.unwrap_or(0.0)),
            })
        }
        GatherPlan::FinalGather { kernel } => {
            let rays = (scene.ray_tree()?, scene.hit_surfaces()?);
            let lights = lights.listed_lights();
            let mut gatherer = FinalGather::new(context, gbuffer, rays, vpls, &lights, kernel)?;
            Ok(ErrorEstimates {
                error: run(&mut gatherer)?,
                interpolation_error: None,
            })
        }
    }
}
