//! Gathers until the target error is met.
//!
//! Pilots at probe pixels show how bright the image is, how noisy gathers are, and where the lights' rays should go. They
//! determine the samples of a gather and the tolerance of interpolation. The image's error is then estimated at such pixels, with
//! gathers that share no samples with the image's. If the upper bound is too large, more pixels are sampled if that may decide it;
//! else another attempt follows.

use super::{
    ErrorEstimates,
    error_estimate::ErrorEstimate,
    image_estimate::ImageEstimate,
    judge::Judge,
    limits::{FEW_PROBE_PIXELS, Limits, PROBE_PIXELS, Spent, pixels_for, rays_of_pixel},
    listed_pixels::ScatteredPixels,
    probe_pixels::ProbePixels,
    refine::{Attempt, Refiner},
    sample_budget::{MAX_ATTEMPTS, MAX_ATTEMPTS_OF_RAYS, SampleBudget, next_aim},
};
use crate::{
    Result,
    output::StopReason,
    passes::{
        gatherer::GatheredFor,
        refinement::{RefinementImages, SampleAllocation},
    },
    plan::RefinementPlan,
};

/// Most pilots, and most pilots while none has found light. Packets of samples of each pilot, and of the last one if none has
/// found light.
const MAX_PILOTS: u32 = 16;
const MAX_PILOTS_IN_THE_DARK: u32 = 6;
const PILOT_PACKETS: u32 = 1;
const LAST_PACKETS_IN_THE_DARK: u32 = 16;
/// A rough image takes at most this many packets of a pixel.
const MAX_PACKETS_OF_ROUGH_IMAGE: f64 = 1.1;
/// Limits must leave room for this many more pilots, to take pilots of more pixels, or another one.
const LEAST_ROOM_FOR_MORE: f64 = 40.0;
const LEAST_ROOM_FOR_PILOTS: f64 = 10.0;
/// Least room for further attempts that makes the light of VPLs without occlusion worth its time.
const LEAST_ROOM_FOR_RATIO: f64 = 1.0;
/// Growth of the error that an estimate is made for, until enough pixels fit the limits.
const COARSER_ESTIMATE: f64 = 1.3;
/// Beyond this error there are no fewer packets.
const COARSEST_ESTIMATE: f64 = 100.0;
/// Seed of the pixels of pilots for a rough image.
const ROUGH_SEED: u32 = 1 << 10;
/// Pilots are repeated until one moves less than this share of the samples elsewhere.
const MAX_MOVED_SHARE: f64 = 0.3;
/// They are also repeated while the variance of a sample is more than `SCATTERED` times the square of its mean, if the last two have
/// saved `LEAST_GAIN` times what they took.
/// (A keyhole: 923, 148, 2. A slit of a fifth of a texel: 482, 181, 97, 64, 39, 32, 34, 21, 11, 9.)
const SCATTERED: f64 = 4.0;
const LEAST_GAIN: f64 = 2.0;
/// Least growth of an attempt for which a limit must leave room.
const LEAST_GROWTH: f64 = 0.25;
/// Least radiance that directions alone find, over that of both techniques. With less, they miss narrow light.
const LEAST_FOUND: f64 = 0.985;
/// Work of a ray to a VPL, over that of another ray: its candidates are weighed.
const WORK_OF_VPL_RAY: f64 = 2.0;
/// Most work of directions alone, over that of both techniques, for the same noise.
const MAX_WORK_OF_DIRECTIONS: f64 = 0.9;
/// Least samples of an image, over those of the trial of directions alone.
const TRIAL_SHARE: f64 = 16.0;
/// An attempt with directions alone that leaves more than this many times the expected error has missed something.
const MAX_SURPRISE: f64 = 1.5;
/// From this attempt on, the next one is to leave less by what this one left too much: attempts that fall short again and again would not
/// end.
const CAUTIOUS_FROM: u32 = 2;
/// Light over that of VPLs without occlusion is smoothed if the error falls to this part.
const LEAST_USE_OF_RATIO: f64 = 0.97;
/// First aim, over the target error. If the target is missed, the samples taken so far still count.
const FIRST_AIM: f64 = 1.3;

/// Fills the indirect radiance and estimates its relRMSE. There is no estimate if every pixel is gathered, or if the light is too
/// dark to be estimated. If it is too dark, final gathering leaves the image as it is.
pub(super) fn gather(refiner: &mut Refiner, plan: RefinementPlan) -> Result<ErrorEstimates> {
    let is_noiseless = refiner.gatherer.is_noiseless();
    let may_interpolate = refiner.gatherer.may_interpolate();
    let Some(target) = plan.target_error.filter(|_| may_interpolate) else {
        gather_every_pixel(refiner)?;
        return Ok(ErrorEstimates::default());
    };
    let mut limits = Limits::new(refiner.context, plan);
    let mut resources = refiner.resources(plan.coarsest_stride)?;
    let before = Spent::so_far(refiner.context);
    refiner.context.begin_step("pilot");
    let (mut probes, mut pilot) = pilot(refiner, &resources.images, plan, &limits)?;
    let pilots = Spent::so_far(refiner.context).since(&before);
    if pilot.is_dark() {
        if is_noiseless {
            gather_every_pixel(refiner)?;
        }
        // Further pilots might have found light.
        let is_cut_short = !is_noiseless && limits.room_for_pilots(&pilots) < LEAST_ROOM_FOR_PILOTS;
        return Ok(ErrorEstimates {
            stop: is_cut_short.then(|| limits.reason()),
            ..ErrorEstimates::default()
        });
    }
    refiner.scale_errors(&mut resources, pilot.error_scales(), pilot.turning_shares())?;
    // The pilot of directions alone, while the image is gathered with them.
    let mut alone = match is_noiseless {
        true => None,
        false => try_directions_alone(
            refiner,
            &resources.images,
            &mut probes,
            FIRST_AIM * target,
            &pilot,
            &limits,
        )?,
    };
    let mut judge = Judge::new(is_noiseless.then_some(probes));
    let mut found = ErrorEstimates::default();
    let mut aim = if is_noiseless {
        target
    } else {
        FIRST_AIM * target
    };
    if limits.are_set() {
        // Go from coarse to fine, so that there is an image at any time.
        aim = aim.max(SampleBudget::coarsest_aim(pilot.hardest()));
    }
    let mut attempt = 0;
    // The last estimate, and how much of its error is to remain.
    let mut last: Option<(ImageEstimate, f64)> = None;
    loop {
        let most = if is_noiseless {
            MAX_ATTEMPTS
        } else {
            MAX_ATTEMPTS_OF_RAYS
        };
        let is_last = attempt + 1 == most && !limits.are_set();
        refiner.progress.begin_attempt(attempt, is_last);
        refiner.context.begin_step("allocate_samples");
        let of_image = alone.as_ref().unwrap_or(&pilot);
        let budget = match &last {
            _ if is_noiseless => SampleBudget::for_sums(aim, is_last),
            None => SampleBudget::for_rays(aim, of_image.hardest()),
            Some((estimate, shrink)) => {
                let estimate = of_image.hardest_of(estimate);
                SampleBudget::for_more_rays(aim, *shrink, of_image.hardest(), estimate)
            }
        };
        let spent_before = Spent::so_far(refiner.context);
        let (of_estimate, packets_of_estimate) = match is_noiseless {
            true => (SampleAllocation::default(), 0.0),
            false => allocation_of_estimate(aim.max(target), pilot.hardest(), &limits),
        };
        let planned = limits.estimate_pixels(packets_of_estimate);
        let reserve = limits.reserve(planned, packets_of_estimate, budget.samples());
        if attempt == 0 && limits.rays_left(1.0).is_finite() {
            resources.begin_with(limits.stride(reserve, plan.coarsest_stride));
        }
        let squares = match &last {
            None => pilot.mean_squares(),
            Some((estimate, _)) => estimate.mean_squares(),
        };
        refiner.weigh_ranges(&resources, squares, attempt == 0)?;
        let criteria = budget.criteria(pilot.light().radiance, plan.error_norm, of_estimate);
        refiner.context.begin_step("gather");
        let of_attempt = Attempt {
            samples: budget.samples(),
            criteria,
            number: attempt,
            limits: &limits,
            reserve,
        };
        let took_all_samples = refiner.refine(&mut resources, &of_attempt)?;
        let is_cut_short = !took_all_samples && attempt > 0;
        let pixels_to_judge = limits.pixels_to_judge(planned, packets_of_estimate);
        refiner.context.begin_step("error_estimate");
        let images = &resources.images;
        let mut estimate = judge.judge(refiner, plan, &of_attempt, pixels_to_judge, images)?;
        let spent = Spent::so_far(refiner.context).since(&spent_before);
        limits.learn(&spent);
        // Worth its time where more samples would follow.
        let tries_ratio = attempt == 0
            && estimate.upper_bound() > target
            && limits.room(&spent, packets_of_estimate) > LEAST_ROOM_FOR_RATIO
            && refiner.gathers_most_pixels()
            && refiner.fill_unoccluded(&resources)?;
        if tries_ratio {
            refiner.smooths_ratio = true;
            refiner.smooth_again(&resources, criteria)?;
            let of_ratio = judge.judge_again(refiner, &resources.images)?;
            if of_ratio.relative_error() < LEAST_USE_OF_RATIO * estimate.relative_error() {
                estimate = of_ratio;
            } else {
                refiner.smooths_ratio = false;
                refiner.smooth_again(&resources, criteria)?;
            }
        }
        let (error, upper) = (estimate.relative_error(), estimate.upper_bound());
        if is_noiseless {
            if error <= target || is_last {
                return Ok(ErrorEstimates {
                    interpolation_error: Some(error),
                    ..found
                });
            }
            aim = next_aim(aim, target, error, is_noiseless);
        } else {
            refiner.fill_stderr(estimate.light().error_factors())?;
            found.least = Some(limits.least());
            [found.error, found.error_upper] = estimate.relative_errors().map(Some);
            found.range_errors_m = estimate.range_errors_m();
            if upper <= target {
                found.stop = Some(StopReason::TargetMet);
                return Ok(found);
            }
            if is_cut_short || limits.reason() == StopReason::Cancelled {
                found.stop = Some(limits.reason());
                return Ok(found);
            }
            if is_last || budget.is_largest() {
                found.stop = Some(StopReason::SamplesExhausted);
                return Ok(found);
            }
            refiner.context.begin_step("allocate_samples");
            let noise = pilot.observed_noise(&estimate);
            for pilot in [Some(&mut pilot), alone.as_mut()].into_iter().flatten() {
                pilot.scale_noise(noise);
            }
            // What the last attempt left, over what it was to leave.
            let surprise = last.as_ref().map_or(1.0, |(before, shrink)| {
                error / (shrink * before.relative_error())
            });
            if surprise > MAX_SURPRISE {
                alone = None;
                refiner.gatherer.send_to_vpls(true);
            }
            let next = next_aim(aim, target, upper.min(4.0 * error), is_noiseless);
            let mut shrink = next / aim;
            if limits.are_set() {
                let spent = Spent::so_far(refiner.context).since(&spent_before);
                let room = limits.room(&spent, packets_of_estimate);
                if room < LEAST_GROWTH {
                    found.stop = Some(limits.reason());
                    return Ok(found);
                }
                // The samples taken so far still count.
                let most_packets = budget.mean_packets * (1.0 + room);
                let of_image = alone.as_ref().unwrap_or(&pilot);
                let (pilot, last) = (of_image.hardest(), of_image.hardest_of(&estimate));
                shrink = SampleBudget::shrink_within(shrink, most_packets, pilot, last);
            }
            aim *= shrink;
            let caution = match attempt >= CAUTIOUS_FROM {
                true => surprise.clamp(1.0, MAX_SURPRISE),
                false => 1.0,
            };
            last = Some((estimate, shrink / caution));
        }
        attempt += 1;
    }
}

/// How gathers are sampled that an image of this error is compared with, and their mean packets. If the limits leave few pixels, these take
/// fewer packets: pixels tell more of an image than packets do.
fn allocation_of_estimate(
    error: f64,
    pilot: &ErrorEstimate,
    limits: &Limits,
) -> (SampleAllocation, f64) {
    let mut error = error;
    loop {
        let allocation = SampleBudget::of_estimate(error, pilot);
        let packets = pilot.mean_packets_of(&allocation);
        let is_enough = packets <= 1.0 || limits.estimate_pixels(packets) >= FEW_PROBE_PIXELS;
        if is_enough || error > COARSEST_ESTIMATE {
            return (allocation, packets);
        }
        error *= COARSER_ESTIMATE;
    }
}

/// Gathers at probe pixels, and lets the gatherer learn from the result. Begins with few pixels, which are enough for a rough image.
fn pilot(
    refiner: &mut Refiner,
    images: &RefinementImages,
    plan: RefinementPlan,
    limits: &Limits,
) -> Result<(ProbePixels, ImageEstimate)> {
    let aim = FIRST_AIM * plan.target_error.unwrap_or_default();
    let for_both = [GatheredFor::Image, GatheredFor::Estimate];
    if refiner.gatherer.is_noiseless() {
        let mut probes = ProbePixels::new(refiner, plan.error_norm, PROBE_PIXELS, 0)?;
        let pilot = probes.pilot(refiner, images, 0, for_both)?;
        return Ok((probes, pilot));
    }
    let few = limits.pilot_pixels(pixels_for(plan, FEW_PROBE_PIXELS));
    // The device lists these along with the few, because the host waits for it.
    let pixels: u32 = refiner.context.plan.resolution_px.iter().product();
    let listed = |refiner: &Refiner| ScatteredPixels::list(refiner, PROBE_PIXELS, 0);
    let mut more = (pixels > FEW_PROBE_PIXELS)
        .then(|| listed(refiner))
        .transpose()?;
    let mut probes = ProbePixels::new(refiner, plan.error_norm, few, ROUGH_SEED)?;
    // One pilot finds a narrow feature; those that follow find its shape.
    let mut variances = [f64::INFINITY; 3];
    let mut round = 0;
    loop {
        round += 1;
        let is_in_the_dark = variances[0].is_infinite();
        let results = 2 * probes.count;
        let before = Spent::so_far(refiner.context);
        let is_last = match is_in_the_dark {
            true => round == MAX_PILOTS_IN_THE_DARK,
            false => round == MAX_PILOTS,
        };
        let packets = if is_last && is_in_the_dark {
            LAST_PACKETS_IN_THE_DARK
        } else {
            PILOT_PACKETS
        };
        // A pilot with more packets only measures the light: keeping what it saw would take much memory.
        if packets == PILOT_PACKETS {
            refiner.gatherer.begin_pilot(results)?;
        }
        let pilot = probes.pilot(refiner, images, packets, for_both)?;
        let moved = refiner.gatherer.learn(results)?;
        variances = [
            pilot.light().relative_variance(),
            variances[0],
            variances[1],
        ];
        let mean_packets = match pilot.is_dark() {
            true => f64::INFINITY,
            false => SampleBudget::for_rays(aim, pilot.hardest()).mean_packets,
        };
        // How many such pilots the limits leave room for.
        let room = limits.room_for_pilots(&Spent::so_far(refiner.context).since(&before));
        let needs_more = mean_packets > MAX_PACKETS_OF_ROUGH_IMAGE && room >= LEAST_ROOM_FOR_MORE;
        if let Some(more) = more.take_if(|_| needs_more) {
            let more = ProbePixels::scattered(refiner, plan.error_norm, more)?;
            probes = more.after(&probes);
            continue;
        }
        let image_packets = mean_packets * f64::from(pixels);
        let saved = (variances[2] / variances[0] - 1.0) * image_packets;
        let is_learning = variances[0] > SCATTERED && saved > LEAST_GAIN * f64::from(2 * results);
        let is_settled = !pilot.is_dark() && moved < MAX_MOVED_SHARE && !is_learning;
        if round >= 2 && is_settled || is_last || room < LEAST_ROOM_FOR_PILOTS {
            return Ok((probes, pilot));
        }
    }
}

/// Gathers at the probe pixels along directions alone. If they reach the same noise with less work, and miss no light, the image is gathered
/// with them from now on, and this is their pilot. Estimates keep both techniques, so they see what directions miss.
fn try_directions_alone(
    refiner: &mut Refiner,
    images: &RefinementImages,
    probes: &mut ProbePixels,
    aim: f64,
    both: &ImageEstimate,
    limits: &Limits,
) -> Result<Option<ImageEstimate>> {
    let plan = refiner.context.plan;
    let mean_packets =
        |pilot: &ImageEstimate| SampleBudget::for_rays(aim, pilot.hardest()).mean_packets;
    let pixels: u32 = plan.resolution_px.iter().product();
    let packets = mean_packets(both) * f64::from(pixels);
    let fitting = limits.rays_left(1.0) / rays_of_pixel(plan);
    if packets.min(fitting) < TRIAL_SHARE * f64::from(2 * probes.count) {
        return Ok(None);
    }
    refiner.gatherer.send_to_vpls(false);
    let for_image = [GatheredFor::Image; 2];
    let alone = probes.pilot(refiner, images, PILOT_PACKETS, for_image)?;
    let rays_along =
        f64::from(1 + u32::from(plan.is_specular)) * f64::from(1 + plan.gathered_lights());
    let work_of_both = mean_packets(both) * (rays_along + WORK_OF_VPL_RAY);
    let finds_all = alone.light().radiance >= LEAST_FOUND * both.light().radiance;
    let is_better = finds_all
        && !alone.is_dark()
        && mean_packets(&alone) * rays_along < MAX_WORK_OF_DIRECTIONS * work_of_both;
    refiner.gatherer.send_to_vpls(!is_better);
    Ok(is_better.then_some(alone))
}

fn gather_every_pixel(refiner: &mut Refiner) -> Result<()> {
    refiner.progress.begin_attempt(0, true);
    let mut resources = refiner.resources(1)?;
    // For the number of pixels.
    refiner.context.finish()?;
    let limits = Limits::none(refiner.context);
    let budget = SampleBudget::for_sums(1.0, true);
    let attempt = Attempt {
        samples: budget.samples(),
        criteria: budget.criteria(1.0, Default::default(), Default::default()),
        number: 0,
        limits: &limits,
        reserve: 0.0,
    };
    refiner.refine(&mut resources, &attempt).map(|_| ())
}
