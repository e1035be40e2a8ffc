//! Indirect light of a frame: from which VPLs, at which pixels, by sums or by rays.

use std::time::Duration;

use super::{
    Cost, FrameImages, ProgressReport, adaptive::Adaptive, lighting::Lighting, source::SumOfLights,
    stage::Stage,
};
use crate::{
    Error, IndirectMethod, IndirectPlan, Result, SumPlan,
    passes::{
        Context,
        bounce::Bounce,
        gather::{Gather, GatherStats, Sums},
        gbuffer::GBuffer,
        receivers::Receivers,
        vpl::VplLists,
    },
    vulkan::Image,
};

/// How the indirect light is gathered.
pub(super) struct Indirect<'f> {
    context: &'f Context<'f>,
    plan: IndirectPlan,
    /// Every pixel; `None` where few are gathered.
    pub receivers: Option<Receivers>,
    submission_target: Duration,
}

impl<'f> Indirect<'f> {
    /// `None` where the plan has no indirect light.
    pub fn for_plan(
        context: &'f Context<'f>,
        submission_target: Duration,
    ) -> Result<Option<Indirect<'f>>> {
        let Some(plan) = context.plan.indirect else {
            return Ok(None);
        };
        Ok(Some(Indirect {
            context,
            plan,
            receivers: (plan.refinement().is_none())
                .then(|| Receivers::new(context.device, context.plan))
                .transpose()?,
            submission_target,
        }))
    }

    /// Adds what a light's VPLs send to every pixel, where that is how it is done.
    pub fn gather_everywhere(
        &self,
        light: usize,
        lighting: &Lighting,
        images: &FrameImages,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let (IndirectMethod::Sum(sum), Some(receivers), Some(listed)) =
            (self.plan.method, &self.receivers, lighting.vpls_of(light))
        else {
            return Ok(());
        };
        let (vpls, radiance) = of_bounce(lighting, images)?;
        let mut gather = self.gather(sum, &images.gbuffer, vpls);
        let runs = receivers.runs()?;
        gather.accumulate(
            &[listed],
            (&receivers.pixels, &runs),
            Sums::Image(radiance),
            &mut |share| progress.report("gather", share),
        )?;
        cost.add_gather(gather.stats);
        Ok(())
    }

    /// Gathers the light of all VPLs, or by rays, at the pixels where it varies, where that is how it is done.
    pub fn gather_where_it_varies(
        &self,
        stage: &Stage,
        lighting: &Lighting,
        images: &FrameImages,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let Some(plan) = self.plan.refinement() else {
            return Ok(());
        };
        let (vpls, radiance) = of_bounce(lighting, images)?;
        let adaptive = Adaptive {
            context: self.context,
            plan,
            gbuffer: &images.gbuffer,
            indirect_radiance: radiance,
        };
        let rays = stage.ray_tree().zip(stage.hit_surfaces());
        match (self.plan.method, rays) {
            (IndirectMethod::Sum(sum), _) => {
                let lights = lighting.listed();
                if lights.iter().all(|listed| listed.count() == 0) {
                    return Ok(());
                }
                let mut sums = SumOfLights {
                    gather: self.gather(sum, &images.gbuffer, vpls),
                    lights: &lights,
                };
                let estimated = if sums.may_pay() {
                    adaptive.gather(&mut sums, progress, cost)?
                } else {
                    None
                };
                if estimated.is_none() {
                    sums.gather_everywhere(radiance, progress, cost)?;
                }
                cost.estimated_interpolation_error = estimated.or(Some(0.0));
                cost.add_gather(sums.gather.stats);
            }
            (IndirectMethod::Bounce(bounce_plan), Some(rays)) => {
                let mut bounce = Bounce::new(
                    self.context,
                    &images.gbuffer,
                    rays,
                    vpls,
                    &lighting.listed_lights(),
                    bounce_plan.kernel,
                    self.submission_target,
                )?;
                cost.estimated_error = adaptive.gather(&mut bounce, progress, cost)?;
                cost.add_bounce(bounce.stats);
            }
            (IndirectMethod::Bounce(_), None) => {
                return Err(Error::internal("there are no triangles for rays"));
            }
        }
        Ok(())
    }

    fn gather<'g>(
        &'g self,
        SumPlan { sum, kernel, .. }: SumPlan,
        gbuffer: &'g GBuffer,
        vpls: &'g VplLists,
    ) -> Gather<'g> {
        Gather {
            context: self.context,
            sum,
            kernel,
            gbuffer,
            vpls,
            submission_target: self.submission_target,
            stats: GatherStats::default(),
        }
    }
}

/// What is there wherever there is indirect light.
fn of_bounce<'f>(
    lighting: &'f Lighting,
    images: &'f FrameImages,
) -> Result<(&'f VplLists, &'f Image)> {
    let both = lighting.vpls.as_ref().zip(images.indirect.as_ref());
    both.ok_or_else(|| Error::internal("there is no room for indirect light"))
}
