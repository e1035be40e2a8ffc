//! Gathers until the requested error is met.
//!
//! A pilot at a sample of pixels tells how bright the image is and how noisy gathers are. From that follow the samples of a gather
//! and the tolerance of interpolation. The image's error is then estimated on the sample, by gathers that share nothing with
//! the image's; where it is too large, another attempt follows.

use super::{
    error_estimate::{ErrorEstimate, PixelSample},
    refine::Refiner,
    sample_budget::{MAX_ATTEMPTS, PILOT_SAMPLES, SECOND_PILOT_SAMPLES, SampleBudget, next_aim},
};
use crate::{Result, plan::RefinementPlan};

/// Fills the indirect radiance and estimates its relRMSE. `None` where every pixel is gathered, and where the light is too
/// dark to be estimated: final gathering then leaves the image as it is.
pub(super) fn gather(mut refiner: Refiner, plan: RefinementPlan) -> Result<Option<f64>> {
    let is_exact = refiner.gatherer.is_exact();
    let may_interpolate = refiner.gatherer.may_interpolate();
    let Some(target) = plan.target_error.filter(|_| may_interpolate) else {
        gather_every_pixel(&mut refiner)?;
        return Ok(None);
    };
    let mut sample = PixelSample::new(&refiner)?;
    let pilot = pilot(&mut refiner, &mut sample)?;
    if pilot.is_dark() {
        if is_exact {
            gather_every_pixel(&mut refiner)?;
        }
        return Ok(None);
    }
    let mut resources = refiner.resources(plan.coarsest_stride)?;
    let mut aim = target;
    let mut attempt = 0;
    loop {
        let is_last = attempt + 1 == MAX_ATTEMPTS;
        refiner.progress.begin_attempt(attempt, is_last);
        let budget = if is_exact {
            SampleBudget::for_sums(aim, is_last)
        } else {
            SampleBudget::for_rays(aim, &pilot)
        };
        // What was gathered exactly stays.
        let starts_anew = attempt == 0 || !is_exact;
        let criteria = budget.criteria(pilot.radiance());
        refiner.refine(&mut resources, budget.samples, criteria, starts_anew)?;
        let estimate = sample.estimate(&mut refiner, budget.samples, 1.0)?;
        let error = estimate.relative_error();
        if error <= target || is_last || budget.is_largest() {
            return Ok(Some(error));
        }
        aim = next_aim(aim, target, error, is_exact);
        attempt += 1;
    }
}

/// Looks at the sample, and lets the gatherer learn from that.
fn pilot(refiner: &mut Refiner, sample: &mut PixelSample) -> Result<ErrorEstimate> {
    let results = 2 * sample.count;
    refiner.gatherer.begin_pilot(results, PILOT_SAMPLES)?;
    let mut pilot = sample.estimate(refiner, PILOT_SAMPLES, 0.0)?;
    if refiner.gatherer.learn(results, PILOT_SAMPLES)? {
        pilot = sample.estimate(refiner, PILOT_SAMPLES, 0.0)?;
    }
    if pilot.is_dark() && !refiner.gatherer.is_exact() {
        pilot = sample.estimate(refiner, SECOND_PILOT_SAMPLES, 0.0)?;
    }
    Ok(pilot)
}

fn gather_every_pixel(refiner: &mut Refiner) -> Result<()> {
    refiner.progress.begin_attempt(0, true);
    let mut resources = refiner.resources(1)?;
    let budget = SampleBudget::for_sums(1.0, true);
    refiner.refine(&mut resources, budget.samples, budget.criteria(1.0), true)
}
