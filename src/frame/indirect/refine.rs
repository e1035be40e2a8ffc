//! One attempt at the image: refines a coarse grid of pixels to every pixel (after Nichols & Wyman 2009).
//!
//! A gathered pixel shows how wrong its prediction from coarser pixels was. Where the prediction was good, the finer pixels around it
//! are interpolated. If the grid's stride is 1, every pixel is gathered.

use super::adaptive::{Limits, Spent};
use crate::{
    Result,
    frame::ProgressReport,
    passes::{
        Context,
        gatherer::{GatheredFor, Gatherer, LightRaySets, Results, Samples},
        gbuffer::GBuffer,
        modulation, predict,
        receivers::{self, Receivers},
        refinement::{RefinementCriteria, RefinementImages},
        resolve,
        sample_counts::{PACKET_SAMPLES, SampleCounts},
        scatter, smooth, smooth_residuals, stderr,
    },
    plan::{GridStep, Plan},
    scene::MAX_FREQUENCIES,
    vulkan::{Allocate, Device, Image},
};

/// Steps whose pixels are gathered for any light. The coarsest grid and the first refinement between its pixels show what to
/// expect.
const GRID_STEPS: usize = 3;
/// Most vectors of results that there is room for.
pub(super) const MAX_RESULT_VECTORS: u32 = 1 << 21;

/// Fills the indirect radiance from what a gatherer gathers.
pub(super) struct Refiner<'a, 'p> {
    pub context: &'a Context<'a>,
    pub gbuffer: &'a GBuffer,
    pub indirect_radiance: &'a Image,
    pub indirect_phasors: Option<&'a Image>,
    pub indirect_stderr: Option<&'a Image>,
    /// What the last complete attempt gathered; only if pixels are averaged over their area.
    pub gathered: Option<&'a Image>,
    /// Approximate number of samples of a gather in that attempt; `None` if there was none.
    pub samples_of_pixel: Option<u32>,
    /// Pixels that the last attempt gathered.
    pub gathered_pixels: u32,
    /// Whether the light over that of VPLs without occlusion is smoothed.
    pub smooths_ratio: bool,
    pub gatherer: &'a mut dyn Gatherer,
    pub progress: &'a mut ProgressReport<'p>,
}

/// One attempt at the image.
pub(super) struct Attempt<'l> {
    /// Approximate number of samples of a gather.
    pub samples: u32,
    pub criteria: RefinementCriteria,
    pub number: u32,
    /// With what was spent before the gather; `None` if there are no limits.
    pub limits: Option<(&'l Limits, &'l Spent)>,
}

/// The images, lists and buffers of the refinement.
pub(crate) struct RefinementResources<A: Allocate = Device> {
    steps: Vec<GridStep>,
    pub images: RefinementImages<A>,
    receivers: Receivers<A>,
    results: A::Buffer,
    /// Number of receivers whose results fit.
    max_results: u32,
    /// Only if gathers have noise.
    counts: Option<SampleCounts<A>>,
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
        let max_results = most.min(MAX_RESULT_VECTORS / Results::vectors(plan)?);
        Ok(RefinementResources {
            images: RefinementImages::new(allocate, plan, !is_exact)?,
            receivers: Receivers::new(allocate, most, most_candidates)?,
            counts: (!is_exact)
                .then(|| SampleCounts::new(allocate, most))
                .transpose()?,
            results: Results::room(allocate, plan, max_results)?,
            max_results,
            steps,
        })
    }
}

impl Refiner<'_, '_> {
    /// Fills the layer of standard errors, if it was requested.
    pub fn fill_stderr(&self, factors: [f64; 2]) -> Result<()> {
        let Some(layer) = self.indirect_stderr else {
            return Ok(());
        };
        let (context, radiance) = (self.context, self.indirect_radiance);
        context.record(|recorder| stderr::fill(recorder, context, radiance, layer, factors))
    }

    /// Allocates the resources. No pixel has samples.
    pub fn resources(&self, coarsest_stride: u32) -> Result<RefinementResources> {
        let Context { device, plan, .. } = *self.context;
        let is_exact = self.gatherer.is_exact();
        let mut resources = RefinementResources::new(device, plan, coarsest_stride, is_exact)?;
        self.scale_errors(&mut resources, [1.0; MAX_FREQUENCIES])?;
        self.context.record(|recorder| {
            resources.images.clear_samples(recorder);
            Ok(())
        })?;
        Ok(resources)
    }

    /// Scales errors of Z to errors of light: one factor per frequency of time of flight.
    pub fn scale_errors(
        &self,
        resources: &mut RefinementResources,
        factors: [f32; MAX_FREQUENCIES],
    ) -> Result<()> {
        let Context {
            device,
            scene,
            space,
            ..
        } = *self.context;
        resources.images.modulation = modulation::upload(device, scene, space, factors)?;
        Ok(())
    }

    /// Gathers and interpolates all pixels. Samples of earlier attempts still count; exact gathers are kept.
    ///
    /// Returns whether all samples were taken. Once the limits are reached, pixels keep the samples that they have, and the others are
    /// interpolated. So every sample counts.
    pub fn refine(
        &mut self,
        resources: &mut RefinementResources,
        attempt: Attempt,
    ) -> Result<bool> {
        let criteria = attempt.criteria;
        let context = self.context;
        let is_first = attempt.number == 0;
        let starts_anew = is_first || !self.gatherer.is_exact();
        if starts_anew {
            context.record(|recorder| {
                resources.images.clear(recorder);
                Ok(())
            })?;
        }
        // Every pixel of these steps is gathered.
        let grid_steps = resources.steps.len().min(GRID_STEPS);
        let mut is_spent = false;
        self.gathered_pixels = 0;
        for index in usize::from(!starts_anew)..resources.steps.len() {
            is_spent = is_spent
                || attempt
                    .limits
                    .is_some_and(|(limits, start)| limits.are_reached(self, start));
            let mut criteria = criteria;
            let mut samples = attempt.samples;
            if is_spent {
                criteria.tolerance = Some(f64::INFINITY);
                // A pixel without samples that cannot be interpolated takes one packet.
                criteria.allocation.packets_scale = 0.0;
                samples = PACKET_SAMPLES;
            }
            criteria.tolerance = criteria.tolerance.filter(|_| index >= grid_steps);
            self.list(resources, index, criteria)?;
            self.gather(resources, index, (attempt.number, samples), criteria)?;
            if [grid_steps, resources.steps.len()].contains(&(index + 1)) {
                self.smooth(resources, index, criteria)?;
            }
        }
        self.resolve(resources, attempt.criteria)?;
        self.samples_of_pixel = Some(attempt.samples);
        Ok(!is_spent)
    }

    fn resolve(&self, resources: &RefinementResources, criteria: RefinementCriteria) -> Result<()> {
        let (context, images) = (self.context, &resources.images);
        context.record(|recorder| {
            resolve::resolve(
                recorder,
                context,
                self.gbuffer,
                images,
                (self.indirect_radiance, self.indirect_phasors),
                criteria,
            )?;
            if let Some(kept) = self.gathered {
                images.copy_gathered(recorder, kept);
            }
            Ok(())
        })
    }

    /// Whether the last attempt gathered most pixels, as on meshes of facets as small as pixels.
    pub fn gathers_most_pixels(&self) -> bool {
        let pixels: u32 = self.context.plan.resolution_px.iter().product();
        2 * self.gathered_pixels >= pixels
    }

    /// Computes the light of VPLs without occlusion. Returns whether there are any.
    pub fn fill_unoccluded(&mut self, resources: &RefinementResources) -> Result<bool> {
        let progress = &mut *self.progress;
        let mut proceed = || progress.report_attempt("unoccluded", 1.0);
        self.gatherer
            .fill_unoccluded(self.gbuffer, &resources.images, &mut proceed)
    }

    /// Smooths the image of the last attempt anew.
    pub fn smooth_again(
        &self,
        resources: &RefinementResources,
        criteria: RefinementCriteria,
    ) -> Result<()> {
        self.smooth(resources, resources.steps.len() - 1, criteria)?;
        self.resolve(resources, criteria)
    }

    /// Lowers the noise on the grid that a step completes. Does nothing if gathers are exact.
    fn smooth(
        &self,
        resources: &RefinementResources,
        step: usize,
        criteria: RefinementCriteria,
    ) -> Result<()> {
        let stride_px = resources.steps[step].completed_stride_px();
        let Some(stride_px) = stride_px.filter(|_| !self.gatherer.is_exact()) else {
            return Ok(());
        };
        let (context, gbuffer, images) = (self.context, self.gbuffer, &resources.images);
        context.record(|recorder| {
            let how = (stride_px, self.smooths_ratio);
            smooth::smooth(recorder, context, gbuffer, images, how, criteria)?;
            smooth_residuals::smooth(recorder, context, gbuffer, images, stride_px)
        })
    }

    /// Interpolates the pixels of a step that may be interpolated, and lists the others with the samples that they take.
    fn list(
        &self,
        resources: &mut RefinementResources,
        step: usize,
        criteria: RefinementCriteria,
    ) -> Result<()> {
        let (context, gbuffer) = (self.context, self.gbuffer);
        let step = resources.steps[step];
        let count = step.pixel_count(context.plan.resolution_px);
        resources.receivers.set_candidate_count(count)?;
        let grid_stride = match step {
            GridStep::Base { stride } => Some(stride),
            GridStep::Centres { .. } | GridStep::Edges { .. } => None,
        };
        let (images, receivers) = (&resources.images, &resources.receivers);
        context.submit(|recorder| {
            predict::predict(
                recorder, context, gbuffer, images, receivers, step, criteria,
            )?;
            receivers::list(recorder, context, gbuffer, receivers, grid_stride)?;
            if let Some(counts) = &resources.counts {
                counts.count(recorder, context, gbuffer, images, receivers, criteria)?;
            }
            Ok(())
        })
    }

    /// Gathers at the receivers and scatters the results to their pixels.
    fn gather(
        &mut self,
        resources: &RefinementResources,
        step: usize,
        (attempt, samples_each): (u32, u32),
        criteria: RefinementCriteria,
    ) -> Result<()> {
        let (context, gbuffer) = (self.context, self.gbuffer);
        let RefinementResources {
            images,
            receivers,
            counts,
            ..
        } = resources;
        let ranges = receivers.ranges()?;
        let total: u32 = ranges.iter().map(|range| range.count).sum();
        self.gathered_pixels += total;
        let pass = self.gatherer.pass();
        let most = match counts {
            Some(_) => LightRaySets::max_receivers(samples_each).min(resources.max_results),
            None => resources.max_results,
        };
        let parts = ranges.into_iter().flat_map(|range| range.split(most));
        for (part, range) in parts.enumerate() {
            let samples = counts.as_ref().map(|counts| Samples {
                counts,
                seed: 0,
                light_rays: LightRaySets {
                    // Different from the seeds of other parts, steps and attempts.
                    seed: part as u32 + ((step as u32 + (attempt << 4)) << 16),
                    gathered_for: GatheredFor::Image,
                    samples: samples_each,
                    set_count: 1,
                },
            });
            let results = Results {
                buffer: &resources.results,
                first: 0,
            };
            let progress = &mut *self.progress;
            let mut proceed = |share: f64| {
                let done = f64::from(range.first) + share * f64::from(range.count);
                let of_step = done / f64::from(total.max(1));
                let steps = resources.steps.len() as f64;
                progress.report_attempt(pass, (step as f64 + of_step) / steps)
            };
            self.gatherer
                .gather((gbuffer, receivers, range), results, samples, &mut proceed)?;
            context.record(|recorder| {
                let receivers = (receivers, range);
                let results = (&resources.results, counts.as_ref());
                scatter::scatter(
                    recorder, context, gbuffer, images, receivers, results, criteria,
                )
            })?;
        }
        Ok(())
    }
}
