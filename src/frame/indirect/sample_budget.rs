//! Derives the samples of each pixel and the tolerance of interpolation from the error that is aimed at.

use super::{
    error_estimate::ErrorEstimate,
    smoothed::{Distribution, VarianceFalloff},
};
use crate::{
    passes::{
        final_gather::MAX_SAMPLES,
        refinement::{GatherNoise, RefinementCriteria, SampleAllocation},
        sample_counts::PACKET_SAMPLES,
    },
    scene::ErrorNorm,
};

/// Most attempts to meet the target. The last attempt of a sum interpolates nothing.
pub(super) const MAX_ATTEMPTS: u32 = 4;
/// Most attempts with rays, which continue from one attempt to the next.
pub(super) const MAX_ATTEMPTS_OF_RAYS: u32 = 8;
/// Most packets of a pixel.
const MAX_PACKETS: u32 = MAX_SAMPLES / PACKET_SAMPLES;
/// Noise of a gathered pixel in the first attempt, over the error aimed at. Smoothing removes some of it (measured: 1 to 2.6 times).
const FIRST_NOISE_OVER_AIM: f64 = 1.25;
/// Noise of the gathers that an image is compared with, over the target error. (For Gaussian errors, 1.2 to 1.4 needs the fewest rays.)
const ESTIMATE_NOISE_OVER_TARGET: f64 = 1.4;
/// Largest growth of the packets of a pixel from one attempt to the next, on average. An error of a quarter takes 7 times the packets.
const MAX_GROWTH: f64 = 8.0;
/// Least noise of a pixel, over that of an equally bright pixel: its samples may have missed light.
const LEAST_NOISE: f64 = 0.1;
/// Largest error of an interpolated pixel over the error aimed at (measured for sums: the image's error is then 0.2 to 0.7 of the
/// error aimed at; half of this takes a tenth more pixels).
const TOLERANCE_OVER_AIM: f64 = 1.6;
/// Upper limit of the error of an interpolated pixel, unless the image is a preview: from this aim on.
const MAX_TOLERANCE: f64 = 0.2;
const ROUGH_AIM: f64 = 0.2;

/// The effort of an attempt.
pub(super) struct SampleBudget {
    /// Mean packets of a pixel.
    pub mean_packets: f64,
    noise: GatherNoise,
    allocation: SampleAllocation,
    tolerance: Option<f64>,
}

impl SampleBudget {
    /// The budget for rays of the first attempt, whose noise the pilot measured.
    pub fn for_rays(aim: f64, pilot: &ErrorEstimate) -> SampleBudget {
        let noise = pilot.noise_with(MAX_PACKETS);
        let scale = scale_for(|scale| noise(scale) <= FIRST_NOISE_OVER_AIM * aim);
        SampleBudget {
            mean_packets: pilot.mean_packets(scale, MAX_PACKETS),
            ..SampleBudget::with_scale(scale, aim, pilot)
        }
    }

    /// The budget for an image whose error is `shrink` times that of the last one.
    pub fn for_more_rays(
        aim: f64,
        shrink: f64,
        pilot: &ErrorEstimate,
        last: &ErrorEstimate,
    ) -> SampleBudget {
        let falloff = VarianceFalloff::new(pilot.variance_rate(), MAX_PACKETS);
        let with = |scale| Distribution::new(scale, pilot.packet_variance(), &falloff);
        let now = last.smoothed_now(with(1.0));
        let (wanted, most) = (shrink * shrink * now.error, MAX_GROWTH * now.mean_packets);
        let scale = scale_for(|scale| {
            let then = last.smoothed(with(scale));
            then.error <= wanted || then.mean_packets > most
        });
        SampleBudget {
            mean_packets: last.smoothed(with(scale)).mean_packets.max(1.0),
            ..SampleBudget::with_scale(scale, aim, pilot)
        }
    }

    fn with_scale(packets_scale: f64, aim: f64, pilot: &ErrorEstimate) -> SampleBudget {
        SampleBudget {
            mean_packets: 1.0,
            noise: GatherNoise {
                evenness: pilot.evenness(),
                rate: pilot.variance_rate(),
                relative: pilot.noise_with(MAX_PACKETS)(packets_scale),
            },
            allocation: SampleAllocation {
                packets_scale,
                variance_rate: pilot.variance_rate(),
                packet_variance: pilot.packet_variance(),
                max_packets: MAX_PACKETS,
                mean_variance: pilot.mean_variance(),
                least_variance: LEAST_NOISE * LEAST_NOISE * pilot.relative_variance(),
            },
            tolerance: Some(match aim > ROUGH_AIM {
                true => TOLERANCE_OVER_AIM * aim,
                false => (TOLERANCE_OVER_AIM * aim).min(MAX_TOLERANCE),
            }),
        }
    }

    /// How gathers are sampled that images are compared with. Their noise is about the error that is aimed at: with less, they would take
    /// more rays than they save pixels.
    pub fn of_estimate(target: f64, pilot: &ErrorEstimate) -> SampleAllocation {
        let noise = pilot.noise_with(MAX_PACKETS);
        let scale = scale_for(|scale| noise(scale) <= ESTIMATE_NOISE_OVER_TARGET * target);
        SampleBudget::with_scale(scale, target, pilot).allocation
    }

    /// The error that an attempt with the fewest samples aims at.
    pub fn coarsest_aim(pilot: &ErrorEstimate) -> f64 {
        let one_packet = pilot.noise_with(MAX_PACKETS)(0.0) / FIRST_NOISE_OVER_AIM;
        one_packet.max(MAX_TOLERANCE / TOLERANCE_OVER_AIM)
    }

    /// The least part of the last error to keep, from `shrink` on, that takes at most that many packets of a pixel.
    pub fn shrink_within(
        shrink: f64,
        most_packets: f64,
        pilot: &ErrorEstimate,
        last: &ErrorEstimate,
    ) -> f64 {
        let falloff = VarianceFalloff::new(pilot.variance_rate(), MAX_PACKETS);
        let with = |scale| Distribution::new(scale, pilot.packet_variance(), &falloff);
        let scale = scale_for(|scale| last.smoothed(with(scale)).mean_packets > most_packets);
        let [then, now] = [last.smoothed(with(scale)), last.smoothed_now(with(1.0))];
        let fitting = (then.error / now.error).sqrt();
        shrink.max(fitting.min(1.0))
    }

    /// The budget for sums, which have no noise.
    pub fn for_sums(aim: f64, is_last: bool) -> SampleBudget {
        SampleBudget {
            mean_packets: 0.0,
            noise: GatherNoise::default(),
            allocation: SampleAllocation::default(),
            tolerance: (!is_last).then_some(TOLERANCE_OVER_AIM * aim),
        }
    }

    /// Whether the number of samples cannot grow.
    pub fn is_largest(&self) -> bool {
        self.mean_packets >= f64::from(MAX_PACKETS)
    }

    /// Approximate number of samples of a gather: a power of two.
    pub fn samples(&self) -> u32 {
        (PACKET_SAMPLES * self.mean_packets.ceil() as u32).next_power_of_two()
    }

    /// The criteria for an image of this radiance, W/sr/m².
    pub fn criteria(
        &self,
        radiance: f64,
        norm: ErrorNorm,
        allocation_of_estimate: SampleAllocation,
    ) -> RefinementCriteria {
        RefinementCriteria {
            radiance,
            is_local: norm == ErrorNorm::Local,
            tolerance: self.tolerance,
            noise: self.noise,
            allocation: self.allocation,
            allocation_of_estimate,
        }
    }
}

/// The least scale of packets with which that is so. The range covers one packet to all of them.
fn scale_for(is_enough: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (-60.0_f64, 60.0_f64);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if is_enough(middle.exp2()) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high.exp2()
}

/// The error to aim at after an attempt with the error `error`.
pub(super) fn next_aim(aim: f64, target: f64, error: f64, is_noiseless: bool) -> f64 {
    let shrink = if is_noiseless {
        // The error falls more slowly than the error aimed at, and what was gathered is kept.
        (0.9 * target / error).powi(2)
    } else {
        0.93 * target / error
    };
    aim * shrink.max(0.25)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_that_scatter_more_take_more_samples_and_the_noise_is_as_wanted() {
        // Of two equally bright pixels, one has 100 times the variance.
        let pilot = ErrorEstimate::of_pilot(&[0.01, 1.0]);
        for aim in [1e-1, 1e-2] {
            let budget = SampleBudget::for_rays(aim, &pilot);
            let noise = budget.noise.relative / (FIRST_NOISE_OVER_AIM * aim);
            assert!((0.7..=1.0).contains(&noise), "{noise}");
        }
        let one_packet = SampleBudget::for_rays(10.0, &pilot);
        assert_eq!(one_packet.mean_packets, 1.0);
        assert!(SampleBudget::for_rays(1e-9, &pilot).is_largest());
    }
}
