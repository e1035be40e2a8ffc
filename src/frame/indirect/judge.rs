//! Judges an attempt: estimates its error at probe pixels, and whether the target is met.

use std::collections::VecDeque;

use super::{
    expected_errors::ExpectedErrors,
    image_estimate::ImageEstimate,
    limits::{FEW_PROBE_PIXELS, PROBE_PIXELS, pixels_for},
    listed_pixels::ListedPixels,
    probe_pixels::{ProbePixels, tile_px},
    refine::{Attempt, Refiner},
};
use crate::{Result, passes::refinement::RefinementImages, plan::RefinementPlan, scene::ErrorNorm};

/// Most pixels for judging an attempt, and most sets of such pixels. More pixels cost more rays than another attempt.
const MAX_PIXELS: u32 = 2 * PROBE_PIXELS;
const MAX_SETS: u32 = 3;
/// Few pixels decide only that the target is met, and only if their bound is at most this share of it.
const MAX_BOUND_OF_FEW: f64 = 0.6;
/// They decide nothing if the image expects more than the target (measured over small and large frames of eight scenes: where they decide, it
/// expects 0.41 to 0.80 of it).
const MOST_EXPECTED_WITH_FEW: f64 = 1.0;

/// What the attempts of a frame are judged with.
pub(super) struct Judge {
    /// The last attempt's. Each attempt has pixels of its own: no earlier ones tell what it changed, and where its errors are now.
    probes: Vec<ProbePixels>,
    /// How often a bound was compared with the target.
    looks: u32,
}

impl Judge {
    /// Begins with the probe pixels of a pilot without noise, which serves all attempts; or with none.
    pub fn new(noiseless: Option<ProbePixels>) -> Judge {
        Judge {
            probes: noiseless.into_iter().collect(),
            looks: 0,
        }
    }

    /// Estimates the image's error. If few pixels do not show that the target is met, uses more; still more if only the upper bound is above
    /// the target.
    pub fn judge(
        &mut self,
        refiner: &mut Refiner,
        plan: RefinementPlan,
        attempt: &Attempt,
        pixels: u32,
        images: &RefinementImages,
    ) -> Result<ImageEstimate> {
        let Attempt {
            criteria, samples, ..
        } = *attempt;
        let target = plan.target_error.unwrap_or_default();
        let Judge { probes, looks } = self;
        if refiner.gatherer.is_noiseless() {
            probes[0].record_estimate(refiner, images, samples)?;
            refiner.context.finish()?;
            return probes[0].estimate(refiner);
        }
        probes.clear();
        let tile_px = tile_px(plan.error_norm, refiner.context.plan.resolution_px);
        let mut readback = refiner.context.readback.borrow_mut();
        let expected = ExpectedErrors::read(refiner, images, tile_px, &mut readback)?;
        // Two sets take twice the rays from the lights.
        let few = match pixels < PROBE_PIXELS {
            true => pixels,
            false => pixels_for(plan, FEW_PROBE_PIXELS),
        };
        let rest = PROBE_PIXELS.saturating_sub(few);
        let sizes: &[u32] = if few == pixels { &[few] } else { &[few, rest] };
        // A tile would have too few of the few. If they do not decide, the host need not look at them before the rest.
        let may_be_few = plan.error_norm == ErrorNorm::Image
            && expected.relative_error(criteria.radiance) <= MOST_EXPECTED_WITH_FEW * target;
        let seed_of = |number: u32| 1 + attempt.number * MAX_SETS + number;
        let list = |refiner: &Refiner, (number, &pixels): (u32, &u32)| {
            let seed = seed_of(number);
            ListedPixels::by_expected_error(refiner, images, &expected, criteria, pixels, seed)
        };
        // The device lists both at once, because the host waits for it.
        let listed = (0..).zip(sizes).map(|size| list(refiner, size));
        let mut listed = listed.collect::<Result<VecDeque<_>>>()?;
        refiner.context.finish()?;
        // Compares the image with further pixels, and returns what was found at these.
        let mut compare_with = |sizes: &[u32]| {
            let first = probes.len();
            for &pixels in sizes {
                let number = probes.len() as u32;
                let ready = match listed.pop_front() {
                    Some(ready) => ready,
                    None => {
                        let further = list(refiner, (number, &pixels))?;
                        refiner.context.finish()?;
                        further
                    }
                };
                let (norm, seed) = (plan.error_norm, seed_of(number));
                let mut probe =
                    ProbePixels::listed(refiner, images, ready, norm, criteria, pixels, seed)?;
                // The first two are there in any case, unless the error is far below the target.
                if number >= 2 {
                    probe = probe.further();
                }
                probe.record_estimate(refiner, images, samples)?;
                probes.push(probe);
            }
            refiner.context.finish()?;
            estimate_of(refiner, &probes[first..])
        };
        let at_first = if may_be_few { 1 } else { sizes.len() };
        let mut estimate = compare_with(&sizes[..at_first])?;
        estimate.set_looks(*looks + 1);
        *looks += 1;
        let is_enough = may_be_few && estimate.upper_bound() <= MAX_BOUND_OF_FEW * target;
        if is_enough || few == pixels {
            return Ok(estimate);
        }
        if at_first < sizes.len() {
            estimate.add(compare_with(&sizes[at_first..])?);
        }
        let enough = f64::from(PROBE_PIXELS) * estimate.growth_to_decide(target);
        if estimate.relative_error() < target
            && estimate.upper_bound() > target
            && enough <= f64::from(MAX_PIXELS.min(pixels))
        {
            let more = (enough as u32 - PROBE_PIXELS).max(FEW_PROBE_PIXELS);
            estimate.add(compare_with(&[more])?);
            *looks += 1;
            estimate.set_looks(*looks);
        }
        Ok(estimate)
    }

    /// Estimates the image's error with the gathers of the last estimate, without further rays.
    pub fn judge_again(
        &mut self,
        refiner: &Refiner,
        images: &RefinementImages,
    ) -> Result<ImageEstimate> {
        for probe in &mut self.probes {
            probe.record_estimate_again(refiner, images)?;
        }
        refiner.context.finish()?;
        let mut estimate = estimate_of(refiner, &self.probes)?;
        self.looks += 1;
        estimate.set_looks(self.looks);
        Ok(estimate)
    }
}

/// The estimate of all probe pixels together.
fn estimate_of(refiner: &Refiner, probes: &[ProbePixels]) -> Result<ImageEstimate> {
    let mut estimate = probes[0].estimate(refiner)?;
    for probe in &probes[1..] {
        estimate.add(probe.estimate(refiner)?);
    }
    Ok(estimate)
}
