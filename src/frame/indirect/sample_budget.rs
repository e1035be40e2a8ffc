//! From the error that is aimed at to the samples of a gather and the tolerance of interpolation.

use super::error_estimate::ErrorEstimate;
use crate::{
    passes::{final_gather, refinement::RefinementCriteria},
    scene::ErrorNorm,
};

/// Samples of the pilots, two of which there are at least: more where the light is hard to find.
pub(super) const PILOT_SAMPLES: [u32; 5] = [64, 64, 64, 64, 1024];
/// Attempts to meet the target. The last one of a sum leaves nothing to interpolation.
pub(super) const MAX_ATTEMPTS: u32 = 4;
/// Samples of a gather at most.
const MAX_SAMPLES: u32 = final_gather::MAX_SAMPLES as u32;
/// Samples come in packets of rays.
const SAMPLES_STEP: u32 = 64;
/// Noise of a gathered pixel over the error of the image: smoothing and interpolation take some of it away (measured: 1 to 2.6).
const NOISE_OVER_TARGET: f64 = 1.25;
/// What an interpolated pixel may be off by where it is worst, over the error aimed at (measured of sums: the image's is then 0.2 to
/// 0.7 of the latter; half of this takes a tenth more pixels).
const TOLERANCE_OVER_AIM: f64 = 4.0;
/// What an interpolated pixel may be off by at most.
const MAX_TOLERANCE: f64 = 0.2;

/// How hard an attempt tries.
pub(super) struct SampleBudget {
    /// Samples of a gather.
    pub samples: u32,
    variance_scale: f64,
    relative_noise: f64,
    tolerance: Option<f64>,
}

impl SampleBudget {
    /// With rays, whose noise the pilot measured.
    pub fn for_rays(aim: f64, pilot: &ErrorEstimate) -> SampleBudget {
        let noise = NOISE_OVER_TARGET * aim;
        let steps = (pilot.samples_for(noise) / f64::from(SAMPLES_STEP)).ceil();
        let steps = steps.clamp(1.0, f64::from(MAX_SAMPLES / SAMPLES_STEP)) as u32;
        let samples = steps * SAMPLES_STEP;
        SampleBudget {
            samples,
            variance_scale: pilot.variance_scale(samples),
            relative_noise: pilot.relative_noise(samples),
            tolerance: Some((TOLERANCE_OVER_AIM * aim).min(MAX_TOLERANCE)),
        }
    }

    /// What an attempt with the fewest samples aims at.
    pub fn coarsest_aim(pilot: &ErrorEstimate) -> f64 {
        let mut aim = MAX_TOLERANCE / TOLERANCE_OVER_AIM;
        while SampleBudget::for_rays(aim, pilot).samples > SAMPLES_STEP {
            aim *= 1.2;
        }
        aim
    }

    /// With sums, which have no noise.
    pub fn for_sums(aim: f64, is_last: bool) -> SampleBudget {
        SampleBudget {
            samples: 0,
            variance_scale: 0.0,
            relative_noise: 0.0,
            tolerance: (!is_last).then_some(TOLERANCE_OVER_AIM * aim),
        }
    }

    /// Whether more samples are not to be had.
    pub fn is_largest(&self) -> bool {
        self.samples == MAX_SAMPLES
    }

    /// For an image of this radiance, W/sr/m².
    pub fn criteria(&self, radiance: f64, norm: ErrorNorm) -> RefinementCriteria {
        RefinementCriteria {
            radiance,
            is_local: norm == ErrorNorm::Local,
            tolerance: self.tolerance,
            variance_scale: self.variance_scale,
            relative_noise: self.relative_noise,
        }
    }
}

/// What to aim at after an attempt that was off by `error`.
pub(super) fn next_aim(aim: f64, target: f64, error: f64, is_exact: bool) -> f64 {
    let shrink = if is_exact {
        // The error falls more slowly than what is aimed at; and what was gathered is not lost.
        (0.9 * target / error).powi(2)
    } else {
        // To miss again costs more than to do a little too much.
        0.8 * target / error
    };
    aim * shrink.max(0.25)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_the_noise_takes_samples_in_whole_packets() {
        let pilot = ErrorEstimate::of_pilot(1.0, 0.01, 64);
        let samples_for = |noise| SampleBudget::for_rays(noise / NOISE_OVER_TARGET, &pilot).samples;
        assert_eq!(samples_for(1.0), SAMPLES_STEP);
        assert_eq!(samples_for(0.05), 192);
        assert_eq!(samples_for(1e-9), MAX_SAMPLES);
    }
}
