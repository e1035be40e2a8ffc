//! Indirect light of a frame: from which VPLs, at which pixels, by sums or by rays.

use std::time::Duration;

use super::{Cost, ProgressReport, adaptive::Adaptive, shuffle, source::SumOfLights};
use crate::{
    Error, IndirectMethod, IndirectPlan, Result, SumPlan,
    passes::{
        Context,
        bounce::Bounce,
        gather::{Gather, GatherStats, ListedVpls, Sums},
        gbuffer::GBuffer,
        hits::HitSurfaces,
        light::DeviceLight,
        rays::RayTreeImages,
        receivers::Receivers,
        rsm::Rsm,
        vpl::VplLists,
        vpl_draws::ListedLight,
    },
    vulkan::{Image, ImageShape},
};

/// What indirect light takes beside the G-buffer. The RSM is room that the lights use in turn.
pub(super) struct Indirect<'c> {
    pub plan: &'c IndirectPlan,
    pub rsm: Rsm,
    pub vpls: VplLists,
    /// Every pixel; `None` where few are gathered.
    pub receivers: Option<Receivers>,
    pub radiance: Image,
    submission_target: Duration,
    /// Of the lights so far, where they lie in the lists.
    listed: Vec<ListedVpls>,
    /// The same for the draws of rays.
    listed_lights: Vec<ListedLight>,
}

impl<'c> Indirect<'c> {
    pub fn new(
        context: &Context,
        plan: &'c IndirectPlan,
        submission_target: Duration,
    ) -> Result<Self> {
        let Context {
            device,
            plan: frame,
            ..
        } = *context;
        let faces = frame.max_faces();
        let shape = ImageShape::plain(frame.resolution_px);
        let texels = faces * plan.rsm_size * plan.rsm_size;
        let is_refined = plan.refinement().is_some();
        let light_count = frame.lights.len() as u32;
        let vpls = match plan.method {
            IndirectMethod::Bounce(_) => VplLists::for_bounce(device, frame, light_count, texels)?,
            IndirectMethod::Sum(_) => {
                let lists = if is_refined { light_count } else { 1 };
                VplLists::new(device, frame, lists, texels)?
            }
        };
        Ok(Indirect {
            plan,
            rsm: Rsm::new(device, frame, plan.rsm_size, faces)?,
            vpls,
            receivers: (!is_refined)
                .then(|| Receivers::new(device, frame))
                .transpose()?,
            radiance: Image::new(device, "indirect radiance", shape)?,
            submission_target,
            listed: Vec::new(),
            listed_lights: Vec::new(),
        })
    }

    /// After the submission that listed a light's VPLs.
    pub fn take_vpls(
        &mut self,
        context: &Context,
        light: &DeviceLight,
        cost: &mut Cost,
    ) -> Result<()> {
        let listed = ListedVpls {
            first: light.parameters.first_vpl,
            lengths: self.vpls.lengths()?,
        };
        cost.vpl_count += u64::from(listed.count());
        self.listed.push(listed);
        match (self.plan.method, context.vpl_order) {
            (IndirectMethod::Bounce(_), _) => {
                let listed = ListedLight::new(light, &self.vpls)?;
                self.listed_lights.push(listed);
                Ok(())
            }
            (IndirectMethod::Sum(_), Some(seed)) => {
                shuffle::shuffle(context.device, &self.vpls, listed, seed)
            }
            (IndirectMethod::Sum(_), None) => Ok(()),
        }
    }

    /// Adds what the last light's VPLs send to every pixel, where that is how it is done.
    pub fn gather_everywhere(
        &self,
        context: &Context,
        gbuffer: &GBuffer,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let (IndirectMethod::Sum(sum), Some(receivers), Some(&listed)) =
            (self.plan.method, &self.receivers, self.listed.last())
        else {
            return Ok(());
        };
        let mut gather = self.gather(context, sum, gbuffer);
        let runs = receivers.runs()?;
        gather.accumulate(
            &[listed],
            (&receivers.pixels, &runs),
            Sums::Image(&self.radiance),
            &mut |share| progress.report("gather", share),
        )?;
        cost.add_gather(gather.stats);
        // What is exact is within every error that is asked for.
        let asked = context
            .scene
            .indirect
            .and_then(|indirect| indirect.target_error);
        cost.estimated_error = asked.map(|_| 0.0);
        Ok(())
    }

    /// Gathers the light of all VPLs, or by rays, at the pixels where it varies, where that is how it is done.
    pub fn gather_where_it_varies(
        &self,
        context: &Context,
        gbuffer: &GBuffer,
        rays: Option<(&RayTreeImages, &HitSurfaces)>,
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let Some(plan) = self.plan.refinement() else {
            return Ok(());
        };
        let adaptive = Adaptive {
            context,
            plan,
            gbuffer,
            indirect_radiance: &self.radiance,
        };
        match (self.plan.method, rays) {
            (IndirectMethod::Sum(sum), _) => {
                if self.listed.iter().all(|listed| listed.count() == 0) {
                    return Ok(());
                }
                let mut sums = SumOfLights {
                    gather: self.gather(context, sum, gbuffer),
                    lights: &self.listed,
                };
                let estimated = if sums.may_pay() {
                    adaptive.gather(&mut sums, progress, cost)?
                } else {
                    None
                };
                if estimated.is_none() {
                    sums.gather_everywhere(&self.radiance, progress, cost)?;
                }
                cost.estimated_error = estimated.or(Some(0.0));
                cost.add_gather(sums.gather.stats);
            }
            (IndirectMethod::Bounce(bounce_plan), Some(rays)) => {
                let mut bounce = Bounce::new(
                    context,
                    gbuffer,
                    rays,
                    &self.vpls,
                    &self.listed_lights,
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
        context: &'g Context<'g>,
        SumPlan { kernel, .. }: SumPlan,
        gbuffer: &'g GBuffer,
    ) -> Gather<'g> {
        Gather {
            context,
            estimator: self.plan.estimator,
            kernel,
            gbuffer,
            vpls: &self.vpls,
            submission_target: self.submission_target,
            stats: GatherStats::default(),
        }
    }
}
