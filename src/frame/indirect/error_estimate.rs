//! Statistics: the error of an image, from gathers at a sample of its pixels.

use super::refine::Refiner;
use crate::{
    Result,
    passes::{
        error_estimate,
        gatherer::{Results, Samples},
        receivers::{self, ReceiverRange, Receivers},
    },
    vulkan::{Buffer, BufferUse},
};

/// Pixels of the sample.
const SAMPLE_PIXELS: u32 = 1024;
/// The noise of a gather falls with this power of its samples (measured: 0.68 to 0.77).
const NOISE_RATE: f64 = 0.72;
/// The variance of a gather over its sum of squared differences, which is that of points at random, falls with this power of
/// their number (measured: 0.1 to 0.5, once below 0).
const EVENNESS_RATE: f64 = 0.2;
/// Seeds of the estimates, which are not those of images.
const FIRST_SEED: u32 = 0x5eed_0000;

/// Sums over the pixels of a sample and their bands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ErrorEstimate {
    /// Σ(x − t)², Σt², and Σσ² of one gather's noise. The first two without noise but for its scatter.
    pub error: f64,
    pub signal: f64,
    pub noise: f64,
    /// Of one gather.
    pub squared_differences: f64,
    /// Of `error`, from how it scatters over the pixels.
    pub standard_error: f64,
    /// Of a gather.
    pub samples: u32,
    pub pixel_count: u32,
}

impl ErrorEstimate {
    /// No light was found.
    pub fn is_dark(&self) -> bool {
        self.signal <= 0.0
    }

    /// Root mean square of the image's radiance, W/sr/m².
    pub fn radiance(&self) -> f64 {
        (self.signal / (3.0 * f64::from(self.pixel_count))).sqrt()
    }

    /// relRMSE. Not below its own standard error: few pixels may show none by chance.
    pub fn relative_error(&self) -> f64 {
        (self.error.max(self.standard_error) / self.signal).sqrt()
    }

    /// Variance of a gather with so many samples over its sum of squared differences.
    pub fn variance_scale(&self, samples: u32) -> f64 {
        let fewer = f64::from(self.samples) / f64::from(samples);
        self.noise / self.squared_differences.max(f64::MIN_POSITIVE) * fewer.powf(EVENNESS_RATE)
    }

    /// Samples of a gather whose noise is this, relative to the signal.
    pub fn samples_for(&self, relative_noise: f64) -> f64 {
        let own_noise = (self.noise / self.signal).sqrt();
        f64::from(self.samples) * (own_noise / relative_noise).powf(1.0 / NOISE_RATE)
    }
}

/// Pixels that are gathered to estimate the image's error, with room for their results.
pub(super) struct PixelSample {
    receivers: Receivers,
    ranges: [ReceiverRange; 2],
    pub count: u32,
    /// Two gathers, or one that is exact.
    results: Buffer,
    is_exact: bool,
}

impl PixelSample {
    pub fn new(refiner: &Refiner) -> Result<PixelSample> {
        let (context, gbuffer) = (refiner.context, refiner.gbuffer);
        let resolution_px = context.plan.resolution_px;
        let pixel_count: u64 = resolution_px.map(u64::from).iter().product();
        let mut requested = SAMPLE_PIXELS;
        loop {
            let pixels = scattered(resolution_px, requested);
            let receivers = Receivers::with_candidates(context.device, &pixels)?;
            context.submit(|r| receivers::list(r, context, gbuffer, &receivers, None))?;
            let ranges = receivers.ranges()?;
            let count = ranges.iter().map(|range| range.count).sum();
            // Where little of the image shows a surface, more places are looked at.
            if count >= SAMPLE_PIXELS / 4 || u64::from(requested) >= pixel_count {
                return Ok(PixelSample {
                    receivers,
                    ranges,
                    count,
                    results: Results::room(context.device, 2 * count)?,
                    is_exact: false,
                });
            }
            requested = requested.saturating_mul(4);
        }
    }

    /// Compares the image with gathers of the sample: two with samples of their own, or the one that is exact. `fraction` of the
    /// attempt is done meanwhile.
    pub fn estimate(
        &mut self,
        refiner: &mut Refiner,
        samples: u32,
        fraction: f64,
    ) -> Result<ErrorEstimate> {
        let (context, count) = (refiner.context, self.count);
        let gathers = match (refiner.gatherer.is_exact(), self.is_exact) {
            (false, _) => 2,
            (true, false) => 1,
            (true, true) => 0,
        };
        let progress = &mut *refiner.progress;
        let mut proceed = |_| progress.report_attempt("error_estimate", fraction);
        for gather in 0..gathers {
            let samples = Samples {
                count: samples,
                // Also other than those of other estimates.
                seed: FIRST_SEED + 2 * samples + gather,
            };
            for range in self.ranges {
                let results = Results {
                    buffer: &self.results,
                    first: gather * count + range.first,
                };
                let receivers = (&self.receivers, range);
                refiner
                    .gatherer
                    .gather(receivers, results, samples, &mut proceed)?;
            }
        }
        self.is_exact = refiner.gatherer.is_exact();
        let bytes = u64::from(count) * size_of::<[f32; 4]>() as u64;
        let estimates = Buffer::new(
            context.device,
            "error estimates",
            bytes,
            BufferUse::Readback,
        )?;
        let second_result = if self.is_exact { 0 } else { count };
        context.submit(|recorder| {
            error_estimate::compare(
                recorder,
                context,
                refiner.gbuffer,
                refiner.indirect_radiance,
                &self.receivers,
                (&self.results, second_result),
                (&estimates, count),
            )
        })?;
        let mut sum = ErrorEstimate {
            samples: samples.max(1),
            pixel_count: count,
            ..ErrorEstimate::default()
        };
        let mut squares = 0.0;
        for &[error, signal, noise, differences] in estimates.mapped::<[f32; 4]>(count as usize)? {
            sum.error += f64::from(error);
            sum.signal += f64::from(signal);
            sum.noise += 0.5 * f64::from(noise);
            sum.squared_differences += 0.5 * f64::from(differences);
            squares += f64::from(error).powi(2);
        }
        let mean_square = sum.error * sum.error / f64::from(count.max(1));
        sum.standard_error = (squares - mean_square).max(0.0).sqrt();
        Ok(sum)
    }
}

/// About `count` pixels, one at a place of its own in each cell of a grid over the image; as column + 65536 · row.
fn scattered([width, height]: [u32; 2], count: u32) -> Vec<u32> {
    let pixels = f64::from(width) * f64::from(height);
    let edge = (pixels / f64::from(count)).sqrt().max(1.0);
    let [columns, rows] = [width, height].map(|size| (f64::from(size) / edge).ceil() as u32);
    let mut chosen = Vec::new();
    for cell in 0..columns * rows {
        let random = |salt: u32| {
            // PCG hash (Jarzynski & Olano 2020).
            let state = (2 * cell + salt)
                .wrapping_mul(747_796_405)
                .wrapping_add(2_891_336_453);
            let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
            f64::from((word >> 22) ^ word) / 4_294_967_296.0
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
            let chosen = scattered(size, SAMPLE_PIXELS);
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
