//! Statistics: the error of an image, from gathers at a sample of its pixels.

use std::collections::BTreeMap;

use super::refine::Refiner;
use crate::{
    Result, metrics,
    passes::{
        error_estimate,
        gatherer::{Results, Samples},
        random,
        receivers::{self, ReceiverRange, Receivers},
    },
    scene::ErrorNorm,
    vulkan::{Buffer, BufferUse},
};

/// Groups of pixels that have no samples in common.
const GROUPS: u32 = 16;
/// Pixels of the sample.
const SAMPLE_PIXELS: u32 = 1024;
/// The noise of a gather falls with this power of its samples (measured: 0.68 to 0.77).
const NOISE_RATE: f64 = 0.72;
/// The variance of a gather over its sum of squared differences, which is that of points at random, falls with this power of
/// their number (measured: 0.1 to 0.5, once below 0).
const EVENNESS_RATE: f64 = 0.2;
/// Fewer pixels of a kind do not tell how right the errors are that are expected of it.
const MIN_KIND_PIXELS: u32 = 64;
/// Errors over what was expected, at least: few pixels may show none by chance.
const MIN_FACTOR: f64 = 0.1;
/// Seeds of the estimates, which are not those of images.
const FIRST_SEED: u32 = 0x5eed_0000;

/// Sums over the pixels of a sample and their bands, weighted by the error norm.
#[derive(Debug, Clone, Default)]
pub(super) struct ErrorEstimate {
    /// Σ(x − t)² and Σt² of groups of pixels that have no samples in common, without noise but for its scatter.
    groups: Vec<[f64; 2]>,
    /// Of all groups.
    error: f64,
    signal: f64,
    /// Σd² and Σd³ over pixels, d being what a pixel's error is over that of the image.
    squares: f64,
    cubes: f64,
    /// Σσ² of one gather's noise.
    noise: f64,
    /// Of one gather.
    squared_differences: f64,
    /// Of gathered and of interpolated pixels.
    expected: [ExpectedError; 2],
    /// Root mean square of the radiance, W/sr/m², whatever the norm.
    pub radiance: f64,
    /// Of a gather.
    samples: u32,
}

/// How right the errors are that the resolve pass expects.
#[derive(Debug, Clone, Copy, Default)]
struct ExpectedError {
    /// Sums of the squares of errors, and of what was expected of them. Not of their quotients: few pixels of which too little was
    /// expected would decide on all.
    error: f64,
    expected: f64,
    pixels: u32,
}

impl std::ops::Add for ExpectedError {
    type Output = ExpectedError;

    fn add(self, other: ExpectedError) -> ExpectedError {
        ExpectedError {
            error: self.error + other.error,
            expected: self.expected + other.expected,
            pixels: self.pixels + other.pixels,
        }
    }
}

impl ErrorEstimate {
    /// No light was found.
    pub fn is_dark(&self) -> bool {
        self.signal <= 0.0
    }

    /// relRMSE. Not below its own standard error: few pixels may show none by chance.
    pub fn relative_error(&self) -> f64 {
        let least = self.standard_error();
        (self.error / self.signal).max(least).sqrt()
    }

    /// What the relRMSE is below with a confidence of 95 %; infinite where too few pixels tell.
    pub fn upper_bound(&self) -> f64 {
        let freedom = self.lit_groups().count() as f64 - 1.0;
        if freedom < 1.0 {
            return f64::INFINITY;
        }
        // Few pixels may hold most of the error: how skewed it is moves the quantile (Johnson 1978).
        let quantile = student_quantile_95(freedom);
        let skewness = self.cubes / self.squares.powf(1.5).max(f64::MIN_POSITIVE);
        let quantile = quantile + skewness.max(0.0) / 6.0 * (1.0 + 2.0 * quantile.powi(2));
        (self.error / self.signal + quantile * self.standard_error())
            .max(0.0)
            .sqrt()
    }

    /// Of the square of the relRMSE: the jackknife over the groups.
    fn standard_error(&self) -> f64 {
        let count = self.lit_groups().count() as f64;
        let squares: f64 = self
            .lit_groups()
            .map(|[error, signal]| {
                let without = (self.error - error) / (self.signal - signal);
                (without - self.error / self.signal).powi(2)
            })
            .sum();
        ((count - 1.0).max(0.0) / count * squares).max(0.0).sqrt()
    }

    /// How many samples of pixels make the bound meet the target, if the error stays as `used` of them show it.
    pub fn samples_to_decide(&self, target: f64, used: usize) -> usize {
        let room = target * target - (self.error / self.signal).max(0.0);
        let gap = self.upper_bound().powi(2) - (self.error / self.signal).max(0.0);
        (used as f64 * (gap / room).powi(2)).ceil() as usize
    }

    fn lit_groups(&self) -> impl Iterator<Item = &[f64; 2]> {
        self.groups.iter().filter(|[_, signal]| *signal != 0.0)
    }

    /// Variance of a gather with so many samples over its sum of squared differences.
    pub fn variance_scale(&self, samples: u32) -> f64 {
        let fewer = f64::from(self.samples) / f64::from(samples);
        self.noise / self.squared_differences.max(f64::MIN_POSITIVE) * fewer.powf(EVENNESS_RATE)
    }

    /// Noise of a gather with so many samples over the radiance.
    pub fn relative_noise(&self, samples: u32) -> f64 {
        let fewer = f64::from(self.samples) / f64::from(samples);
        (self.noise / self.signal).sqrt() * fewer.powf(NOISE_RATE)
    }

    /// What errors are over what the resolve pass expects: of gathered pixels, and of interpolated ones.
    pub fn error_factors(&self) -> [f64; 2] {
        let whole = self.expected[0] + self.expected[1];
        [0, 1].map(|kind| {
            let of_kind = self.expected[kind];
            let counted = if of_kind.pixels < MIN_KIND_PIXELS {
                whole
            } else {
                of_kind
            };
            (counted.error / counted.expected)
                .max(MIN_FACTOR * MIN_FACTOR)
                .sqrt()
        })
    }

    /// Samples of a gather whose noise is this, relative to the signal.
    pub fn samples_for(&self, relative_noise: f64) -> f64 {
        let own_noise = (self.noise / self.signal).sqrt();
        f64::from(self.samples) * (own_noise / relative_noise).powf(1.0 / NOISE_RATE)
    }

    /// Adds what other pixels tell.
    pub fn add(&mut self, other: ErrorEstimate) {
        self.groups.extend(other.groups);
        self.error += other.error;
        self.signal += other.signal;
        self.noise += other.noise;
        self.squared_differences += other.squared_differences;
        self.squares += other.squares;
        self.cubes += other.cubes;
        for (own, other) in self.expected.iter_mut().zip(other.expected) {
            *own = *own + other;
        }
    }

    /// From [error, signal, noise, squared differences] of pixels of an image, and their columns and rows. `tile_px` is the edge of
    /// the tiles that count alike; `None`: all pixels do.
    fn new(
        pixels: &[[[f32; 4]; 2]],
        samples: u32,
        group_count: u32,
        tile_px: Option<u32>,
    ) -> ErrorEstimate {
        let square_sum: f64 = pixels
            .iter()
            .map(|[[_, signal, ..], _]| f64::from(*signal))
            .sum();
        let mean_square = square_sum / pixels.len().max(1) as f64;
        let tile = |&[_, [column, row, ..]]: &[[f32; 4]; 2]| {
            tile_px.map(|tile_px| [column, row].map(|at| at as u32 / tile_px))
        };
        let mut tiles: BTreeMap<_, (f64, f64)> = BTreeMap::new();
        for pixel in pixels {
            let (signal, count) = tiles.entry(tile(pixel)).or_default();
            *signal += f64::from(pixel[0][1]);
            *count += 1.0;
        }
        let mut sum = ErrorEstimate {
            groups: vec![[0.0; 2]; group_count as usize],
            radiance: (mean_square.max(0.0) / 3.0).sqrt(),
            samples: samples.max(1),
            ..ErrorEstimate::default()
        };
        let weight = |pixel: &[[f32; 4]; 2]| match (tile_px, tiles.get(&tile(pixel))) {
            (Some(_), Some((signal, count))) => {
                let floor = metrics::LOCAL_FLOOR.powi(2) * mean_square;
                1.0 / (signal / count).max(floor) / count
            }
            _ => 1.0,
        };
        for (index, pixel) in pixels.iter().enumerate() {
            let weight = weight(pixel);
            let [error, signal, noise, differences] = pixel[0].map(|sum| weight * f64::from(sum));
            let group = &mut sum.groups[index % group_count as usize];
            group[0] += error;
            group[1] += signal;
            sum.error += error;
            sum.signal += signal;
            sum.noise += 0.5 * noise;
            sum.squared_differences += 0.5 * differences;
            let expected = f64::from(pixel[1][2]);
            if expected != 0.0 {
                let of_kind = &mut sum.expected[usize::from(expected < 0.0)];
                of_kind.error += f64::from(pixel[0][0]);
                of_kind.expected += expected.powi(2);
                of_kind.pixels += 1;
            }
        }
        for pixel in pixels {
            let [error, signal] = [pixel[0][0], pixel[0][1]].map(f64::from);
            let off = weight(pixel) * (error - sum.error / sum.signal * signal);
            sum.squares += off.powi(2);
            sum.cubes += off.powi(3);
        }
        sum
    }
}

/// That of Student's t distribution, within 1 % from four degrees of freedom on (Abramowitz & Stegun 1964, 26.7.5).
fn student_quantile_95(freedom: f64) -> f64 {
    const NORMAL: f64 = 1.644_853_626_951_472;
    let squared = NORMAL * NORMAL;
    let first = (squared + 1.0) / 4.0;
    let second = (5.0 * squared * squared + 16.0 * squared + 3.0) / 96.0;
    let third = (3.0 * squared.powi(3) + 19.0 * squared.powi(2) + 17.0 * squared - 15.0) / 384.0;
    let inverse = 1.0 / freedom;
    NORMAL * (1.0 + inverse * (first + inverse * (second + inverse * third)))
}

/// Pixels that are gathered to estimate the image's error, with room for their results.
pub(super) struct PixelSample {
    receivers: Receivers,
    ranges: [ReceiverRange; 2],
    pub count: u32,
    /// Two gathers, or one that is exact.
    results: Buffer,
    /// Edge of the tiles that count alike, pixels.
    tile_px: Option<u32>,
    is_exact: bool,
    /// So far.
    gathers: u32,
}

impl PixelSample {
    /// Another `seed`: other pixels.
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
                // So many that each group has some.
                copies = GROUPS.div_ceil(count) as usize;
                continue;
            }
            // Where little of the image shows a surface, more places are looked at.
            if count >= SAMPLE_PIXELS / 4 || is_all {
                return Ok(PixelSample {
                    receivers,
                    ranges,
                    count,
                    results: Results::room(context.device, 2 * count)?,
                    tile_px: match norm {
                        ErrorNorm::Image => None,
                        ErrorNorm::Local => Some(metrics::local_tile_px(resolution_px)),
                    },
                    is_exact: false,
                    gathers: 1000 * seed,
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
        is_pilot: bool,
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
            self.gathers += 1;
            let samples = Samples {
                count: samples,
                // Others than those of other estimates.
                seed: FIRST_SEED + self.gathers,
                set_count: if is_pilot { 1 } else { GROUPS },
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
        let bytes = u64::from(count) * size_of::<[[f32; 4]; 2]>() as u64;
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
        let pixels = estimates.mapped::<[[f32; 4]; 2]>(count as usize)?;
        Ok(ErrorEstimate::new(pixels, samples, GROUPS, self.tile_px))
    }
}

/// About `count` pixels, one at a place of its own in each cell of a grid over the image; as column + 65536 · row.
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
impl ErrorEstimate {
    pub fn of_pilot(signal: f64, noise: f64, samples: u32) -> ErrorEstimate {
        ErrorEstimate {
            signal,
            noise,
            samples,
            ..ErrorEstimate::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        for (freedom, expected) in [(4.0, 2.132), (15.0, 1.753), (31.0, 1.696), (1e6, 1.645)] {
            let found: f64 = student_quantile_95(freedom);
            assert!((found / expected - 1.0).abs() < 0.01, "{freedom}: {found}");
        }
    }

    #[test]
    fn the_bound_is_over_the_estimate_and_a_bright_tile_does_not_hide_a_dark_one() {
        // A bright tile that is right and a dark one that is off by half.
        let pixel = |index: u32| {
            let column = index as f32;
            let noise = 1.0 + 0.1 * (index % 3) as f32;
            if index < 16 {
                [[0.01 * noise, 100.0, 0.0, 0.0], [column, 0.0, 0.0, 0.0]]
            } else {
                [[0.0025 * noise, 0.01, 0.0, 0.0], [column, 0.0, 0.0, 0.0]]
            }
        };
        let pixels: Vec<_> = (0..32).map(pixel).collect();
        let image = ErrorEstimate::new(&pixels, 64, 8, None);
        let local = ErrorEstimate::new(&pixels, 64, 8, Some(16));
        assert!(image.relative_error() < 0.02, "{image:?}");
        assert!((0.3..0.5).contains(&local.relative_error()), "{local:?}");
        for estimate in [image, local] {
            assert!(estimate.upper_bound() > estimate.relative_error());
        }
    }

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
