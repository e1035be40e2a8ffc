//! One attempt at the image: from a coarse grid of pixels to every pixel (after Nichols & Wyman 2009).
//!
//! A pixel that is gathered tells how wrong its prediction from the coarser ones was; where that was little, the finer ones around
//! it are interpolated. Every pixel is gathered where the grid's stride is 1.

use crate::{
    Result,
    frame::ProgressReport,
    passes::{
        Context,
        cost::Cost,
        gatherer::{Gatherer, Results, Samples},
        gbuffer::GBuffer,
        predict,
        receivers::{self, Receivers},
        refinement::{RefinementCriteria, RefinementImages},
        resolve, scatter,
        smooth::Smoothing,
    },
    plan::GridStep,
    vulkan::{Buffer, Image, Recorder},
};

/// Steps whose pixels are gathered whatever the light: the coarsest grid and the first step between its pixels show what is to be
/// expected.
const GRID_STEPS: usize = 3;
/// Receivers whose results there is room for.
const MAX_RESULTS: u32 = 1 << 20;

pub(super) struct Refiner<'a> {
    pub context: &'a Context<'a>,
    pub gbuffer: &'a GBuffer,
    pub indirect_radiance: &'a Image,
    pub coarsest_stride: u32,
}

/// What the steps of an attempt share.
struct Attempt<'a> {
    images: &'a RefinementImages,
    results: Buffer,
    samples: u32,
    step_count: usize,
}

impl Refiner<'_> {
    pub fn images(&self, is_exact: bool) -> Result<RefinementImages> {
        RefinementImages::new(self.context.device, self.context.plan, !is_exact)
    }

    /// Gathers and interpolates all pixels. Where it does not start anew, the coarsest grid was gathered before.
    pub fn refine(
        &self,
        (gatherer, samples): (&mut dyn Gatherer, u32),
        images: &RefinementImages,
        (criteria, starts_anew): (RefinementCriteria, bool),
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let device = self.context.device;
        let resolution_px = self.context.plan.resolution_px;
        let steps = GridStep::all(self.coarsest_stride);
        let counts = steps.iter().map(|step| step.pixel_count(resolution_px));
        let most = counts.clone().max().unwrap_or(1);
        let most_candidates = counts.skip(1).max().unwrap_or(0);
        let mut receivers = Receivers::new(device, most, most_candidates)?;
        let attempt = Attempt {
            images,
            results: Results::room(device, most.min(MAX_RESULTS))?,
            samples,
            step_count: steps.len(),
        };
        // Every pixel of this grid is gathered.
        let grid_steps = steps.len().min(GRID_STEPS);
        let smoothing = (!gatherer.is_exact())
            .then(|| Smoothing::new(self.context, (self.coarsest_stride / 2).max(1)))
            .transpose()?;
        for (index, &step) in steps.iter().enumerate() {
            if index == 0 && !starts_anew {
                continue;
            }
            let criteria = RefinementCriteria {
                tolerance: criteria.tolerance.filter(|_| index >= grid_steps),
                ..criteria
            };
            self.list(&mut receivers, images, step, criteria, cost)?;
            let progress = &mut *progress;
            self.gather(
                &receivers,
                gatherer,
                &attempt,
                (index, criteria),
                progress,
                cost,
            )?;
            if let Some(smoothing) = smoothing.as_ref().filter(|_| index + 1 == grid_steps) {
                let mut recorder = Recorder::new(device, 1)?;
                smoothing.smooth(&mut recorder, self.context, self.gbuffer, images, criteria)?;
                cost.submit(recorder)?;
            }
        }
        let mut recorder = Recorder::new(device, 1)?;
        let radiance = self.indirect_radiance;
        resolve::resolve(&mut recorder, self.context, self.gbuffer, images, radiance)?;
        cost.submit(recorder)
    }

    /// Interpolates the pixels of a step that may be, and lists the others.
    fn list(
        &self,
        receivers: &mut Receivers,
        images: &RefinementImages,
        step: GridStep,
        criteria: RefinementCriteria,
        cost: &mut Cost,
    ) -> Result<()> {
        let Refiner {
            context, gbuffer, ..
        } = *self;
        receivers.set_candidate_count(step.pixel_count(context.plan.resolution_px))?;
        let mut recorder = Recorder::new(context.device, 8)?;
        let r = &mut recorder;
        predict::predict(r, context, gbuffer, images, receivers, step, criteria)?;
        let grid_stride = match step {
            GridStep::Base { stride } => Some(stride),
            GridStep::Centres { .. } | GridStep::Edges { .. } => None,
        };
        receivers::list(r, context, gbuffer, receivers, grid_stride)?;
        cost.submit(recorder)
    }

    /// Gathers at the receivers and scatters the results to their pixels.
    fn gather(
        &self,
        receivers: &Receivers,
        gatherer: &mut dyn Gatherer,
        attempt: &Attempt,
        (step, criteria): (usize, RefinementCriteria),
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let Refiner {
            context, gbuffer, ..
        } = *self;
        let ranges = receivers.ranges()?;
        let total: u32 = ranges.iter().map(|range| range.count).sum();
        let pass = gatherer.pass();
        let samples = Samples {
            count: attempt.samples,
            seed: step as u32,
        };
        let parts = ranges
            .into_iter()
            .flat_map(|range| range.split(MAX_RESULTS));
        for range in parts {
            let results = Results {
                buffer: &attempt.results,
                first: 0,
            };
            let mut proceed = |share: f64| {
                let of_step = (f64::from(range.first) + share * f64::from(range.count))
                    / f64::from(total.max(1));
                progress.report_attempt(pass, (step as f64 + of_step) / attempt.step_count as f64)
            };
            gatherer.gather((receivers, range), results, samples, cost, &mut proceed)?;
            let mut recorder = Recorder::new(context.device, 1)?;
            scatter::scatter(
                &mut recorder,
                context,
                gbuffer,
                attempt.images,
                (receivers, range),
                &attempt.results,
                criteria,
            )?;
            cost.submit(recorder)?;
        }
        Ok(())
    }
}
