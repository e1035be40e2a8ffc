//! The error of an image of more than one quantity: its light, and with time of flight Z of each frequency.

use super::error_estimate::ErrorEstimate;
use crate::scene::MAX_FREQUENCIES;

/// Errors of Z count over that of light at most so many times: where paths cancel each other, Z is not to take all samples there are.
const MAX_ERROR_SCALE: f64 = 1e4;

/// Of each quantity.
pub(super) struct ImageEstimate {
    /// Light, and Z of each frequency.
    quantities: Vec<ErrorEstimate>,
    /// That which scatters most: samples are handed out for it.
    hardest: usize,
}

impl ImageEstimate {
    pub fn new(light: ErrorEstimate, phasors: Vec<ErrorEstimate>) -> ImageEstimate {
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
        }
    }

    pub fn light(&self) -> &ErrorEstimate {
        &self.quantities[0]
    }

    pub fn hardest(&self) -> &ErrorEstimate {
        &self.quantities[self.hardest]
    }

    /// No light was found.
    pub fn is_dark(&self) -> bool {
        self.light().is_dark()
    }

    /// relRMSE of the worst quantity.
    pub fn relative_error(&self) -> f64 {
        self.worst(ErrorEstimate::relative_error)
    }

    /// What that is below, as [`ErrorEstimate::upper_bound`] has it.
    pub fn upper_bound(&self) -> f64 {
        self.worst(ErrorEstimate::upper_bound)
    }

    /// Of the quantities that there are: no bounce of ambient light has a Z.
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

    /// As [`ErrorEstimate::samples_to_decide`], for the quantity that takes most.
    pub fn samples_to_decide(&self, target: f64, used: usize) -> usize {
        let there = self.quantities.iter().filter(|each| !each.is_absent());
        let samples = there.map(|each| each.samples_to_decide(target, used));
        samples.max().unwrap_or_default()
    }

    /// As [`ErrorEstimate::observe_noise`].
    pub fn observe_noise(&mut self, gathers: &ImageEstimate) -> f64 {
        self.quantities[self.hardest].observe_noise(&gathers.quantities[self.hardest])
    }

    /// Adds what other pixels tell.
    pub fn add(&mut self, other: ImageEstimate) {
        for (own, other) in self.quantities.iter_mut().zip(other.quantities) {
            own.add(other);
        }
    }

    /// Square of an error of light over that of Z that is as bad, for each frequency.
    pub fn error_scales(&self) -> [f32; MAX_FREQUENCIES] {
        let light = self.light().radiance.powi(2);
        std::array::from_fn(|frequency| {
            let phasors = self.quantities.get(1 + frequency);
            let scale = |phasors: &ErrorEstimate| {
                let scale = light / phasors.radiance.powi(2);
                scale.min(MAX_ERROR_SCALE) as f32
            };
            phasors.filter(|each| !each.is_absent()).map_or(0.0, scale)
        })
    }
}
