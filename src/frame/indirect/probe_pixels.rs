//! Probe pixels: a sample of the image's pixels, gathered separately from the image. Pilots use it, and the image's error is estimated from it.

use std::collections::HashMap;

use super::{
    error_estimate::{ErrorEstimate, PixelEstimate},
    image_estimate::{ImageEstimate, RangeFigures, RangeTarget, settle_signals},
    limits::GROUPS,
    listed_pixels::{ListedPixels, ScatteredPixels},
    refine::Refiner,
    shared_light_rays::SharedLightRays,
};
use crate::{
    Error, Result, metrics,
    passes::{
        cost::{FIRST_ESTIMATE, FURTHER_ESTIMATES},
        error_estimate::{self, Comparison, ESTIMATE_VECTORS, vectors_of_receiver},
        gatherer::{GatheredFor, LightRaySets, Results, Samples},
        modulation::USUAL_TURNING_SHARE,
        receivers::{ListedReceivers, ReceiverRange, Receivers},
        refinement::{RefinementCriteria, RefinementImages},
        sample_counts::{PACKET_SAMPLES, SampleCounts},
    },
    scene::{ErrorNorm, MAX_FREQUENCIES},
    vulkan::Buffer,
};

/// Seeds of the estimates, different from those of images.
const FIRST_SEED: u32 = 0x5eed_0000;

/// Pixels that are gathered to estimate the image's error, with room for their results.
pub(super) struct ProbePixels {
    receivers: Receivers,
    /// How many pixels of the image a pixel stands for, over the mean of all. Absent: 1.
    weights: HashMap<u32, f64>,
    ranges: [ReceiverRange; 2],
    pub count: u32,
    /// Results of two gathers, or of one without noise.
    results: Buffer,
    /// Edge of the tiles that errors are relative to, pixels.
    tile_px: Option<u32>,
    /// Seed by which they were chosen.
    seed: u32,
    /// What their rays are counted as.
    counted_for: &'static str,
    /// Number of their gathers so far.
    gathers: u32,
    /// Counts of the gathers that the image is compared with; `None` if gathers have no noise.
    counts: Option<SampleCounts>,
    /// What the device has found out for the last estimate, after the next submission.
    estimates: Option<Buffer>,
}

impl ProbePixels {
    /// Chooses about `at_least` pixels evenly. Another `seed` gives other pixels.
    pub fn new(
        refiner: &Refiner,
        norm: ErrorNorm,
        at_least: u32,
        seed: u32,
    ) -> Result<ProbePixels> {
        let listed = ScatteredPixels::list(refiner, at_least, seed)?;
        refiner.context.finish()?;
        ProbePixels::scattered(refiner, norm, listed)
    }

    /// The pixels that the device has listed.
    pub fn scattered(
        refiner: &Refiner,
        norm: ErrorNorm,
        mut listed: ScatteredPixels,
    ) -> Result<ProbePixels> {
        while let Some(other) = listed.list_more(refiner)? {
            refiner.context.finish()?;
            listed = other;
        }
        ProbePixels::of(refiner, listed.receivers, HashMap::new(), norm, listed.seed)
    }

    /// The pixels of a list that the device has made, or if there is none, evenly chosen ones; with the samples that they take.
    pub fn listed(
        refiner: &Refiner,
        images: &RefinementImages,
        listed: Option<ListedPixels>,
        norm: ErrorNorm,
        criteria: RefinementCriteria,
        wanted: u32,
        seed: u32,
    ) -> Result<ProbePixels> {
        let (mut probes, counts) = match listed {
            Some(ListedPixels {
                receivers,
                counts,
                weights,
            }) => {
                let probes = ProbePixels::of(refiner, receivers, weights, norm, seed)?;
                (probes, counts)
            }
            None => {
                let probes = ProbePixels::new(refiner, norm, wanted, seed)?;
                let (context, receivers) = (refiner.context, &probes.receivers);
                let counts = SampleCounts::of_estimate(context, probes.count)?;
                let gbuffer = refiner.gbuffer;
                counts.count(context, gbuffer, images, receivers, criteria)?;
                context.finish()?;
                (probes, counts)
            }
        };
        probes.counts = Some(counts);
        Ok(probes)
    }

    fn of(
        refiner: &Refiner,
        receivers: Receivers,
        weights: HashMap<u32, f64>,
        norm: ErrorNorm,
        seed: u32,
    ) -> Result<ProbePixels> {
        let context = refiner.context;
        let ranges = receivers.ranges()?;
        let count: u32 = ranges.iter().map(|range| range.count).sum();
        Ok(ProbePixels {
            receivers,
            weights,
            ranges,
            count,
            results: Results::room(context.device, context.plan, 2 * count)?,
            tile_px: tile_px(norm, context.plan.resolution_px),
            seed,
            counted_for: FIRST_ESTIMATE,
            gathers: 0,
            counts: None,
            estimates: None,
        })
    }

    /// Takes other samples than those that other probe pixels have taken.
    pub fn after(self, other: &ProbePixels) -> ProbePixels {
        ProbePixels {
            gathers: other.gathers,
            ..self
        }
    }

    /// Decides only whether the target is met. The number of such sets depends on chance.
    pub fn further(self) -> ProbePixels {
        ProbePixels {
            counted_for: FURTHER_ESTIMATES,
            ..self
        }
    }

    /// Estimates the light from two gathers with this many packets of samples, or from one without noise.
    pub fn pilot(
        &mut self,
        refiner: &mut Refiner,
        images: &RefinementImages,
        packets: u32,
        gathered_for: [GatheredFor; 2],
    ) -> Result<ImageEstimate> {
        let counts = match refiner.gatherer.is_noiseless() {
            true => None,
            false => {
                let device = refiner.context.device;
                Some(SampleCounts::even(device, self.count, packets)?)
            }
        };
        let samples = counts.as_ref().map(|counts| GatheredWith {
            counts,
            seed: FIRST_SEED + 2 * self.gathers,
            samples: PACKET_SAMPLES * packets,
            gathered_for,
            set_count: 1,
        });
        self.gather(refiner, samples, 0.0)?;
        let estimates = self.compare(refiner, images, counts.as_ref(), packets > 0)?;
        refiner.context.finish()?;
        self.estimate_from(refiner, &estimates, packets)
    }

    /// Records the comparison of the image with two gathers that have samples of their own, or with one without noise, which is made once.
    /// `samples` is the approximate number of samples of a receiver.
    pub fn record_estimate(
        &mut self,
        refiner: &mut Refiner,
        images: &RefinementImages,
        samples: u32,
    ) -> Result<()> {
        let counts = self.counts.take();
        let with = counts.as_ref().map(|counts| GatheredWith {
            counts,
            seed: FIRST_SEED - 2 * (self.seed + 1),
            samples,
            gathered_for: [GatheredFor::Estimate; 2],
            set_count: GROUPS,
        });
        if with.is_some() || self.gathers == 0 {
            self.gather(refiner, with, 1.0)?;
        }
        self.counts = counts;
        self.record_estimate_again(refiner, images)
    }

    /// Records the comparison of the image with the gathers of the last estimate.
    pub fn record_estimate_again(
        &mut self,
        refiner: &Refiner,
        images: &RefinementImages,
    ) -> Result<()> {
        let estimates = self.compare(refiner, images, self.counts.as_ref(), false)?;
        self.estimates = Some(estimates);
        Ok(())
    }

    /// The estimate that was recorded last; valid after the submission.
    pub fn estimate(&self, refiner: &Refiner) -> Result<ImageEstimate> {
        let no_estimate = || Error::internal("a sample of pixels was not compared with the image");
        let estimates = self.estimates.as_ref().ok_or_else(no_estimate)?;
        self.estimate_from(refiner, estimates, 0)
    }

    /// Gathers twice with independent samples, or once without noise. Reports meanwhile that `fraction` of the attempt is done.
    fn gather(
        &mut self,
        refiner: &mut Refiner,
        with: Option<GatheredWith>,
        fraction: f64,
    ) -> Result<()> {
        let cost = refiner.context.cost;
        let rays_before = cost.borrow().work_of("final_gather");
        let progress = &mut *refiner.progress;
        let mut proceed = |_| progress.report_attempt("error_estimate", fraction);
        let most = with.map_or(u32::MAX, |with| LightRaySets::max_receivers(with.samples));
        let parts = self.ranges.into_iter().flat_map(|range| range.split(most));
        for gather in 0..if with.is_some() { 2 } else { 1 } {
            self.gathers += 1;
            let mut light_rays = SharedLightRays::default();
            for range in parts.clone() {
                let set = light_rays.set_for(range.count, most);
                let samples = with.map(|with| Samples {
                    counts: with.counts,
                    seed: with.seed + gather,
                    light_rays: LightRaySets {
                        // Different from the seeds of any other gather, and of its other sets.
                        seed: FIRST_SEED + 1000 * self.seed + self.gathers + (set << 16),
                        gathered_for: with.gathered_for[gather as usize],
                        samples: with.samples,
                        receivers: self.count,
                        set_count: with.set_count,
                    },
                });
                let results = Results {
                    buffer: &self.results,
                    first: gather * self.count + range.first,
                };
                let receivers = ListedReceivers {
                    gbuffer: refiner.gbuffer,
                    list: &self.receivers,
                    range,
                };
                refiner
                    .gatherer
                    .gather(receivers, results, samples, &mut proceed)?;
            }
        }
        let rays = cost.borrow().work_of("final_gather") - rays_before;
        cost.borrow_mut().count_work(self.counted_for, rays);
        Ok(())
    }

    /// Records the comparison of the image with what was gathered, into a buffer that the host can read after the submission.
    fn compare(
        &self,
        refiner: &Refiner,
        images: &RefinementImages,
        counts: Option<&SampleCounts>,
        is_pilot: bool,
    ) -> Result<Buffer> {
        let comparison = Comparison {
            gbuffer: refiner.gbuffer,
            images,
            indirect_radiance: refiner.indirect_radiance,
            indirect_phasors: refiner.indirect_phasors,
            direct_phasors: refiner.direct_phasors,
            is_pilot,
            receivers: &self.receivers,
            receiver_count: self.count,
            counts,
            results: &self.results,
        };
        error_estimate::compare(refiner.context, comparison)
    }

    /// The estimate of a comparison. `packets` are those of a pilot's gather; 0: it is of the image.
    fn estimate_from(
        &self,
        refiner: &Refiner,
        estimates: &Buffer,
        packets: u32,
    ) -> Result<ImageEstimate> {
        let context = refiner.context;
        let frequency_count = context
            .plan
            .bounced_tof()
            .map_or(0, |tof| tof.frequency_count);
        let vectors = vectors_of_receiver(context.plan);
        let total = self.count as usize * vectors;
        let estimates = estimates.mapped::<[f32; 4]>(total)?;
        let estimate = |pixels: &[_], tile_px| ErrorEstimate::new(pixels, packets, GROUPS, tile_px);
        let pixels = || estimates.chunks_exact(vectors);
        let of_light = pixels().map(|pixel| {
            let [column, row, ..] = pixel[1].map(|value| value as u32);
            let weight = self.weights.get(&(column + (row << 16)));
            PixelEstimate {
                weight: weight.copied().unwrap_or(1.0),
                sums: pixel[0],
                pixel: pixel[1],
                of_image: pixel[2],
            }
        });
        let of_light: Vec<_> = of_light.collect();
        let light = estimate(&of_light, self.tile_px);
        // Light of all bands is weighted as if they were equally bright.
        let tof = context.scene.tof.as_ref();
        let seen = tof.map_or(0.0, |tof| tof.weighted([light.radiance; 3]));
        let mut range = RangeTarget::of(context.plan).map(|target| RangeFigures {
            target,
            mean_squares: [0.0; MAX_FREQUENCIES],
            turning_shares: [USUAL_TURNING_SHARE; MAX_FREQUENCIES],
        });
        let phasors = (0..frequency_count as usize).map(|frequency| {
            let of_frequency = pixels().zip(&of_light).map(|(pixel, &of_light)| {
                // The resolve pass expects errors of light only.
                let [column, row, _, packets] = pixel[1];
                PixelEstimate {
                    sums: pixel[ESTIMATE_VECTORS + frequency],
                    pixel: [column, row, 0.0, packets],
                    ..of_light
                }
            });
            let mut of_frequency: Vec<_> = of_frequency.collect();
            let found = match &mut range {
                Some(range) => {
                    range.mean_squares[frequency] = range.target.settle(&mut of_frequency);
                    let mut found = estimate(&of_frequency, None);
                    // Gathers of estimates are of different packets.
                    if packets > 0 {
                        let share = found.match_evenness(&light);
                        range.turning_shares[frequency] *= share as f32;
                    }
                    found
                }
                None => {
                    settle_signals(&mut of_frequency, seen);
                    estimate(&of_frequency, self.tile_px)
                }
            };
            found.with_samples_of(&light)
        });
        let phasors = phasors.collect();
        Ok(ImageEstimate::new(light, phasors, range))
    }
}

/// The samples of two gathers.
#[derive(Clone, Copy)]
struct GatheredWith<'s> {
    counts: &'s SampleCounts,
    /// Seed of the first gather.
    seed: u32,
    /// Approximate number of samples of a receiver.
    samples: u32,
    gathered_for: [GatheredFor; 2],
    set_count: u32,
}

/// Edge of the tiles that errors are relative to; `None`: they are relative to the whole image.
pub(super) fn tile_px(norm: ErrorNorm, resolution_px: [u32; 2]) -> Option<u32> {
    match norm {
        ErrorNorm::Image => None,
        ErrorNorm::Local => Some(metrics::local_tile_px(resolution_px)),
    }
}
