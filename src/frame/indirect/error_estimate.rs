//! Statistics: estimates the error of an image from what was gathered at a sample of its pixels.

use std::collections::BTreeMap;

use super::smoothed::{Distribution, ImageSamples, Model, Smoothed, VarianceFalloff, packets};
use crate::{
    metrics,
    passes::{refinement::SampleAllocation, sample_counts::PACKET_SAMPLES},
};

/// With fewer pixels of a kind, it is unknown how right the errors are that are expected of this kind.
const MIN_KIND_PIXELS: u32 = 64;
/// Fewer pixels than that hide how skewed errors are, and the bound's distance grows with this power of their lack (measured: `cargo bench
/// --bench bound` with limits of 30 ms to 1 s and 1e5 rays).
const ENOUGH_PIXELS: f64 = 256.0;
const FEW_POWER: f64 = 0.75;
/// Least error over the expected error: few pixels may show none by chance.
const MIN_FACTOR: f64 = 0.1;
/// The variance of a gather falls with these powers of its packets. The first is for packets that scatter like random samples, because
/// the light is narrow (measured: 0.9 to 1.5). The second is for packets that scatter half as much or less (measured: 1.36 to 1.54).
const VARIANCE_RATES: [f64; 2] = [1.2, 1.44];

/// Sums over the pixels of a sample and their bands, weighted by the error norm.
#[derive(Debug, Clone, Default)]
pub(super) struct ErrorEstimate {
    /// Σ(x − t)² and Σt² of groups of pixels that have no samples in common. Noise adds scatter to them, but no bias.
    groups: Vec<[f64; 2]>,
    /// Sums over all groups.
    error: f64,
    signal: f64,
    /// Σd² and Σd³ over pixels, where d is a pixel's error minus what the image's relative error makes of its signal.
    squares: f64,
    cubes: f64,
    /// Σσ² of the noise of one gather.
    noise: f64,
    /// Σσ² of one sample.
    variance: f64,
    /// For each pixel.
    scatter: Vec<Scatter>,
    of_image: Vec<ImageSamples>,
    /// For gathered and for interpolated pixels.
    expected: [ExpectedError; 2],
    /// Root mean square of the radiance, W/sr/m², for any norm. For Z, which is one value instead of three bands, 1/√3 of its
    /// root mean square.
    pub radiance: f64,
    /// Packets of a gather; only of pilots.
    packets: u32,
    /// How often the bound was compared with the target so far, this time included.
    pub looks: u32,
}

/// What was found at a pixel of a sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct PixelEstimate {
    /// How many pixels of the image it stands for, over the mean of all pixels of the sample.
    pub weight: f64,
    /// As the kernel `error_estimate` writes them: [error, signal, noise, variance of a sample]; [column, row, expected error, packets];
    /// and [variance of a sample of the image, packets, squared error of the model, leverage].
    pub sums: [f32; 4],
    pub pixel: [f32; 4],
    pub of_image: [f32; 4],
}

/// Divides nothing by 0. Far below the square of any light in f32, and its inverse is finite many times over.
const LEAST_SQUARE: f64 = 1e-200;

/// How the samples of a pixel scatter.
#[derive(Debug, Clone, Copy)]
struct Scatter {
    /// The pixel's part of the variance of a sample.
    variance: f64,
    /// The variance of a sample over the square of the radiance that errors are relative to.
    relative: f64,
    /// Packets of a gather; 0 if gathers have no noise.
    packets: f64,
}

/// How right the errors are that the resolve pass expects.
#[derive(Debug, Clone, Copy, Default)]
struct ExpectedError {
    /// Sums of the squared errors and of the squared expected errors. Not a sum of quotients: a few pixels whose expected error was
    /// too small would dominate it.
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
    /// Whether no light was found.
    pub fn is_dark(&self) -> bool {
        self.signal <= 0.0
    }

    /// Whether the scene has nothing of this quantity.
    pub fn is_absent(&self) -> bool {
        self.error == 0.0 && self.variance == 0.0
    }

    /// relRMSE. Its square is at least its own standard error: few pixels may show no error by chance.
    pub fn relative_error(&self) -> f64 {
        let least = self.standard_error();
        (self.error / self.signal).max(least).sqrt()
    }

    /// Upper bound of the relRMSE with a confidence of 95 %; infinite if there are too few pixels. A frame ends at the first look whose bound
    /// meets the target, so all looks share the 5 % (Bonferroni).
    pub fn upper_bound(&self) -> f64 {
        let freedom = self.lit_groups().count() as f64 - 1.0;
        if freedom < 1.0 {
            return f64::INFINITY;
        }
        // Few pixels may hold most of the error. Its skewness moves the quantile (Johnson 1978).
        let quantile = student_quantile(0.05 / f64::from(self.looks.max(1)), freedom);
        let skewness = self.cubes / self.squares.powf(1.5).max(f64::MIN_POSITIVE);
        let quantile = quantile + skewness.max(0.0) / 6.0 * (1.0 + 2.0 * quantile.powi(2));
        // Few pixels do not show how skewed it is.
        let quantile = quantile
            * (ENOUGH_PIXELS / self.scatter.len() as f64)
                .max(1.0)
                .powf(FEW_POWER);
        ((self.error / self.signal).max(0.0) + quantile * self.standard_error()).sqrt()
    }

    /// Standard error of the square of the relRMSE, from the scatter of the groups. They may have different numbers of pixels.
    fn standard_error(&self) -> f64 {
        let count = self.lit_groups().count() as f64;
        let relative = self.error / self.signal;
        let squares: f64 = self
            .lit_groups()
            .map(|[error, signal]| (error - relative * signal).powi(2))
            .sum();
        (count / (count - 1.0).max(1.0) * squares).sqrt() / self.signal
    }

    /// How many times as many pixels make the bound meet the target, if the error stays as it is.
    pub fn growth_to_decide(&self, target: f64) -> f64 {
        let room = target * target - (self.error / self.signal).max(0.0);
        let gap = self.upper_bound().powi(2) - (self.error / self.signal).max(0.0);
        (gap / room.max(f64::MIN_POSITIVE)).powi(2)
    }

    fn lit_groups(&self) -> impl Iterator<Item = &[f64; 2]> {
        self.groups.iter().filter(|[_, signal]| *signal != 0.0)
    }

    /// Variance of one packet of samples over that of the same number of random samples.
    pub fn evenness(&self) -> f64 {
        let at_random = self.variance / f64::from(PACKET_SAMPLES * self.packets.max(1));
        self.noise / at_random.max(f64::MIN_POSITIVE)
    }

    /// For a pilot: scales the variances so that its noise is as even as that of another quantity. Returns the factor.
    pub fn match_evenness(&mut self, other: &ErrorEstimate) -> f64 {
        let factor = self.evenness() / other.evenness().max(f64::MIN_POSITIVE);
        let factor = match factor.is_finite() {
            true => factor.clamp(MIN_FACTOR * MIN_FACTOR, 2.0),
            false => 1.0,
        };
        self.variance *= factor;
        for pixel in &mut self.scatter {
            pixel.variance *= factor;
            pixel.relative *= factor;
        }
        factor
    }

    /// The variance of a gather falls with this power of its packets.
    pub fn variance_rate(&self) -> f64 {
        let [random, even] = VARIANCE_RATES;
        random + (even - random) * (2.0 * (1.0 - self.evenness())).clamp(0.0, 1.0)
    }

    /// For a pilot: the noise that gathers with more packets had, over what it expects.
    pub fn observed_noise(&self, gathers: &ErrorEstimate) -> f64 {
        let rate = self.variance_rate();
        let of_pixel = |pixel: &Scatter| pixel.variance * pixel.packets.powf(-rate);
        let sum: f64 = gathers.scatter.iter().map(of_pixel).sum();
        let expected = sum * self.packet_variance();
        // Few pixels may show no noise by chance.
        let ratio = gathers.noise / expected.max(f64::MIN_POSITIVE);
        ratio.clamp(0.25, 4.0).sqrt()
    }

    /// For a pilot: from now on, expects this many times the noise.
    pub fn scale_noise(&mut self, factor: f64) {
        self.noise *= factor * factor;
    }

    /// Variance of one packet of samples over that of a sample.
    pub fn packet_variance(&self) -> f64 {
        self.evenness() / f64::from(PACKET_SAMPLES)
    }

    /// The noise is least if the samples of pixels are proportional to this power of their variances.
    pub fn variance_power(&self) -> f64 {
        1.0 / (1.0 + self.variance_rate())
    }

    /// Noise over the radiance, as a function of the packets for a pixel of variance 1, with at most `max_packets` for each pixel.
    pub fn noise_with(&self, max_packets: u32) -> impl Fn(f64) -> f64 {
        let power = self.variance_power();
        let falloff = VarianceFalloff::new(self.variance_rate(), max_packets);
        let of_pixel = |pixel: &Scatter| (pixel.variance, pixel.relative.powf(power));
        let pixels: Vec<(f64, f64)> = self.scatter.iter().map(of_pixel).collect();
        let (signal, packet_variance) = (self.signal, self.packet_variance());
        move |packets_scale| {
            let variance_of_mean = |&(variance, share): &(f64, f64)| {
                variance * falloff.share(packets(packets_scale * share, max_packets))
            };
            let sum: f64 = pixels.iter().map(variance_of_mean).sum();
            (sum / signal * packet_variance).sqrt()
        }
    }

    /// What more samples leave of the gathered pixels' error.
    pub fn smoothed(&self, with: Distribution) -> Smoothed {
        Smoothed::of(&self.of_image, with, |pixel| pixel.packets_with(with))
    }

    /// The same with the samples that they have.
    pub fn smoothed_now(&self, with: Distribution) -> Smoothed {
        Smoothed::of(&self.of_image, with, |pixel| pixel.packets)
    }

    /// Mean packets of a pixel, with the parameters of `noise_with`.
    pub fn mean_packets(&self, packets_scale: f64, max_packets: u32) -> f64 {
        let power = self.variance_power();
        let of_pixel = |pixel: &Scatter| {
            let scaled = packets_scale * pixel.relative.powf(power);
            packets(scaled, max_packets)
        };
        let sum: f64 = self.scatter.iter().map(of_pixel).sum();
        sum / self.scatter.len().max(1) as f64
    }

    /// The same for an allocation.
    pub fn mean_packets_of(&self, allocation: &SampleAllocation) -> f64 {
        self.mean_packets(allocation.packets_scale, allocation.max_packets)
    }

    /// Mean variance of a pixel's sample, over the square of the radiance that errors are relative to.
    pub fn mean_variance(&self) -> f64 {
        let sum: f64 = self.scatter.iter().map(|pixel| pixel.relative).sum();
        sum / self.scatter.len().max(1) as f64
    }

    /// Variance of a sample, over the square of the radiance.
    pub fn relative_variance(&self) -> f64 {
        if self.is_dark() {
            return f64::INFINITY;
        }
        self.variance / self.signal
    }

    /// Factors from the errors that the resolve pass expects to the estimated ones, for gathered and for interpolated pixels.
    /// They also include the uncertainty of the estimate.
    pub fn error_factors(&self) -> [f64; 2] {
        let relative = self.error / self.signal;
        let uncertainty = 1.0 + (self.standard_error() / relative.max(f64::MIN_POSITIVE)).min(1.0);
        let whole = self.expected[0] + self.expected[1];
        [0, 1].map(|kind| {
            let of_kind = self.expected[kind];
            let counted = if of_kind.pixels < MIN_KIND_PIXELS {
                whole
            } else {
                of_kind
            };
            (uncertainty * counted.error / counted.expected)
                .max(MIN_FACTOR * MIN_FACTOR)
                .sqrt()
        })
    }

    /// The same with the image's samples of another quantity. Their variances are those of the worst quantity, as errors of light.
    pub fn with_samples_of(self, light: &ErrorEstimate) -> ErrorEstimate {
        ErrorEstimate {
            of_image: light.of_image.clone(),
            ..self
        }
    }

    /// Adds the estimate of other pixels.
    pub fn add(&mut self, other: ErrorEstimate) {
        self.groups.extend(other.groups);
        self.error += other.error;
        self.signal += other.signal;
        self.noise += other.noise;
        self.variance += other.variance;
        self.scatter.extend(other.scatter);
        self.of_image.extend(other.of_image);
        self.squares += other.squares;
        self.cubes += other.cubes;
        for (own, other) in self.expected.iter_mut().zip(other.expected) {
            *own = *own + other;
        }
    }

    /// `tile_px` is the edge of the tiles that errors are relative to; `None`: they are relative to the whole image.
    pub fn new(
        pixels: &[PixelEstimate],
        packets: u32,
        group_count: u32,
        tile_px: Option<u32>,
    ) -> ErrorEstimate {
        let tile = |pixel: &PixelEstimate| {
            let [column, row, ..] = pixel.pixel;
            tile_px.map(|tile_px| [column, row].map(|at| at as u32 / tile_px))
        };
        let mut whole = (0.0, 0.0);
        let mut tiles: BTreeMap<_, (f64, f64)> = BTreeMap::new();
        for pixel in pixels {
            for (signal, count) in [&mut whole, tiles.entry(tile(pixel)).or_default()] {
                *signal += pixel.weight * f64::from(pixel.sums[1]);
                *count += pixel.weight;
            }
        }
        let mean_square = whole.0 / whole.1.max(f64::MIN_POSITIVE);
        let mut sum = ErrorEstimate {
            groups: vec![[0.0; 2]; group_count as usize],
            radiance: (mean_square.max(0.0) / 3.0).sqrt(),
            packets,
            ..ErrorEstimate::default()
        };
        // The square that errors are relative to, and the number of pixels that it is for.
        let counted = |pixel: &PixelEstimate| match (tile_px, tiles.get(&tile(pixel))) {
            (Some(_), Some((signal, count))) => {
                let floor = metrics::LOCAL_FLOOR.powi(2) * mean_square;
                ((signal / count).max(floor), *count)
            }
            _ => (mean_square, whole.1),
        };
        // Sums grow with the pixels, so that a larger sample counts for more.
        let pixel_count = pixels.len() as f64;
        let part = |pixel: &PixelEstimate| {
            let (square, count) = counted(pixel);
            pixel_count * pixel.weight / (square * count).max(LEAST_SQUARE)
        };
        for (index, pixel) in pixels.iter().enumerate() {
            let part = part(pixel);
            let [error, signal, noise, variance] = pixel.sums.map(|sum| part * f64::from(sum));
            let group = &mut sum.groups[index % group_count as usize];
            group[0] += error;
            group[1] += signal;
            sum.error += error;
            sum.signal += signal;
            sum.noise += 0.5 * noise;
            sum.variance += variance;
            let square = counted(pixel).0.max(f64::MIN_POSITIVE);
            sum.scatter.push(Scatter {
                variance,
                relative: f64::from(pixel.sums[3]) / square,
                packets: f64::from(pixel.pixel[3]),
            });
            let [variance, packets, error, leverage] = pixel.of_image.map(f64::from);
            sum.of_image.push(ImageSamples {
                weight: pixel.weight,
                share: square * part,
                variance: variance / square,
                packets,
                model: (leverage >= 0.0).then_some(Model {
                    error: error / square,
                    leverage,
                }),
            });
            let expected = f64::from(pixel.pixel[2]);
            if expected != 0.0 {
                let of_kind = &mut sum.expected[usize::from(expected < 0.0)];
                of_kind.error += pixel.weight * f64::from(pixel.sums[0]);
                of_kind.expected += pixel.weight * expected.powi(2);
                of_kind.pixels += 1;
            }
        }
        for pixel in pixels {
            let [error, signal, ..] = pixel.sums.map(f64::from);
            let off = part(pixel) * (error - sum.error / sum.signal * signal);
            sum.squares += off.powi(2);
            sum.cubes += off.powi(3);
        }
        sum
    }
}

/// What Student's t distribution exceeds with this probability, at most 1/2, within 1 % from 15 degrees of freedom on and down to
/// probabilities of 0.1 % (Abramowitz & Stegun 1964, 26.2.23 and 26.7.5).
fn student_quantile(probability: f64, freedom: f64) -> f64 {
    let t = (-2.0 * probability.ln()).sqrt();
    let above = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let below = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    let normal = t - above / below;
    let squared = normal * normal;
    let first = (squared + 1.0) / 4.0;
    let second = (5.0 * squared * squared + 16.0 * squared + 3.0) / 96.0;
    let third = (3.0 * squared.powi(3) + 19.0 * squared.powi(2) + 17.0 * squared - 15.0) / 384.0;
    let inverse = 1.0 / freedom;
    normal * (1.0 + inverse * (first + inverse * (second + inverse * third)))
}

#[cfg(test)]
impl ErrorEstimate {
    /// A pilot of equally bright pixels with these variances of a sample. The noise is that of random samples.
    pub fn of_pilot(variances: &[f64]) -> ErrorEstimate {
        let variance: f64 = variances.iter().sum();
        ErrorEstimate {
            signal: variances.len() as f64,
            noise: variance / f64::from(PACKET_SAMPLES),
            variance,
            scatter: variances
                .iter()
                .map(|&own| Scatter {
                    variance: own,
                    relative: own,
                    packets: 1.0,
                })
                .collect(),
            packets: 1,
            ..ErrorEstimate::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_tables() {
        let table = [
            (0.05, 15.0, 1.753),
            (0.025, 15.0, 2.131),
            (0.025, 31.0, 2.040),
            (0.005, 15.0, 2.947),
            (0.001, 40.0, 3.307),
            (0.001, 1e6, 3.090),
        ];
        for (probability, freedom, expected) in table {
            let found: f64 = student_quantile(probability, freedom);
            assert!((found / expected - 1.0).abs() < 0.01, "{freedom}: {found}");
        }
    }

    #[test]
    fn noise_is_expected_as_it_was_observed() {
        let mut pilot = ErrorEstimate::of_pilot(&[0.01, 1.0]);
        let expected = pilot.noise_with(1)(0.0);
        let mut gathers = ErrorEstimate::of_pilot(&[0.01, 1.0]);
        gathers.noise *= 2.0;
        let observed = pilot.observed_noise(&gathers);
        assert!((observed - 2f64.sqrt()).abs() < 1e-12);
        pilot.scale_noise(observed);
        assert!((pilot.noise_with(1)(0.0) / expected - 2f64.sqrt()).abs() < 1e-12);
        assert!((pilot.observed_noise(&gathers) - 1.0).abs() < 1e-12);
        gathers.noise = 0.0;
        assert!(pilot.observed_noise(&gathers) > 0.0);
    }

    #[test]
    fn the_bound_is_over_the_estimate_and_a_bright_tile_does_not_hide_a_dark_one() {
        // A bright tile that is right and a dark one that is off by half.
        let pixel = |index: u32| {
            let column = index as f32;
            let noise = 1.0 + 0.1 * (index % 3) as f32;
            let [error, signal] = match index < 16 {
                true => [0.01 * noise, 100.0],
                false => [0.0025 * noise, 0.01],
            };
            PixelEstimate {
                weight: 1.0,
                sums: [error, signal, 0.0, 0.0],
                pixel: [column, 0.0, 0.0, 0.0],
                of_image: [0.0; 4],
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
}
