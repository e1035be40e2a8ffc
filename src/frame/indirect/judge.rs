//! Judges an attempt: estimates its error at a sample of pixels, and whether the target is met.

use std::collections::VecDeque;

use super::{
    expected_errors::ExpectedErrors,
    image_estimate::ImageEstimate,
    limits::pixels_for,
    listed_pixels::ListedPixels,
    pixel_sample::{FEW_PIXELS, PixelSample, SAMPLE_PIXELS, tile_px},
    refine::Refiner,
};
use crate::{
    Result,
    passes::refinement::{RefinementCriteria, RefinementImages},
    plan::RefinementPlan,
    scene::ErrorNorm,
};

/// Most pixels for judging an attempt, and most samples of pixels. More pixels cost more rays than another attempt.
const MAX_PIXELS: u32 = 2 * SAMPLE_PIXELS;
const MAX_SAMPLES: u32 = 3;
/// Few pixels decide only that the target is met, and only if their bound is at most this share of it.
const MAX_BOUND_OF_FEW: f64 = 0.6;
/// They decide nothing if the image expects more than the target (measured over small and large frames of eight scenes: where they decide, it
/// expects 0.41 to 0.80 of it).
const MOST_EXPECTED_WITH_FEW: f64 = 1.0;

/// What the attempts of a frame are judged with.
pub(super) struct Judge {
    /// The last attempt's. Each attempt has samples of its own: no earlier sample tells what it changed, and where its errors are now.
    samples: Vec<PixelSample>,
    /// How often a bound was compared with the target.
    looks: u32,
}

impl Judge {
    /// Begins with the sample of an exact pilot, which serves all attempts; or with none.
    pub fn new(exact: Option<PixelSample>) -> Judge {
        Judge {
            samples: exact.into_iter().collect(),
            looks: 0,
        }
    }

    /// Estimates the image's error. If few pixels do not show that the target is met, uses more; still more if only the upper bound is above
    /// the target.
    pub fn judge(
        &mut self,
        refiner: &mut Refiner,
        (plan, attempt, pixels): (RefinementPlan, u32, u32),
        images: &RefinementImages,
        (criteria, samples_per_pixel): (RefinementCriteria, u32),
    ) -> Result<ImageEstimate> {
        let target = plan.target_error.unwrap_or_default();
        let Judge { samples, looks } = self;
        if refiner.gatherer.is_exact() {
            samples[0].record_estimate(refiner, images, samples_per_pixel)?;
            refiner.context.finish()?;
            return samples[0].estimate(refiner);
        }
        samples.clear();
        let tile_px = tile_px(plan.error_norm, refiner.context.plan.resolution_px);
        let mut readback = refiner.context.readback.borrow_mut();
        let expected = ExpectedErrors::read(refiner, images, tile_px, &mut readback)?;
        let how = (plan.error_norm, criteria);
        // Two samples take twice the rays from the lights.
        let few = match pixels < SAMPLE_PIXELS {
            true => pixels,
            false => pixels_for(plan, FEW_PIXELS),
        };
        let rest = SAMPLE_PIXELS.saturating_sub(few);
        let sizes: &[u32] = if few == pixels { &[few] } else { &[few, rest] };
        // A tile would have too few of the few. If they do not decide, the host need not look at them before the rest.
        let may_be_few = plan.error_norm == ErrorNorm::Image
            && expected.relative_error(criteria.radiance) <= MOST_EXPECTED_WITH_FEW * target;
        let seed_of = |number: u32| 1 + attempt * MAX_SAMPLES + number;
        let list = |refiner: &Refiner, (number, &pixels): (u32, &u32)| {
            let which = (pixels, seed_of(number));
            ListedPixels::by_expected_error(refiner, images, &expected, criteria, which)
        };
        // The device lists both at once, because the host waits for it.
        let listed = (0..).zip(sizes).map(|size| list(refiner, size));
        let mut listed = listed.collect::<Result<VecDeque<_>>>()?;
        refiner.context.finish()?;
        // Compares the image with further pixels, and returns what was found at these.
        let mut compare_with = |sizes: &[u32]| {
            let first = samples.len();
            for &pixels in sizes {
                let number = samples.len() as u32;
                let ready = match listed.pop_front() {
                    Some(ready) => ready,
                    None => {
                        let further = list(refiner, (number, &pixels))?;
                        refiner.context.finish()?;
                        further
                    }
                };
                let which = (pixels, seed_of(number));
                let mut sample = PixelSample::listed(refiner, images, ready, how, which)?;
                // The first two are there in any case, unless the error is far below the target.
                if number >= 2 {
                    sample = sample.further();
                }
                sample.record_estimate(refiner, images, samples_per_pixel)?;
                samples.push(sample);
            }
            refiner.context.finish()?;
            estimate_of(refiner, &samples[first..])
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
        let enough = f64::from(SAMPLE_PIXELS) * estimate.growth_to_decide(target);
        if estimate.relative_error() < target
            && estimate.upper_bound() > target
            && enough <= f64::from(MAX_PIXELS.min(pixels))
        {
            let more = (enough as u32 - SAMPLE_PIXELS).max(FEW_PIXELS);
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
        for sample in &mut self.samples {
            sample.record_estimate_again(refiner, images)?;
        }
        refiner.context.finish()?;
        let mut estimate = estimate_of(refiner, &self.samples)?;
        self.looks += 1;
        estimate.set_looks(self.looks);
        Ok(estimate)
    }
}

/// The estimate of all samples together.
fn estimate_of(refiner: &Refiner, samples: &[PixelSample]) -> Result<ImageEstimate> {
    let mut estimate = samples[0].estimate(refiner)?;
    for sample in &samples[1..] {
        estimate.add(sample.estimate(refiner)?);
    }
    Ok(estimate)
}
