//! The results of a comparison with the noise removed.

use std::{f64::consts::PI, ops::RangeInclusive};

use super::{Sample, sum};

/// How many standard errors a claim must be above 0: 97.7 % of a normal distribution are below +2.
const CONFIDENCE: f64 = 2.0;

/// A comparison without the noise of its images.
///
/// It is valid if the standard errors are, for noise that is about normal, and independent between the two images and between pixels. The
/// bands of a pixel are assumed to carry the same noise, as they do if one path is followed for all of them. Otherwise the uncertainties
/// given here are too large rather than too small.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseCorrection {
    /// sqrt(Σ(σ²+τ²)/Σt²): the relative RMSE that an image without error shows.
    pub floor: f64,
    /// The relative RMSE without the noise.
    pub rmse: CorrectedRmse,
    /// Standard error of [`RelativeErrors::bias`](super::RelativeErrors::bias) = b, with the noise of a pixel's bands summed:
    /// sqrt(Σ_pixels ((Στ)² + (1+b)²(Σσ)²)) / Σ|t|.
    pub bias_standard_error: f64,
    /// sqrt(2/π)·Σ sqrt(σ²+τ²)/Σ|t|: the mean absolute error that an image without error shows.
    pub mean_absolute_floor: f64,
}

/// The relative RMSE of the images' true values: sqrt(R²) with R² = A/B, A = Σd² − Σ(σ²+τ²), B = Σt² − Σσ². For E d² is the square of the
/// true difference, plus σ² + τ², and E t² is the square of the true value, plus σ².
///
/// The variance of R² is that of Σq/B with q = d² − R²·t². The noise of a pixel is σz in t and τw in x, with one normal z and one normal w
/// for its bands. So q has the variance 4(Σσe')² + 4(Στe)² + 2((1−R²)Σσ²)² + 2(Στ²)² + 4(Σστ)². The sums are over the pixel's bands, e is
/// the true difference, and e' = e + R²·(true value). With u = d + R²·t, the unbiased estimate of this variance from the data is 4(Σσu)² +
/// 4(Στd)² − 2((1−R²)Σσ²)² − 2(Στ²)² − 4(Σστ)². camlux sums it over the pixels, and uses at least the variance for e = e' = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CorrectedRmse {
    /// R² is at least two of its standard errors above 0.
    Estimate {
        value: f64,
        /// The standard error of R², divided by 2R.
        standard_error: f64,
    },
    /// The noise hides the error, which is most probably below this bound: sqrt(max(R², 0) + 2 standard errors of R²).
    Below(f64),
    /// B is not two of its standard errors above 0: the reference shows no light beyond its own noise.
    ReferenceIsNoise,
}

/// d/sqrt(σ²+τ²) over the values with σ²+τ² > 0. If the images differ by their noise only and the standard errors are right, the mean is 0
/// within 1/sqrt(number of pixels) and the variance about 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZScores {
    /// At least 2.
    pub value_count: usize,
    pub mean: f64,
    /// Unbiased: divided by `value_count` − 1.
    pub variance: f64,
}

/// Sums over all values.
pub(super) struct Sums {
    pub x: f64,
    pub t: f64,
    /// Σ|t|, above 0.
    pub magnitude: f64,
    pub tt: f64,
    pub dd: f64,
}

impl NoiseCorrection {
    /// Requires Σ|t| > 0.
    pub(super) fn new(samples: &[Sample], sums: &Sums) -> Self {
        let variance = sum(samples, Sample::variance);
        let deviation = sum(samples, |sample| sample.variance().sqrt());
        let pixels = samples.chunk_by(|a, b| a.pixel == b.pixel);
        let pixels: Vec<PixelSums> = pixels.map(PixelSums::new).collect();
        let image_to_reference = 1.0 + (sums.x - sums.t) / sums.magnitude;
        let bias_variance = sum(&pixels, |p| {
            p.tau.powi(2) + (image_to_reference * p.sigma).powi(2)
        });
        let true_squares = sums.tt - sum(samples, |sample| sample.sigma * sample.sigma);
        NoiseCorrection {
            floor: (variance / sums.tt).sqrt(),
            rmse: CorrectedRmse::new(&pixels, sums.dd - variance, true_squares),
            bias_standard_error: bias_variance.sqrt() / sums.magnitude,
            mean_absolute_floor: (2.0 / PI).sqrt() * deviation / sums.magnitude,
        }
    }
}

impl CorrectedRmse {
    /// From A (`squared_error`) and B (`true_squares`).
    fn new(pixels: &[PixelSums], squared_error: f64, true_squares: f64) -> Self {
        let least = sum(pixels, |p| 2.0 * p.sigma_sigma.powi(2));
        let seen = sum(pixels, |p| 4.0 * p.sigma_t.powi(2)) - least;
        if true_squares <= CONFIDENCE * seen.max(least).sqrt() {
            return CorrectedRmse::ReferenceIsNoise;
        }
        let square = squared_error / true_squares;
        let share = square.max(0.0);
        let least = sum(pixels, |p| {
            2.0 * ((1.0 - share) * p.sigma_sigma).powi(2)
                + 2.0 * p.tau_tau.powi(2)
                + 4.0 * p.sigma_tau.powi(2)
        });
        let linear = sum(pixels, |p| {
            4.0 * (p.sigma_d + share * p.sigma_t).powi(2) + 4.0 * p.tau_d.powi(2)
        });
        let seen = linear - least;
        let standard_error = seen.max(least).sqrt() / true_squares;
        if square < CONFIDENCE * standard_error {
            return CorrectedRmse::Below((share + CONFIDENCE * standard_error).sqrt());
        }
        let value = share.sqrt();
        CorrectedRmse::Estimate {
            value,
            // Equal images without noise have a value and a standard error of 0.
            standard_error: if value > 0.0 {
                standard_error / (2.0 * value)
            } else {
                0.0
            },
        }
    }

    /// The number for sorting or plotting: the value, or else the bound; `None` if there is neither.
    pub fn value_or_bound(self) -> Option<f64> {
        match self {
            CorrectedRmse::Estimate { value, .. } => Some(value),
            CorrectedRmse::Below(bound) => Some(bound),
            CorrectedRmse::ReferenceIsNoise => None,
        }
    }
}

/// Sums of products over the bands of one pixel.
struct PixelSums {
    sigma: f64,
    tau: f64,
    sigma_sigma: f64,
    tau_tau: f64,
    sigma_tau: f64,
    sigma_d: f64,
    sigma_t: f64,
    tau_d: f64,
}

impl PixelSums {
    fn new(bands: &[Sample]) -> Self {
        let sum = |term: fn(&Sample) -> f64| bands.iter().map(term).sum();
        PixelSums {
            sigma: sum(|s| s.sigma),
            tau: sum(|s| s.tau),
            sigma_sigma: sum(|s| s.sigma * s.sigma),
            tau_tau: sum(|s| s.tau * s.tau),
            sigma_tau: sum(|s| s.sigma * s.tau),
            sigma_d: sum(|s| s.sigma * s.d()),
            sigma_t: sum(|s| s.sigma * s.t),
            tau_d: sum(|s| s.tau * s.d()),
        }
    }
}

impl ZScores {
    /// The range of [`ZScores::deviation`] if the standard errors are right.
    pub const CALIBRATED: RangeInclusive<f64> = 0.8..=1.25;

    /// The standard deviation about 0, sqrt(mean of z²). It also includes an error that all values share.
    pub fn deviation(&self) -> f64 {
        let count = self.value_count as f64;
        let squares = (count - 1.0) * self.variance + count * self.mean * self.mean;
        (squares / count).sqrt()
    }

    pub(super) fn new(samples: &[Sample]) -> Option<Self> {
        let scores: Vec<f64> = samples
            .iter()
            .filter(|sample| sample.variance() > 0.0)
            .map(|sample| sample.d() / sample.variance().sqrt())
            .collect();
        if scores.len() < 2 {
            return None;
        }
        let mean = sum(&scores, |z| *z) / scores.len() as f64;
        let squares = sum(&scores, |z| (z - mean).powi(2));
        Some(ZScores {
            value_count: scores.len(),
            mean,
            variance: squares / (scores.len() - 1) as f64,
        })
    }
}
