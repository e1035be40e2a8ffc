//! One attempt at the image: refines a coarse grid of pixels to every pixel (after Nichols & Wyman 2009).
//!
//! A gathered pixel shows how wrong its prediction from coarser pixels was. Where the prediction was good, the finer pixels around it
//! are interpolated. If the grid's stride is 1, every pixel is gathered.

use super::{
    limits::{self, Limits, rays_of_pixel},
    resources::RefinementResources,
    shared_light_rays::SharedLightRays,
};
use crate::{
    Result,
    frame::ProgressReport,
    metrics::LEAST_RANGE_SIGNAL,
    passes::{
        Context,
        gatherer::{GatheredFor, Gatherer, LightRaySets, Results, Samples},
        gbuffer::GBuffer,
        modulation, predict, range_weights,
        receivers::{self, ListedReceivers},
        refinement::RefinementCriteria,
        resolve, scatter, smooth, smooth_residuals, stderr,
    },
    plan::GridStep,
    scene::MAX_FREQUENCIES,
    vulkan::Image,
};

/// Steps whose pixels are gathered for any light. The coarsest grid and the first refinement between its pixels show what to
/// expect.
const GRID_STEPS: usize = 3;
/// If a step does not fit the limits, its tolerance and the inverse of its samples grow by these factors, unless it takes so many times what
/// fits. In the end every pixel is interpolated.
const RELAXATIONS: [f64; 3] = [1.0, 2.0, 6.0];
const MAX_EXCESS: f64 = 5.0;
/// Least |Z| of a pixel over the root mean square of |Z|, before its bounce is known.
const LEAST_FIRST_SIGNAL: f64 = 0.1;

/// Fills the indirect radiance from what a gatherer gathers.
pub(super) struct Refiner<'a, 'p> {
    pub context: &'a Context<'a>,
    pub gbuffer: &'a GBuffer,
    pub indirect_radiance: &'a Image,
    pub indirect_phasors: Option<&'a Image>,
    pub direct_phasors: Option<&'a Image>,
    pub indirect_stderr: Option<&'a Image>,
    /// What the last complete attempt gathered; only if pixels are averaged over their area.
    pub gathered: Option<&'a Image>,
    /// Approximate number of samples of a gather in that attempt; `None` if there was none.
    pub samples_of_pixel: Option<u32>,
    /// Pixels that the last attempt gathered.
    pub gathered_pixels: u32,
    /// Whether the light over that of VPLs without occlusion is smoothed.
    pub smooths_ratio: bool,
    pub light_rays: SharedLightRays,
    pub gatherer: &'a mut dyn Gatherer,
    pub progress: &'a mut ProgressReport<'p>,
}

/// Which pixels of a step are listed for the gather, of those that should be.
#[derive(PartialEq)]
enum Listed {
    All,
    Fewer,
    None,
}

/// One attempt at the image.
pub(super) struct Attempt<'l> {
    /// Approximate number of samples of a gather.
    pub samples: u32,
    pub criteria: RefinementCriteria,
    pub number: u32,
    pub limits: &'l Limits<'l>,
    /// Rays to leave for the estimate.
    pub reserve: f64,
}

/// A step has light rays of its own if all its rays are this many times as many.
const OWN_LIGHT_RAYS: f64 = 16.0;

impl Refiner<'_, '_> {
    /// Fills the layer of standard errors, if it was requested.
    pub fn fill_stderr(&self, factors: [f64; 2]) -> Result<()> {
        let Some(layer) = self.indirect_stderr else {
            return Ok(());
        };
        stderr::fill(self.context, self.indirect_radiance, layer, factors)
    }

    /// Allocates the resources. No pixel has samples. The device lists those of the coarsest grid with the next submission.
    pub fn resources(&self, coarsest_stride: u32) -> Result<RefinementResources> {
        let Context { device, plan, .. } = *self.context;
        let is_noiseless = self.gatherer.is_noiseless();
        let mut resources = RefinementResources::new(device, plan, coarsest_stride, is_noiseless)?;
        let turning_shares = [modulation::USUAL_TURNING_SHARE; MAX_FREQUENCIES];
        self.scale_errors(&mut resources, [1.0; MAX_FREQUENCIES], turning_shares)?;
        self.context.record(|recorder| {
            resources.images.clear_samples(recorder);
            Ok(())
        })?;
        self.list_candidates(&mut resources, 0)?;
        Ok(resources)
    }

    /// Scales errors of Z to errors of light: one factor per frequency of time of flight. `turning_shares` are for a target error of range.
    pub fn scale_errors(
        &self,
        resources: &mut RefinementResources,
        factors: [f32; MAX_FREQUENCIES],
        turning_shares: [f32; MAX_FREQUENCIES],
    ) -> Result<()> {
        let Context {
            device,
            scene,
            space,
            ..
        } = *self.context;
        resources.images.modulation =
            modulation::upload(device, scene, space, factors, turning_shares)?;
        Ok(())
    }

    /// If the target is an error of range, finds what errors of Z are worth. `squares` are the mean |Z|² of each frequency.
    pub fn weigh_ranges(
        &self,
        resources: &RefinementResources,
        squares: Option<[f64; MAX_FREQUENCIES]>,
        is_first: bool,
    ) -> Result<()> {
        let (Some(squares), Some(direct)) = (squares, self.direct_phasors) else {
            return Ok(());
        };
        let least = match is_first {
            true => LEAST_FIRST_SIGNAL,
            false => LEAST_RANGE_SIGNAL,
        };
        let least_squares = squares.map(|square| (least.powi(2) * square) as f32);
        let indirect = self.indirect_phasors.filter(|_| !is_first);
        let (context, images) = (self.context, &resources.images);
        range_weights::fill(context, images, direct, indirect, least_squares)
    }

    /// Gathers and interpolates all pixels. Samples of earlier attempts still count; gathers without noise are kept.
    ///
    /// Returns whether all samples were taken. A step that does not fit the limits gathers what fits, and the others are interpolated.
    pub fn refine(
        &mut self,
        resources: &mut RefinementResources,
        attempt: &Attempt,
    ) -> Result<bool> {
        let criteria = attempt.criteria;
        let context = self.context;
        let is_first = attempt.number == 0;
        let starts_anew = is_first || !self.gatherer.is_noiseless();
        if starts_anew {
            context.record(|recorder| {
                resources.images.clear(recorder);
                Ok(())
            })?;
        }
        // Every pixel of these steps is gathered.
        let grid_steps = resources.steps.len().min(GRID_STEPS);
        let mut took_all = true;
        // Pixels that had been gathered when the last grid was smoothed.
        let mut smoothed = 0;
        self.gathered_pixels = 0;
        self.light_rays = SharedLightRays::default();
        for index in usize::from(!starts_anew)..resources.steps.len() {
            let mut of_step = criteria;
            of_step.tolerance = criteria.tolerance.filter(|_| index >= grid_steps);
            let listed = self.list_what_fits(resources, index, of_step, attempt)?;
            took_all &= listed == Listed::All;
            if listed != Listed::None {
                took_all &= self.gather(resources, index, criteria, attempt, true)?;
            }
            let is_grid = index + 1 == grid_steps;
            let is_last = index + 1 == resources.steps.len();
            if is_grid || is_last && self.gathered_pixels > smoothed {
                self.smooth(resources, index, criteria)?;
                smoothed = self.gathered_pixels;
            }
        }
        self.resolve(resources, attempt.criteria)?;
        self.samples_of_pixel = Some(attempt.samples);
        Ok(took_all)
    }

    /// Lists the pixels of a step as the criteria say, or fewer of them if the limits leave no room.
    fn list_what_fits(
        &self,
        resources: &mut RefinementResources,
        step: usize,
        criteria: RefinementCriteria,
        attempt: &Attempt,
    ) -> Result<Listed> {
        let fitting = self.rays_for(attempt, step, resources);
        if fitting == f64::INFINITY {
            match (attempt.number, step) {
                (0, 0) => self.take_coarsest(resources, criteria)?,
                _ => self.list(resources, step, criteria)?,
            }
            return Ok(Listed::All);
        }
        for factor in RELAXATIONS {
            if fitting < rays_of_pixel(self.context.plan) {
                break;
            }
            self.list(resources, step, criteria.relaxed(factor))?;
            let listed = self.listed_rays(resources)?;
            if listed <= fitting {
                return Ok(match factor {
                    1.0 => Listed::All,
                    _ => Listed::Fewer,
                });
            }
            if listed > MAX_EXCESS * fitting {
                break;
            }
        }
        let criteria = criteria.without_rays();
        if attempt.number == 0 && step > 0 {
            // No pixel of the step has samples.
            self.predict(resources, step, criteria)?;
            return Ok(Listed::None);
        }
        self.list(resources, step, criteria)?;
        Ok(Listed::Fewer)
    }

    /// Rays that the limits leave for a step.
    fn rays_for(&self, attempt: &Attempt, step: usize, resources: &RefinementResources) -> f64 {
        let to_come = 1.0 - 0.5 * step as f64 / resources.steps.len() as f64;
        attempt.limits.rays_left(to_come) - attempt.reserve
    }

    /// Most rays for the receivers of the list.
    fn listed_rays(&self, resources: &RefinementResources) -> Result<f64> {
        let mut packets = 0;
        for range in resources.receivers.ranges()? {
            let counts = resources.counts.as_ref();
            let ranges = counts.map(|counts| counts.ranges(range)).transpose()?;
            let of_range = ranges.unwrap_or_default().into_iter();
            packets += of_range.map(|(first, end)| end - first).sum::<u32>();
        }
        Ok(f64::from(packets) * rays_of_pixel(self.context.plan))
    }

    fn resolve(&self, resources: &RefinementResources, criteria: RefinementCriteria) -> Result<()> {
        let (context, images) = (self.context, &resources.images);
        let (radiance, phasors) = (self.indirect_radiance, self.indirect_phasors);
        resolve::resolve(context, self.gbuffer, images, radiance, phasors, criteria)?;
        context.record(|recorder| {
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

    /// Lowers the noise on the grid that a step completes. Does nothing if gathers have no noise.
    fn smooth(
        &self,
        resources: &RefinementResources,
        step: usize,
        criteria: RefinementCriteria,
    ) -> Result<()> {
        let stride_px = resources.steps[step].completed_stride_px();
        let Some(stride_px) = stride_px.filter(|_| !self.gatherer.is_noiseless()) else {
            return Ok(());
        };
        let (context, gbuffer, images) = (self.context, self.gbuffer, &resources.images);
        let by_ratio = self.smooths_ratio;
        smooth::smooth(context, gbuffer, images, stride_px, by_ratio, criteria)?;
        smooth_residuals::smooth(context, gbuffer, images, stride_px)
    }

    /// Interpolates the pixels of a step that may be interpolated; the others become candidates.
    fn predict(
        &self,
        resources: &RefinementResources,
        step: usize,
        criteria: RefinementCriteria,
    ) -> Result<()> {
        let RefinementResources {
            images, receivers, ..
        } = resources;
        let step = resources.steps[step];
        let (context, gbuffer) = (self.context, self.gbuffer);
        predict::predict(context, gbuffer, images, receivers, step, criteria)
    }

    /// Lists the candidates of a step that show a surface.
    fn list_candidates(&self, resources: &mut RefinementResources, step: usize) -> Result<()> {
        let grid_step = resources.steps[step];
        let count = grid_step.pixel_count(self.context.plan.resolution_px);
        resources.receivers.set_candidate_count(count)?;
        let grid_stride = match grid_step {
            GridStep::Base { stride } => Some(stride),
            GridStep::Centres { .. } | GridStep::Edges { .. } => None,
        };
        let (context, gbuffer) = (self.context, self.gbuffer);
        receivers::list(context, gbuffer, &resources.receivers, grid_stride)
    }

    /// Interpolates the pixels of a step that may be interpolated, and lists the others with the samples that they take.
    fn list(
        &self,
        resources: &mut RefinementResources,
        step: usize,
        criteria: RefinementCriteria,
    ) -> Result<()> {
        let (context, gbuffer) = (self.context, self.gbuffer);
        self.predict(resources, step, criteria)?;
        self.list_candidates(resources, step)?;
        let (images, receivers) = (&resources.images, &resources.receivers);
        if let Some(counts) = &resources.counts {
            counts.count(context, gbuffer, images, receivers, criteria)?;
        }
        context.finish()
    }

    /// The same for the coarsest grid of the first attempt, without waiting: its pixels are listed, and nothing is known of any.
    fn take_coarsest(
        &self,
        resources: &mut RefinementResources,
        criteria: RefinementCriteria,
    ) -> Result<()> {
        let listed = resources.receivers.ranges()?;
        let count = listed.iter().map(|range| range.count).sum();
        let packets = criteria.allocation.packets_of_unknown();
        match &mut resources.counts {
            Some(counts) => counts.set_even(self.context, count, packets),
            None => Ok(()),
        }
    }

    /// Gathers at the receivers and scatters the results to their pixels. Returns whether all fit the limits. Those that do not keep their
    /// predictions.
    fn gather(
        &mut self,
        resources: &mut RefinementResources,
        step: usize,
        criteria: RefinementCriteria,
        attempt: &Attempt,
        may_stop: bool,
    ) -> Result<bool> {
        let (context, gbuffer) = (self.context, self.gbuffer);
        let RefinementResources {
            images,
            receivers,
            counts,
            ..
        } = &*resources;
        let ranges = receivers.ranges()?;
        let total: u32 = ranges.iter().map(|range| range.count).sum();
        let samples_each = attempt.samples;
        let from_lights = limits::light_rays_of_image(self.context.plan, samples_each);
        if self.listed_rays(resources)? >= OWN_LIGHT_RAYS * from_lights {
            self.light_rays.begin();
        }
        let pass = self.gatherer.pass();
        let most = match counts {
            Some(_) => LightRaySets::max_receivers(samples_each).min(resources.max_results),
            None => resources.max_results,
        };
        for range in ranges.into_iter().flat_map(|range| range.split(most)) {
            if may_stop && self.rays_for(attempt, step, resources) <= 0.0 {
                self.list(resources, step, criteria.without_rays())?;
                self.gather(resources, step, criteria, attempt, false)?;
                return Ok(false);
            }
            self.gathered_pixels += range.count;
            let set = self.light_rays.set_for(range.count, most);
            let samples = counts.as_ref().map(|counts| Samples {
                counts,
                seed: 0,
                light_rays: LightRaySets {
                    // Different from the seeds of other sets and attempts.
                    seed: set + (attempt.number << 20),
                    gathered_for: GatheredFor::Image,
                    samples: samples_each,
                    receivers: most,
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
            let at = ListedReceivers {
                gbuffer,
                list: receivers,
                range,
            };
            self.gatherer.gather(at, results, samples, &mut proceed)?;
            let (results, counts) = (&resources.results, counts.as_ref());
            scatter::scatter(context, images, at, results, counts, criteria)?;
        }
        Ok(true)
    }
}
