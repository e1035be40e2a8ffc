//! Gathers until the requested error is met.
//!
//! A pilot at a sample of pixels tells how bright the image is and how noisy gathers are. From that follow the samples of a gather
//! and the tolerance of interpolation. The image's error is then estimated on the sample, by gathers that share nothing with
//! the image's; where it is too large, another attempt follows.

use super::{
    error_estimate::{ErrorEstimate, PixelSample},
    refine::{RefinementResources, Refiner},
    sample_budget::{MAX_ATTEMPTS, PILOT_SAMPLES, SECOND_PILOT_SAMPLES, SampleBudget, next_aim},
};
use crate::{
    Result,
    frame::ProgressReport,
    passes::{cost::Cost, gatherer::Gatherer},
    vulkan::Recorder,
};

pub(super) struct AdaptiveGather<'a, 'p> {
    pub refiner: Refiner<'a>,
    pub coarsest_stride: u32,
    pub gatherer: &'a mut dyn Gatherer,
    pub progress: &'a mut ProgressReport<'p>,
    pub cost: &'a mut Cost,
}

impl AdaptiveGather<'_, '_> {
    /// Fills the indirect radiance and estimates its relRMSE. `None` where every pixel is gathered, and where the light is too
    /// dark to be estimated: final gathering then leaves the image as it is.
    pub fn gather(mut self, target_error: Option<f64>) -> Result<Option<f64>> {
        let is_exact = self.gatherer.is_exact();
        let Some(target) = target_error.filter(|_| self.gatherer.may_interpolate()) else {
            return self.gather_every_pixel();
        };
        let mut sample = PixelSample::new(&self.refiner, self.cost)?;
        let pilot = self.pilot(&mut sample)?;
        if pilot.is_dark() {
            return if is_exact {
                self.gather_every_pixel()
            } else {
                Ok(None)
            };
        }
        let radiance = pilot.radiance();
        let mut resources = self.resources(self.coarsest_stride)?;
        let mut aim = target;
        let mut attempt = 0;
        loop {
            let is_last = attempt + 1 == MAX_ATTEMPTS;
            self.progress.begin_attempt(attempt, is_last);
            let budget = if is_exact {
                SampleBudget::for_sums(aim, is_last)
            } else {
                SampleBudget::for_rays(aim, &pilot)
            };
            // What was gathered exactly stays.
            let starts_anew = attempt == 0 || !is_exact;
            if starts_anew {
                self.clear(&resources)?;
            }
            let criteria = budget.criteria(radiance);
            self.refiner.refine(
                (self.gatherer, budget.samples),
                &mut resources,
                (criteria, starts_anew),
                self.progress,
                self.cost,
            )?;
            let error = self
                .estimate(&mut sample, budget.samples, 1.0)?
                .relative_error();
            if error <= target || is_last || budget.is_largest() {
                return Ok(Some(error));
            }
            aim = next_aim(aim, target, error, is_exact);
            attempt += 1;
        }
    }

    /// Looks at the sample, and lets the gatherer learn from that.
    fn pilot(&mut self, sample: &mut PixelSample) -> Result<ErrorEstimate> {
        let results = 2 * sample.count;
        self.gatherer.begin_pilot(results, PILOT_SAMPLES)?;
        let mut pilot = self.estimate(sample, PILOT_SAMPLES, 0.0)?;
        if self.gatherer.learn(results, PILOT_SAMPLES)? {
            pilot = self.estimate(sample, PILOT_SAMPLES, 0.0)?;
        }
        if pilot.is_dark() && !self.gatherer.is_exact() {
            pilot = self.estimate(sample, SECOND_PILOT_SAMPLES, 0.0)?;
        }
        Ok(pilot)
    }

    fn estimate(
        &mut self,
        sample: &mut PixelSample,
        samples: u32,
        fraction: f64,
    ) -> Result<ErrorEstimate> {
        sample.estimate(
            &self.refiner,
            (self.gatherer, samples),
            &mut |_| self.progress.report_attempt("error_estimate", fraction),
            self.cost,
        )
    }

    fn gather_every_pixel(&mut self) -> Result<Option<f64>> {
        self.progress.begin_attempt(0, true);
        let mut resources = self.resources(1)?;
        self.clear(&resources)?;
        let budget = SampleBudget::for_sums(1.0, true);
        self.refiner.refine(
            (self.gatherer, budget.samples),
            &mut resources,
            (budget.criteria(1.0), true),
            self.progress,
            self.cost,
        )?;
        Ok(None)
    }

    fn resources(&self, coarsest_stride: u32) -> Result<RefinementResources> {
        let context = self.refiner.context;
        let is_exact = self.gatherer.is_exact();
        RefinementResources::new(context.device, context.plan, coarsest_stride, is_exact)
    }

    fn clear(&mut self, resources: &RefinementResources) -> Result<()> {
        let mut recorder = Recorder::new(self.refiner.context.device, 1)?;
        resources.images.clear(&mut recorder);
        self.cost.submit(recorder)
    }
}
