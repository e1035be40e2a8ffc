//! A sample of the image's pixels, gathered separately from the image. Pilots use it, and the image's error is estimated from it.

use super::{
    error_estimate::ErrorEstimate,
    image_estimate::{ImageEstimate, settle_signals},
    refine::Refiner,
};
use crate::{
    Result, metrics,
    passes::{
        cost::{FIRST_ESTIMATE, FURTHER_ESTIMATES},
        error_estimate::{self, ESTIMATE_VECTORS},
        gatherer::{GatheredFor, LightRaySets, Results, Samples},
        random,
        receivers::{self, ReceiverRange, Receivers},
        refinement::{RefinementCriteria, RefinementImages},
        sample_counts::{PACKET_SAMPLES, SampleCounts},
    },
    scene::{ErrorNorm, MAX_FREQUENCIES},
    vulkan::{Buffer, BufferUse},
};

/// Groups of pixels that have no samples in common.
const GROUPS: u32 = 16;
/// Pixels of the sample.
const SAMPLE_PIXELS: u32 = 1024;
/// Seeds of the estimates, different from those of images.
const FIRST_SEED: u32 = 0x5eed_0000;

/// Pixels that are gathered to estimate the image's error, with room for their results.
pub(super) struct PixelSample {
    receivers: Receivers,
    ranges: [ReceiverRange; 2],
    pub count: u32,
    /// Results of two gathers, or of one exact gather.
    results: Buffer,
    /// Edge of the tiles that errors are relative to, pixels.
    tile_px: Option<u32>,
    /// Seed of this sample of pixels.
    seed: u32,
    /// Number of gathers of this sample so far.
    gathers: u32,
    /// Counts of the gathers that the image was compared with; `None` if gathers are exact.
    counts: Option<SampleCounts>,
}

impl PixelSample {
    /// Chooses the pixels. Another `seed` gives other pixels.
    pub fn new(refiner: &Refiner, norm: ErrorNorm, seed: u32) -> Result<PixelSample> {
        let (context, gbuffer) = (refiner.context, refiner.gbuffer);
        let resolution_px = context.plan.resolution_px;
        let pixel_count: u64 = resolution_px.map(u64::from).iter().product();
        let mut requested = SAMPLE_PIXELS;
        let mut copies = 1;
        loop {
            let pixels = scattered(resolution_px, requested, seed ^ random::hash(context.seed));
            let receivers = Receivers::with_candidates(context.device, &pixels.repeat(copies))?;
            context.submit(|r| receivers::list(r, context, gbuffer, &receivers, None))?;
            let ranges = receivers.ranges()?;
            let count: u32 = ranges.iter().map(|range| range.count).sum();
            let is_all = u64::from(requested) >= pixel_count;
            if is_all && (1..GROUPS).contains(&count) {
                // Repeat the pixels, so that each group has some.
                copies = GROUPS.div_ceil(count) as usize;
                continue;
            }
            // If little of the image shows a surface, more places are tried.
            if count >= SAMPLE_PIXELS / 4 || is_all {
                return Ok(PixelSample {
                    receivers,
                    ranges,
                    count,
                    results: Results::room(context.device, context.plan, 2 * count)?,
                    tile_px: match norm {
                        ErrorNorm::Image => None,
                        ErrorNorm::Local => Some(metrics::local_tile_px(resolution_px)),
                    },
                    seed,
                    gathers: 0,
                    counts: None,
                });
            }
            requested = requested.saturating_mul(4);
        }
    }

    /// Estimates the light from two gathers with this many packets of samples, or from one exact gather.
    pub fn pilot(
        &mut self,
        refiner: &mut Refiner,
        images: &RefinementImages,
        (packets, gathered_for): (u32, [GatheredFor; 2]),
    ) -> Result<ImageEstimate> {
        if refiner.gatherer.is_exact() {
            self.gather(refiner, None, 0.0)?;
        } else {
            let counts = SampleCounts::even(refiner.context, self.count, packets)?;
            let samples = GatheredWith {
                counts: &counts,
                seed: FIRST_SEED + 2 * self.gathers,
                samples: PACKET_SAMPLES * packets,
                gathered_for,
                set_count: 1,
                adds: false,
            };
            self.gather(refiner, Some(samples), 0.0)?;
            return self.compare(refiner, images, Some(&counts), packets);
        }
        self.compare(refiner, images, None, 0)
    }

    /// Compares the image with two gathers, or with one exact gather. The two have samples of their own, and continue from estimate to
    /// estimate like the image's. `samples` is the approximate number of samples of a receiver.
    pub fn estimate(
        &mut self,
        refiner: &mut Refiner,
        images: &RefinementImages,
        criteria: RefinementCriteria,
        samples: u32,
    ) -> Result<ImageEstimate> {
        let context = refiner.context;
        if refiner.gatherer.is_exact() {
            if self.gathers == 0 {
                self.gather(refiner, None, 1.0)?;
            }
            return self.compare(refiner, images, None, 0);
        }
        let adds = self.counts.is_some();
        let counts = match self.counts.take() {
            Some(counts) => counts,
            None => SampleCounts::even(context, self.count, 0)?,
        };
        let receivers = &self.receivers;
        context.submit(|recorder| {
            counts.count(
                recorder,
                context,
                refiner.gbuffer,
                images,
                receivers,
                criteria,
            )
        })?;
        let samples = GatheredWith {
            counts: &counts,
            // The same seed in each estimate, so that the gathers continue.
            seed: FIRST_SEED - 2 * (self.seed + 1),
            samples,
            gathered_for: [GatheredFor::Estimate; 2],
            set_count: GROUPS,
            adds,
        };
        self.gather(refiner, Some(samples), 1.0)?;
        let estimate = self.compare(refiner, images, Some(&counts), 0);
        self.counts = Some(counts);
        estimate
    }

    /// Compares the image with the gathers of the last estimate.
    pub fn estimate_again(
        &self,
        refiner: &Refiner,
        images: &RefinementImages,
    ) -> Result<ImageEstimate> {
        self.compare(refiner, images, self.counts.as_ref(), 0)
    }

    /// Gathers twice with independent samples, or once exactly. Reports meanwhile that `fraction` of the attempt is done.
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
            for (part, range) in parts.clone().enumerate() {
                let samples = with.map(|with| Samples {
                    counts: with.counts,
                    seed: with.seed + gather,
                    light_rays: LightRaySets {
                        // Different from the seeds of any other gather, and of its other parts.
                        seed: FIRST_SEED + 1000 * self.seed + self.gathers + ((part as u32) << 16),
                        gathered_for: with.gathered_for[gather as usize],
                        samples: with.samples,
                        set_count: with.set_count,
                    },
                });
                let results = Results {
                    buffer: &self.results,
                    first: gather * self.count + range.first,
                    adds: with.is_some_and(|with| with.adds),
                };
                let receivers = (refiner.gbuffer, &self.receivers, range);
                refiner
                    .gatherer
                    .gather(receivers, results, samples, &mut proceed)?;
            }
        }
        let rays = cost.borrow().work_of("final_gather") - rays_before;
        let is_first = self.seed == 0;
        let counted_for = if is_first {
            FIRST_ESTIMATE
        } else {
            FURTHER_ESTIMATES
        };
        cost.borrow_mut().count_work(counted_for, rays);
        Ok(())
    }

    fn compare(
        &self,
        refiner: &Refiner,
        images: &RefinementImages,
        counts: Option<&SampleCounts>,
        packets: u32,
    ) -> Result<ImageEstimate> {
        let (context, count) = (refiner.context, self.count);
        let frequency_count = context
            .plan
            .bounced_tof()
            .map_or(0, |tof| tof.frequency_count);
        let vectors = match frequency_count {
            0 => ESTIMATE_VECTORS,
            _ => ESTIMATE_VECTORS + MAX_FREQUENCIES,
        };
        let total = count as usize * vectors;
        let bytes = (total * size_of::<[f32; 4]>()) as u64;
        let estimates = Buffer::new(
            context.device,
            "error estimates",
            bytes,
            BufferUse::Readback,
        )?;
        let second_result = if counts.is_some() { count } else { 0 };
        context.submit(|recorder| {
            error_estimate::compare(
                recorder,
                context,
                refiner.gbuffer,
                (refiner.indirect_radiance, refiner.indirect_phasors),
                (images, &self.receivers, counts),
                (&self.results, second_result),
                (&estimates, count),
            )
        })?;
        let estimates = estimates.mapped::<[f32; 4]>(total)?;
        let estimate = |pixels: &[_]| ErrorEstimate::new(pixels, packets, GROUPS, self.tile_px);
        let pixels = || estimates.chunks_exact(vectors);
        let of_light = pixels().map(|pixel| [pixel[0], pixel[1], pixel[2]]);
        let light = estimate(&of_light.collect::<Vec<_>>());
        // Light of all bands is weighted as if they were equally bright.
        let tof = context.scene.tof.as_ref();
        let seen = tof.map_or(0.0, |tof| tof.weighted([light.radiance; 3]));
        let phasors = (0..frequency_count as usize).map(|frequency| {
            let of_frequency = pixels().map(|pixel| {
                // The resolve pass expects errors of light only.
                let [column, row, _, packets] = pixel[1];
                [
                    pixel[ESTIMATE_VECTORS + frequency],
                    [column, row, 0.0, packets],
                    pixel[2],
                ]
            });
            let mut of_frequency: Vec<_> = of_frequency.collect();
            settle_signals(&mut of_frequency, seen);
            estimate(&of_frequency)
        });
        let phasors = phasors.collect();
        Ok(ImageEstimate::new(light, phasors))
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
    adds: bool,
}

/// Chooses about `count` pixels, one at a random place in each cell of a grid over the image, each as column + 65536 · row.
fn scattered([width, height]: [u32; 2], count: u32, seed: u32) -> Vec<u32> {
    let pixels = f64::from(width) * f64::from(height);
    let edge = (pixels / f64::from(count)).sqrt().max(1.0);
    let [columns, rows] = [width, height].map(|size| (f64::from(size) / edge).ceil() as u32);
    let mut chosen = Vec::new();
    for cell in 0..columns * rows {
        let random = |salt: u32| {
            let word = random::hash((2 * cell + salt) ^ random::hash(seed));
            f64::from(word) / 4_294_967_296.0
        };
        let x = ((f64::from(cell % columns) + random(0)) * edge) as u32;
        let y = ((f64::from(cell / columns) + random(1)) * edge) as u32;
        if x < width && y < height {
            chosen.push(x + (y << 16));
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattered_pixels_lie_in_the_image_each_in_a_cell_of_its_own() {
        for size in [[1, 1], [2, 3], [70, 1], [96, 96], [800, 600]] {
            let chosen = scattered(size, SAMPLE_PIXELS, 0);
            let [width, height] = size;
            let inside = |&pixel: &u32| pixel & 0xffff < width && pixel >> 16 < height;
            assert!(chosen.iter().all(inside));
            let different: std::collections::BTreeSet<u32> = chosen.iter().copied().collect();
            assert_eq!(different.len(), chosen.len());
            let due = (width * height).min(SAMPLE_PIXELS) as usize;
            assert!(
                chosen.len() >= due * 9 / 10 && chosen.len() <= due * 5 / 4,
                "{size:?}: {}",
                chosen.len()
            );
        }
    }
}
