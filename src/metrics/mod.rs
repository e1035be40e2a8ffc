//! Compares an image with a reference, and estimates how much of the difference is the noise of the two.
//!
//! Metrics cover the valid pixels that are not on edges, all bands together. x is a value of the image and t of the reference. Both may
//! carry noise with a known standard error, τ and σ, and d = x − t. [`RelativeErrors`] uses d as it is, with the noise. [`NoiseCorrection`]
//! removes what the noise alone explains. Its type [`CorrectedRmse`] cannot express an error below the noise.
//!
//! Sums are compensated sums in f64.

mod noise;

pub use noise::{CorrectedRmse, NoiseCorrection, ZScores};

use crate::error::{Error, Result};
use std::f64::consts::PI;

use crate::model::{CompensatedSum, Phasor, SPEED_OF_LIGHT_M_S, multipath_error_m};

/// Tiles of an image along its shorter edge. The local norm is a mean over these tiles.
const LOCAL_TILES: u32 = 8;
/// A tile darker than this, relative to the root mean square of the image, counts as if it were this bright: its error is not visible
/// beside the rest.
pub(crate) const LOCAL_FLOOR: f64 = 1e-3;

/// Least |Z| of a pixel whose range counts, over the root mean square of |Z|. |Z| is that of all light, at one frequency.
pub const LEAST_RANGE_SIGNAL: f64 = 0.01;

/// Root mean square of the differences of range between an image and a reference, metres, without the noise of the reference. It is over all
/// pixels that count and whose |Z| in the reference is at least [`LEAST_RANGE_SIGNAL`] of its root mean square over them. 0 if noise hides
/// the differences.
///
/// The slices hold re and im of Z for each pixel, and of its standard error.
pub fn range_error_m(
    image: &[f32],
    reference: &[f32],
    standard_error: &[f32],
    frequency_hz: f64,
    counts: impl Fn(usize) -> bool,
) -> f64 {
    let phasors = |values: &[f32]| -> Vec<Phasor> {
        let (pairs, _) = values.as_chunks::<2>();
        let phasor = |&[re, im]: &[f32; 2]| Phasor {
            re: re.into(),
            im: im.into(),
        };
        pairs.iter().map(phasor).collect()
    };
    let [image, due, deviations] = [image, reference, standard_error].map(phasors);
    let counted: Vec<usize> = (0..due.len()).filter(|&pixel| counts(pixel)).collect();
    let squares = counted.iter().map(|&pixel| due[pixel].magnitude().powi(2));
    let mean_square = squares.sum::<f64>() / counted.len().max(1) as f64;
    let least = LEAST_RANGE_SIGNAL * mean_square.sqrt();
    let has_signal = |pixel: &&usize| due[**pixel].magnitude() >= least.max(f64::MIN_POSITIVE);
    let metres_per_radian = SPEED_OF_LIGHT_M_S / (4.0 * PI * frequency_hz);
    let mut sum = CompensatedSum::default();
    let mut count = 0.0;
    for &pixel in counted.iter().filter(has_signal) {
        let (z, deviation) = (due[pixel], deviations[pixel]);
        let error_m = multipath_error_m(image[pixel], z, frequency_hz);
        let noise_rad = (z.im * deviation.re).hypot(z.re * deviation.im) / z.magnitude().powi(2);
        // A pixel without Z is off by any phase.
        let error_m = error_m.unwrap_or(PI * metres_per_radian);
        sum.add(error_m.powi(2) - (noise_rad * metres_per_radian).powi(2));
        count += 1.0;
    }
    (sum.value() / f64::max(count, 1.0)).max(0.0).sqrt()
}

/// Edge of the tiles of the local norm, pixels.
pub(crate) fn local_tile_px([width, height]: [u32; 2]) -> u32 {
    width.min(height).div_ceil(LOCAL_TILES).max(1)
}

/// relRMSE by the local norm: the root of the mean over tiles, 8 along the image's shorter edge, of Σ(x − t)²/Σt², without the noise of the
/// reference. A tile below 10⁻³ of the root mean square of the reference counts as if it were that bright.
///
/// The slices hold 3 values per pixel of an image of this size, row by row.
pub fn local_error(
    image: &[f32],
    reference: &[f32],
    standard_error: &[f32],
    size_px: [u32; 2],
) -> f64 {
    let tile_px = local_tile_px(size_px);
    let mut tiles = std::collections::BTreeMap::<[u32; 2], [f64; 3]>::new();
    let values = image.iter().zip(reference).zip(standard_error);
    for (index, ((&x, &t), &sigma)) in values.enumerate() {
        let pixel = index as u32 / 3;
        let tile = [pixel % size_px[0], pixel / size_px[0]].map(|at| at / tile_px);
        let [x, t, sigma] = [x, t, sigma].map(f64::from);
        let noise = sigma * sigma;
        let sums = tiles.entry(tile).or_default();
        sums[0] += (x - t).powi(2) - noise;
        sums[1] += t * t - noise;
        sums[2] += 1.0;
    }
    let [square, count] = [1, 2].map(|sum| tiles.values().map(|tile| tile[sum]).sum::<f64>());
    let floor = LOCAL_FLOOR.powi(2) * square / count;
    let errors = tiles
        .values()
        .map(|[error, square, count]| error / square.max(floor * count));
    (errors.sum::<f64>() / tiles.len() as f64).max(0.0).sqrt()
}

/// Two images to compare, in memory. All slices hold width · height · `channels` values, channels interleaved, except `valid` and `edges`,
/// which have one entry per pixel. The reference is f32, as in files, or f64, as in the model.
#[derive(Debug, Clone, Copy)]
pub struct Pixels<'a, T = f32> {
    pub image: &'a [f32],
    pub reference: &'a [T],
    /// τ of each value, in the unit of `image`; `None` for an image without noise.
    pub image_standard_error: Option<&'a [f32]>,
    /// σ of each value, in the unit of `reference`; `None` if it is unknown.
    pub reference_standard_error: Option<&'a [f32]>,
    /// Which pixels count.
    pub valid: &'a [bool],
    /// Which pixels show one of two surfaces by chance, with the same length as `valid`. Nothing can be judged there, so these pixels count
    /// only for [`Comparison::edge_pixels`]. `None` if it is unknown.
    pub edges: Option<&'a [bool]>,
    /// Values per pixel.
    pub channels: usize,
}

/// The comparison of an image with a reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Number of compared values: those of the valid pixels, except the ones below.
    pub value_count: usize,
    /// Valid pixels on edges, which are left out.
    pub edge_pixels: usize,
    /// Values of valid pixels that are left out because the image or its standard error is not finite, or the standard error is negative. A
    /// correct image has none.
    pub non_finite_image: usize,
    /// The same for the reference. A value may count for both.
    pub non_finite_reference: usize,
    /// Mean of x; 0 where nothing was compared.
    pub image_mean: f64,
    /// Mean of t; 0 where nothing was compared.
    pub reference_mean: f64,
    /// `None` if nothing was compared, or if Σ|t| is 0, as in a black reference: there is nothing to be relative to.
    pub errors: Option<RelativeErrors>,
    /// `None` without `errors`, or if no standard error was given.
    pub noise: Option<NoiseCorrection>,
    /// `None` if fewer than two values have a standard error above 0.
    pub z_scores: Option<ZScores>,
}

/// Errors relative to the reference, 1 = 100 %, noise included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativeErrors {
    /// sqrt(Σd²/Σt²)
    pub rmse: f64,
    /// Σd/Σ|t|. For light, whose t are not negative, this is Σx/Σt − 1.
    pub bias: f64,
    /// Σ|d|/Σ|t|
    pub mean_absolute: f64,
    /// The smallest value that 99 % of all |d|/(|t| + 0.01·mean |t|) do not exceed.
    pub percentile_99: f64,
}

impl Comparison {
    /// Compares two images.
    ///
    /// # Errors
    /// [`Error::Input`] when the slices do not fit together.
    pub fn new<T: Copy + Into<f64>>(pixels: &Pixels<T>) -> Result<Self> {
        check(pixels)?;
        let is_edge = |pixel: usize| pixels.edges.is_some_and(|edges| edges[pixel]);
        let valid = || (0..pixels.valid.len()).filter(|&pixel| pixels.valid[pixel]);
        let of_pixel = |pixel| {
            let bands = pixel * pixels.channels..(pixel + 1) * pixels.channels;
            bands.map(move |index| Sample::new(pixels, pixel, index))
        };
        let mut samples: Vec<Sample> = valid()
            .filter(|&pixel| !is_edge(pixel))
            .flat_map(of_pixel)
            .collect();
        let count = |is: fn(&Sample) -> bool| samples.iter().filter(|sample| is(sample)).count();
        let non_finite_image = count(|sample| !sample.is_image_number());
        let non_finite_reference = count(|sample| !sample.is_reference_number());
        samples.retain(|sample| sample.is_image_number() && sample.is_reference_number());
        let samples = samples.as_slice();
        let sums = noise::Sums {
            x: sum(samples, |sample| sample.x),
            t: sum(samples, |sample| sample.t),
            magnitude: sum(samples, |sample| sample.t.abs()),
            tt: sum(samples, |sample| sample.t * sample.t),
            dd: sum(samples, |sample| sample.d() * sample.d()),
        };
        let mean = |sum: f64| sum / samples.len().max(1) as f64;
        let has_errors = sums.magnitude > 0.0;
        let has_noise =
            pixels.image_standard_error.is_some() || pixels.reference_standard_error.is_some();
        Ok(Comparison {
            value_count: samples.len(),
            edge_pixels: valid().filter(|&pixel| is_edge(pixel)).count(),
            non_finite_image,
            non_finite_reference,
            image_mean: mean(sums.x),
            reference_mean: mean(sums.t),
            errors: has_errors.then(|| RelativeErrors {
                rmse: (sums.dd / sums.tt).sqrt(),
                bias: (sums.x - sums.t) / sums.magnitude,
                mean_absolute: sum(samples, |sample| sample.d().abs()) / sums.magnitude,
                percentile_99: percentile_99(samples, 0.01 * mean(sums.magnitude)),
            }),
            noise: (has_errors && has_noise).then(|| NoiseCorrection::new(samples, &sums)),
            z_scores: ZScores::new(samples),
        })
    }
}

/// A compensated sum in f64.
fn sum<T>(items: &[T], term: impl FnMut(&T) -> f64) -> f64 {
    items.iter().map(term).collect::<CompensatedSum>().value()
}

/// One value of both images, in f64.
struct Sample {
    pixel: usize,
    x: f64,
    t: f64,
    /// σ: standard error of t, 0 if it has none.
    sigma: f64,
    /// τ: standard error of x, 0 if it has none.
    tau: f64,
}

impl Sample {
    fn new<T: Copy + Into<f64>>(pixels: &Pixels<T>, pixel: usize, index: usize) -> Sample {
        let standard_error =
            |values: Option<&[f32]>| values.map_or(0.0, |values| f64::from(values[index]));
        Sample {
            pixel,
            x: f64::from(pixels.image[index]),
            t: pixels.reference[index].into(),
            sigma: standard_error(pixels.reference_standard_error),
            tau: standard_error(pixels.image_standard_error),
        }
    }

    fn is_image_number(&self) -> bool {
        self.x.is_finite() && self.tau.is_finite() && self.tau >= 0.0
    }

    fn is_reference_number(&self) -> bool {
        self.t.is_finite() && self.sigma.is_finite() && self.sigma >= 0.0
    }

    fn d(&self) -> f64 {
        self.x - self.t
    }

    /// Variance of d.
    fn variance(&self) -> f64 {
        self.sigma * self.sigma + self.tau * self.tau
    }
}

/// The 99th percentile by nearest rank, of at least one sample.
fn percentile_99(samples: &[Sample], offset: f64) -> f64 {
    let mut errors: Vec<f64> = samples
        .iter()
        .map(|sample| sample.d().abs() / (sample.t.abs() + offset))
        .collect();
    let rank = (errors.len() * 99).div_ceil(100) - 1;
    let (_, percentile, _) = errors.select_nth_unstable_by(rank, f64::total_cmp);
    *percentile
}

fn check<T>(pixels: &Pixels<T>) -> Result<()> {
    let refuse = |problem: String| {
        let hint = "compare images of one size with the same channels";
        Err(Error::input("comparison", problem, hint))
    };
    let (count, channels) = (pixels.valid.len(), pixels.channels);
    if let Some(edges) = pixels.edges.filter(|edges| edges.len() != count) {
        let length = edges.len();
        return refuse(format!(
            "the edge mask has {length} pixels instead of {count}"
        ));
    }
    let due = count.checked_mul(channels);
    let of_image = pixels.image_standard_error.map(<[f32]>::len);
    let of_reference = pixels.reference_standard_error.map(<[f32]>::len);
    for (name, length) in [
        ("image", Some(pixels.image.len())),
        ("reference", Some(pixels.reference.len())),
        ("image's standard error", of_image),
        ("reference's standard error", of_reference),
    ] {
        if let Some(length) = length.filter(|&length| Some(length) != due) {
            return refuse(format!(
                "the {name} has {length} values instead of {count} pixels x {channels} channels"
            ));
        }
    }
    Ok(())
}
