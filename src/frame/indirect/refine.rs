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
    plan::{GridStep, Plan},
    vulkan::{Allocate, Device, Image, Recorder},
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
}

/// What the refinement works with.
pub(crate) struct RefinementResources<A: Allocate = Device> {
    steps: Vec<GridStep>,
    pub images: RefinementImages<A>,
    receivers: Receivers<A>,
    results: A::Buffer,
    /// Of the grid of which every pixel is gathered; only where gathers have noise.
    smoothing: Option<Smoothing<A>>,
}

impl<A: Allocate> RefinementResources<A> {
    pub fn new(
        allocate: &A,
        plan: &Plan,
        coarsest_stride: u32,
        is_exact: bool,
    ) -> Result<RefinementResources<A>> {
        let steps = GridStep::all(coarsest_stride);
        let counts = steps
            .iter()
            .map(|step| step.pixel_count(plan.resolution_px));
        let most = counts.clone().max().unwrap_or(1);
        // The coarsest grid needs no list of candidates.
        let most_candidates = counts.skip(1).max().unwrap_or(0);
        let smoothing_stride = (coarsest_stride / 2).max(1);
        Ok(RefinementResources {
            images: RefinementImages::new(allocate, plan, !is_exact)?,
            receivers: Receivers::new(allocate, most, most_candidates)?,
            results: Results::room(allocate, most.min(MAX_RESULTS))?,
            smoothing: (!is_exact)
                .then(|| Smoothing::new(allocate, plan.resolution_px, smoothing_stride))
                .transpose()?,
            steps,
        })
    }
}

impl Refiner<'_> {
    /// Gathers and interpolates all pixels. Where it does not start anew, the coarsest grid was gathered before.
    pub fn refine(
        &self,
        (gatherer, samples): (&mut dyn Gatherer, u32),
        resources: &mut RefinementResources,
        (criteria, starts_anew): (RefinementCriteria, bool),
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let device = self.context.device;
        // Every pixel of this grid is gathered.
        let grid_steps = resources.steps.len().min(GRID_STEPS);
        for index in usize::from(!starts_anew)..resources.steps.len() {
            let criteria = RefinementCriteria {
                tolerance: criteria.tolerance.filter(|_| index >= grid_steps),
                ..criteria
            };
            self.list(resources, index, criteria, cost)?;
            let progress = &mut *progress;
            self.gather(
                (gatherer, samples),
                resources,
                (index, criteria),
                progress,
                cost,
            )?;
            let smoothing = resources.smoothing.as_ref();
            if let Some(smoothing) = smoothing.filter(|_| index + 1 == grid_steps) {
                let mut recorder = Recorder::new(device, 1)?;
                let images = &resources.images;
                smoothing.smooth(&mut recorder, self.context, self.gbuffer, images, criteria)?;
                cost.submit(recorder)?;
            }
        }
        let mut recorder = Recorder::new(device, 1)?;
        let (images, radiance) = (&resources.images, self.indirect_radiance);
        resolve::resolve(&mut recorder, self.context, self.gbuffer, images, radiance)?;
        cost.submit(recorder)
    }

    /// Interpolates the pixels of a step that may be, and lists the others.
    fn list(
        &self,
        resources: &mut RefinementResources,
        step: usize,
        criteria: RefinementCriteria,
        cost: &mut Cost,
    ) -> Result<()> {
        let Refiner {
            context, gbuffer, ..
        } = *self;
        let step = resources.steps[step];
        let count = step.pixel_count(context.plan.resolution_px);
        resources.receivers.set_candidate_count(count)?;
        let RefinementResources {
            images, receivers, ..
        } = &*resources;
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
        (gatherer, samples): (&mut dyn Gatherer, u32),
        resources: &RefinementResources,
        (step, criteria): (usize, RefinementCriteria),
        progress: &mut ProgressReport,
        cost: &mut Cost,
    ) -> Result<()> {
        let Refiner {
            context, gbuffer, ..
        } = *self;
        let RefinementResources {
            steps,
            images,
            receivers,
            results,
            ..
        } = resources;
        let ranges = receivers.ranges()?;
        let total: u32 = ranges.iter().map(|range| range.count).sum();
        let pass = gatherer.pass();
        let samples = Samples {
            count: samples,
            seed: step as u32,
        };
        let parts = ranges
            .into_iter()
            .flat_map(|range| range.split(MAX_RESULTS));
        for range in parts {
            let first_results = Results {
                buffer: results,
                first: 0,
            };
            let mut proceed = |share: f64| {
                let of_step = (f64::from(range.first) + share * f64::from(range.count))
                    / f64::from(total.max(1));
                progress.report_attempt(pass, (step as f64 + of_step) / steps.len() as f64)
            };
            gatherer.gather(
                (receivers, range),
                first_results,
                samples,
                cost,
                &mut proceed,
            )?;
            let mut recorder = Recorder::new(context.device, 1)?;
            scatter::scatter(
                &mut recorder,
                context,
                gbuffer,
                images,
                (receivers, range),
                results,
                criteria,
            )?;
            cost.submit(recorder)?;
        }
        Ok(())
    }
}
