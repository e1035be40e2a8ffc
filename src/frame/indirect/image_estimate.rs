//! The error of an image with several quantities: its light, and with time of flight Z of each frequency.

use super::error_estimate::{ErrorEstimate, PixelEstimate};
use crate::passes::modulation::USUAL_TURNING_SHARE;
use crate::{metrics::LEAST_RANGE_SIGNAL, plan::Plan, scene::MAX_FREQUENCIES};

/// Where paths cancel each other, Z may be almost 0. Errors of Z are relative to at least this share of the light's root mean square,
/// because no number of samples would be enough otherwise.
const LEAST_PHASOR: f64 = 0.01;
/// Standard deviations of noise that are subtracted from the square of Z.
const SIGNAL_DEVIATIONS: f64 = 2.0;

/// The error estimates of all quantities.
pub(super) struct ImageEstimate {
    /// Light, and Z of each frequency.
    quantities: Vec<ErrorEstimate>,
    /// Index of the quantity that scatters most. Samples are distributed for it.
    hardest: usize,
    /// If the target is an error of range.
    range: Option<RangeFigures>,
}

/// What the errors of range are made of, for each frequency.
#[derive(Debug, Clone, Copy)]
pub(super) struct RangeFigures {
    pub target: RangeTarget,
    pub mean_squares: [f64; MAX_FREQUENCIES],
    /// Share of the squared noise of Z that turns its phase. Only a pilot measures it.
    pub turning_shares: [f32; MAX_FREQUENCIES],
}

/// A target error of range.
#[derive(Debug, Clone, Copy)]
pub(super) struct RangeTarget {
    /// An error of range of so many metres counts as much as a relRMSE of 1.
    metres: f64,
}

impl RangeTarget {
    pub fn of(plan: &Plan) -> Option<RangeTarget> {
        let target_error = plan.bounce()?.refinement.target_error?;
        plan.target_range_error_m().map(|target_m| RangeTarget {
            metres: target_m / target_error,
        })
    }

    /// Turns |Z|² of pixels into what their errors of range are relative to: the same for all that count. Returns the mean |Z|².
    pub fn settle(self, phasors: &mut [PixelEstimate]) -> f64 {
        let sum = |of: &dyn Fn(&PixelEstimate) -> f64| phasors.iter().map(of).sum::<f64>();
        let weights = sum(&|pixel| pixel.weight);
        let squares = sum(&|pixel| pixel.weight * f64::from(pixel.sums[1]));
        let mean = squares / weights.max(f64::MIN_POSITIVE);
        for pixel in phasors {
            let counts = pixel.sums[1] > 0.0
                && f64::from(pixel.sums[1]) >= LEAST_RANGE_SIGNAL.powi(2) * mean;
            match counts {
                true => pixel.sums[1] = self.metres.powi(2) as f32,
                false => pixel.sums = [0.0; 4],
            }
        }
        mean
    }
}

/// Shifts the signals of pixels so that their mean is the square that errors of Z are relative to. That is the mean minus its uncertainty,
/// but at least a share of `seen`, the root mean square of the light that the camera sees. If Z is mostly noise, its square may come out
/// many times too large.
pub(super) fn settle_signals(phasors: &mut [PixelEstimate], seen: f64) {
    let least = (LEAST_PHASOR * seen).powi(2);
    let (mut sum, mut variance, mut count) = (0.0, 0.0, 0.0);
    for PixelEstimate { weight, sums, .. } in phasors.iter() {
        let [_, signal, noise, _] = sums.map(f64::from);
        sum += weight * signal;
        // Variance of t₁·t₂ around |Z|², where |t₁ − t₂|² is 2σ² on average and its square 8σ⁴: σ⁴/2 + |Z|²·σ².
        variance += weight * weight * (noise * noise / 16.0 + signal.max(0.0) * noise / 2.0);
        count += weight;
    }
    let count = f64::max(count, f64::MIN_POSITIVE);
    let without_doubt = (sum - SIGNAL_DEVIATIONS * variance.sqrt()) / count;
    let change = without_doubt.max(least) - sum / count;
    for pixel in phasors {
        pixel.sums[1] += change as f32;
    }
}

impl ImageEstimate {
    pub fn new(
        light: ErrorEstimate,
        phasors: Vec<ErrorEstimate>,
        range: Option<RangeFigures>,
    ) -> ImageEstimate {
        let mut quantities = vec![light];
        quantities.extend(phasors);
        let variance = |&index: &usize| match quantities[index].relative_variance() {
            variance if variance.is_finite() => variance,
            _ => -1.0,
        };
        let hardest = (0..quantities.len())
            .max_by(|a, b| variance(a).total_cmp(&variance(b)))
            .unwrap_or_default();
        ImageEstimate {
            quantities,
            hardest,
            range,
        }
    }

    pub fn light(&self) -> &ErrorEstimate {
        &self.quantities[0]
    }

    pub fn hardest(&self) -> &ErrorEstimate {
        &self.quantities[self.hardest]
    }

    /// Whether no light was found.
    pub fn is_dark(&self) -> bool {
        self.light().is_dark()
    }

    /// relRMSE of the worst quantity.
    pub fn relative_error(&self) -> f64 {
        self.worst(ErrorEstimate::relative_error)
    }

    /// Sets how often a bound was compared with the target, this time included.
    pub fn set_looks(&mut self, looks: u32) {
        for quantity in &mut self.quantities {
            quantity.looks = looks;
        }
    }

    /// Upper bound of the relRMSE, as in [`ErrorEstimate::upper_bound`].
    pub fn upper_bound(&self) -> f64 {
        self.worst(ErrorEstimate::upper_bound)
    }

    /// The worst of the quantities that exist: a bounce of ambient light has no Z.
    fn worst(&self, of: impl Fn(&ErrorEstimate) -> f64) -> f64 {
        let there = self.quantities.iter().filter(|each| !each.is_absent());
        let values = there.map(|each| {
            if each.is_dark() {
                f64::INFINITY
            } else {
                of(each)
            }
        });
        values.fold(0.0, f64::max)
    }

    /// As [`ErrorEstimate::growth_to_decide`], for the quantity that needs most.
    pub fn growth_to_decide(&self, target: f64) -> f64 {
        let there = self.quantities.iter().filter(|each| !each.is_absent());
        let growths = there.map(|each| each.growth_to_decide(target));
        growths.fold(0.0, f64::max)
    }

    /// As [`ErrorEstimate::observed_noise`].
    pub fn observed_noise(&self, gathers: &ImageEstimate) -> f64 {
        self.hardest().observed_noise(self.hardest_of(gathers))
    }

    /// As [`ErrorEstimate::scale_noise`].
    pub fn scale_noise(&mut self, factor: f64) {
        self.quantities[self.hardest].scale_noise(factor);
    }

    /// The quantity that samples are distributed for, in another estimate.
    pub fn hardest_of<'e>(&self, other: &'e ImageEstimate) -> &'e ErrorEstimate {
        &other.quantities[self.hardest]
    }

    /// relRMSE of all that a target error is for, and its upper bound.
    pub fn relative_errors(&self) -> [f64; 2] {
        match self.range {
            Some(_) => [self.light().relative_error(), self.light().upper_bound()],
            None => [self.relative_error(), self.upper_bound()],
        }
    }

    /// Error of range of the worst frequency, metres, and its upper bound; only if the target is one of range.
    pub fn range_errors_m(&self) -> Option<[f64; 2]> {
        let range = self.range?.target;
        let there = self.quantities[1..].iter();
        let there = there.filter(|each| !each.is_absent());
        let errors = there.map(|each| [each.relative_error(), each.upper_bound()]);
        let worst = errors.reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])])?;
        Some(worst.map(|error| error * range.metres))
    }

    /// Mean |Z|² of each frequency; only if the target is an error of range.
    pub fn mean_squares(&self) -> Option<[f64; MAX_FREQUENCIES]> {
        self.range.map(|range| range.mean_squares)
    }

    pub fn turning_shares(&self) -> [f32; MAX_FREQUENCIES] {
        let usual = [USUAL_TURNING_SHARE; MAX_FREQUENCIES];
        self.range.map_or(usual, |range| range.turning_shares)
    }

    /// Adds the estimate of other pixels.
    pub fn add(&mut self, other: ImageEstimate) {
        for (own, other) in self.quantities.iter_mut().zip(other.quantities) {
            own.add(other);
        }
    }

    /// (rms of light / rms of Z)² of each frequency.
    pub fn error_scales(&self) -> [f32; MAX_FREQUENCIES] {
        let light = self.light().radiance.powi(2);
        std::array::from_fn(|frequency| {
            let phasors = self.quantities.get(1 + frequency);
            let scale = |phasors: &ErrorEstimate| (light / phasors.radiance.powi(2)) as f32;
            phasors.filter(|each| !each.is_absent()).map_or(0.0, scale)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(pixels: &[PixelEstimate]) -> ErrorEstimate {
        ErrorEstimate::new(pixels, 1, 4, None)
    }

    /// Equal pixels.
    fn pixels(sums: [f32; 4]) -> [PixelEstimate; 16] {
        [PixelEstimate {
            weight: 1.0,
            sums,
            pixel: [0.0; 4],
            of_image: [0.0; 4],
        }; 16]
    }

    #[test]
    fn paths_that_cancel_do_not_make_an_infinite_error() {
        // Signals that noise has made negative, no signal, and a tiny one.
        for signal in [-1e-6, 0.0, 1e-7] {
            let mut phasors = pixels([1e-6, signal, 2e-6, 1e-4]);
            settle_signals(&mut phasors, 1.0);
            let image = ImageEstimate::new(
                estimate(&pixels([0.01, 3.0, 0.01, 0.3])),
                vec![estimate(&phasors)],
                None,
            );
            // 1e-6 over 0.01².
            let error = image.relative_error();
            assert!(
                (error - (1e-6_f64 / 1e-4).sqrt()).abs() < 1e-3 * error,
                "{error}"
            );
            assert!((image.error_scales()[0] - 3e4).abs() < 3.0);
            assert!(image.hardest().relative_variance().is_finite());
        }
    }

    /// The mean of 16 products of two draws of noise may be 1/16 of the noise's square, without any signal.
    #[test]
    fn noise_is_no_signal() {
        let noise = 2.0_f32;
        let mut phasors = pixels([1.0, noise / 16.0, noise, 1.0]);
        settle_signals(&mut phasors, 1.0);
        let mean = estimate(&phasors).radiance.powi(2) * 3.0;
        assert!((mean - 1e-4).abs() < 1e-7, "{mean}");
        // A signal that stands out is kept, minus twice its standard deviation, √(1/4 + 100)/4.
        let mut phasors = pixels([1.0, 100.0, noise, 1.0]);
        settle_signals(&mut phasors, 1.0);
        let mean = estimate(&phasors).radiance.powi(2) * 3.0;
        assert!(
            (mean - (100.0 - 0.5 * 100.25_f64.sqrt())).abs() < 1e-3,
            "{mean}"
        );
    }

    #[test]
    fn what_is_not_there_counts_for_nothing() {
        let light = || estimate(&pixels([0.01, 3.0, 0.01, 0.3]));
        let mut nothing = pixels([0.0; 4]);
        settle_signals(&mut nothing, 1.0);
        let image = ImageEstimate::new(light(), vec![estimate(&nothing)], None);
        assert_eq!(image.relative_error(), light().relative_error());
        assert_eq!(image.error_scales(), [0.0; 4]);
    }

    #[test]
    fn ranges_count_where_there_is_signal_and_against_their_own_target() {
        let target = RangeTarget { metres: 0.1 };
        let mut phasors = pixels([1e-4, 9.0, 1e-4, 1.0]);
        // As weak as 1 % of the root mean square.
        for pixel in &mut phasors[..4] {
            pixel.sums = [5.0, 5e-4, 5.0, 5.0];
        }
        let mean_square = target.settle(&mut phasors);
        assert!((mean_square - 0.75 * 9.0).abs() < 1e-3, "{mean_square}");
        let figures = RangeFigures {
            target,
            mean_squares: [mean_square, 0.0, 0.0, 0.0],
            turning_shares: [USUAL_TURNING_SHARE; MAX_FREQUENCIES],
        };
        let light = || estimate(&pixels([0.01, 4.0, 0.01, 0.3]));
        let image = ImageEstimate::new(light(), vec![estimate(&phasors)], Some(figures));
        // An error of 1 cm, as much as a relRMSE of 10 %.
        let [error_m, upper_m] = image.range_errors_m().expect("there is a target");
        assert!((error_m - 0.01).abs() < 1e-6, "{error_m}");
        assert!(upper_m >= error_m);
        assert!((image.relative_error() - 0.1).abs() < 1e-5);
        assert!((image.relative_errors()[0] - 0.05).abs() < 1e-5);
    }

    #[test]
    fn noise_along_z_turns_no_phase() {
        let light = estimate(&pixels([0.01, 3.0, 0.02, 1.0]));
        // Half of the noise of light that scatters as much.
        let mut range = estimate(&pixels([0.01, 3.0, 0.01, 1.0]));
        assert!((range.match_evenness(&light) - 0.5).abs() < 1e-6);
        assert!((range.evenness() - light.evenness()).abs() < 1e-9);
        let mut dark = estimate(&pixels([0.0; 4]));
        assert!(dark.match_evenness(&light).is_finite());
    }
}
