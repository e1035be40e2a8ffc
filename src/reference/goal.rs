//! When to stop refining a reference, and the size of its rounds.

use std::ops::ControlFlow;

use super::Reference;
use crate::{Result, Scene};

/// Number of rounds for a goal, and the minimum to reach one. Few large rounds have the smallest error, because the points of a round are
/// stratified together. But the standard error comes from the spread of the rounds and is unreliable with fewer.
const ROUNDS: u32 = 8;
/// Keeps rounds short enough to be saved often: about a minute on two cores.
const MOST_PATHS_PER_ROUND: u64 = 400_000_000;
const MOST_SAMPLES_PER_ROUND: u32 = 4096;
const FEWEST_SAMPLES_PER_ROUND: u32 = 4;
/// Samples of the first rounds, which measure how much the samples scatter.
const PILOT_SAMPLES_PER_ROUND: u32 = 16;

/// Exponent with which the error falls with the samples of a round: n^-½ if they were independent, n^-¾ in the Cornell box. Too high a
/// guess costs more rounds, too low a guess unnecessary samples.
const RATE: f64 = 0.65;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// A total number of samples in each pixel, and at least eight rounds.
    SamplesPerPixel(u32),
    /// [`Reference::relative_standard_error`] of the indirect light at or below this.
    StandardError(f64),
}

impl Reference {
    /// A reference without samples, with a round size that suits the goal. For a standard error it takes a few samples first and discards
    /// them.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) for an invalid scene, [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn start(
        scene: &Scene,
        goal: Goal,
        progress: &mut dyn FnMut(f32) -> ControlFlow<()>,
    ) -> Result<Reference> {
        let mut reference = Reference::new(scene, PILOT_SAMPLES_PER_ROUND)?;
        let samples_per_pixel = match goal {
            Goal::SamplesPerPixel(samples) => samples,
            Goal::StandardError(target) => {
                for _ in 0..ROUNDS {
                    reference.add_round(progress)?;
                }
                let error = reference.relative_standard_error().unwrap_or_default();
                let growth = (error / target).powf(1.0 / RATE);
                (f64::from(ROUNDS * PILOT_SAMPLES_PER_ROUND) * growth) as u32
            }
        };
        reference.samples_per_round = reference.round_for(samples_per_pixel);
        reference.rounds = 0;
        for pixel in &mut reference.pixels {
            pixel.indirect = Default::default();
            pixel.indirect_phasors.fill(Default::default());
        }
        Ok(reference)
    }

    /// The power of two that divides the samples into enough rounds of acceptable length.
    fn round_for(&self, samples_per_pixel: u32) -> u32 {
        let seen = self.pixels.iter();
        let seen = seen.filter(|pixel| pixel.point.is_some() || pixel.footprint.is_some());
        let most_paths_per_sample = seen.count() as u64 * self.transport.most_paths();
        let bearable = MOST_PATHS_PER_ROUND / most_paths_per_sample.max(1);
        let most = bearable.min(MOST_SAMPLES_PER_ROUND.into()) as u32;
        let samples = (samples_per_pixel / ROUNDS).min(most);
        1 << samples.max(FEWEST_SAMPLES_PER_ROUND).ilog2()
    }

    /// Progress towards the goal, 0 to 1; 1 when it is reached.
    pub fn progress_to(&self, goal: Goal) -> f64 {
        self.progress_with(goal, self.rounds)
    }

    /// Expected progress after the next round: noise falls with the root of the number of rounds.
    pub fn progress_after_round(&self, goal: Goal) -> f64 {
        self.progress_with(goal, self.rounds + 1)
    }

    fn progress_with(&self, goal: Goal, rounds: u32) -> f64 {
        let by_rounds = |due: u32| f64::from(rounds) / f64::from(due);
        let share = match goal {
            Goal::SamplesPerPixel(samples) => {
                by_rounds(samples.max(1)) * f64::from(self.samples_per_round)
            }
            Goal::StandardError(_) if self.has_no_indirect_light() => 1.0,
            Goal::StandardError(target) => {
                let error = self.relative_standard_error();
                let by_error = error.map_or(0.0, |error| (target / error).powi(2));
                by_error * by_rounds(self.rounds.max(1))
            }
        };
        share.min(by_rounds(ROUNDS)).min(1.0)
    }

    /// Whether the goal is reached.
    pub fn meets(&self, goal: Goal) -> bool {
        self.progress_to(goal) >= 1.0
    }
}
