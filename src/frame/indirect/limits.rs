//! The limits of a frame, counted in rays: what is left, and how many pixels that is worth.

use crate::{
    output::StopReason,
    passes::{
        Context,
        cost::Pace,
        gatherer::{GatheredFor, LightRaySets, MOST_SETS},
        sample_counts::PACKET_SAMPLES,
    },
    plan::{PacketRays, Plan, RefinementPlan},
};

/// Time of an attempt beside its rays, and of the passes after the gather, over the time before the gather. Until they are measured: all are
/// passes over the pixels.
const USUAL_ATTEMPT: f64 = 2.0;
const USUAL_END: f64 = 0.25;
/// Shares of the rays that are left: for a pilot, for an estimate, and of the rest for the coarsest pixels of an image.
const PILOT_SHARE: f64 = 0.06;
const ESTIMATE_SHARE: f64 = 0.2;
const GRID_SHARE: f64 = 0.9;
/// Share of an attempt's passes that belong to its estimate.
const SHARE_OF_JUDGING: f64 = 0.3;
/// Probe pixels: how many there are, and how many are enough for a rough image.
pub(super) const PROBE_PIXELS: u32 = 1024;
pub(super) const FEW_PROBE_PIXELS: u32 = 256;
/// Groups of probe pixels that have no samples in common.
pub(super) const GROUPS: u32 = MOST_SETS;
/// Fewest pixels of a pilot, and of an estimate: a few for each group of pixels that share no samples.
const MIN_PILOT_PIXELS: u32 = 16;
const MIN_ESTIMATE_PIXELS: u32 = 32;
/// Up to this target error, pilots and estimates have all their pixels; for larger ones in inverse proportion, down to a share.
const ALL_FROM_TARGET: f64 = 0.05;
const LEAST_PIXELS_SHARE: f64 = 0.25;
/// Largest stride of the pixels that are gathered first.
const MAX_STRIDE: u32 = 64;

/// The rays from the lights of an estimate, but for its pixels.
const SETS_OF_ESTIMATE: LightRaySets = LightRaySets {
    seed: 0,
    gathered_for: GatheredFor::Estimate,
    samples: PACKET_SAMPLES,
    receivers: 0,
    set_count: GROUPS,
};

/// What an image may take.
pub(super) struct Limits<'c> {
    context: &'c Context<'c>,
    /// Rays of the frame, and seconds from the call on. Infinite without a limit.
    rays: f64,
    seconds: f64,
    /// Time of an attempt beside its rays, and of the passes after the gather.
    attempt_seconds: f64,
    end_seconds: f64,
    /// Time before the gather.
    before_seconds: f64,
    pixels: u32,
}

/// Rays and time of the frame so far, with the rays that are recorded.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spent {
    pub rays: f64,
    pub seconds: f64,
    /// Of them those of the rays.
    ray_seconds: f64,
}

impl Spent {
    pub fn so_far(context: &Context) -> Spent {
        let cost = context.cost.borrow();
        Spent {
            rays: cost.ray_count() as f64,
            seconds: cost.seconds(context.pipelines) + cost.pending_seconds(),
            ray_seconds: cost.ray_seconds() + cost.pending_seconds(),
        }
    }

    pub fn since(&self, earlier: &Spent) -> Spent {
        Spent {
            rays: self.rays - earlier.rays,
            seconds: self.seconds - earlier.seconds,
            ray_seconds: self.ray_seconds - earlier.ray_seconds,
        }
    }
}

impl<'c> Limits<'c> {
    pub fn none(context: &'c Context<'c>) -> Limits<'c> {
        Limits {
            context,
            rays: f64::INFINITY,
            seconds: f64::INFINITY,
            attempt_seconds: 0.0,
            end_seconds: 0.0,
            before_seconds: 0.0,
            pixels: 0,
        }
    }

    pub fn new(context: &'c Context<'c>, plan: RefinementPlan) -> Limits<'c> {
        let before = Spent::so_far(context).seconds;
        let pixels = context.plan.resolution_px.iter().product();
        let pace = context.cost.borrow().pace;
        let alike = pace.filter(|pace| pace.pixels == pixels);
        let (attempt_seconds, end_seconds) = match alike {
            Some(pace) => (pace.attempt_seconds, pace.end_seconds),
            None => (USUAL_ATTEMPT * before, USUAL_END * before),
        };
        Limits {
            rays: plan.max_rays.map_or(f64::INFINITY, |rays| rays as f64),
            seconds: plan.max_ms.map_or(f64::INFINITY, |ms| ms * 1e-3),
            attempt_seconds,
            end_seconds,
            before_seconds: before,
            pixels,
            ..Limits::none(context)
        }
    }

    pub fn are_set(&self) -> bool {
        self.rays.is_finite() || self.seconds.is_finite()
    }

    /// Why there are no rays left.
    pub fn reason(&self) -> StopReason {
        match self.context.ends_early.get() {
            true => StopReason::Cancelled,
            false => StopReason::BudgetSpent,
        }
    }

    /// Rays that fit, if this share of an attempt's other passes is still to come.
    pub fn rays_left(&self, share_to_come: f64) -> f64 {
        if self.context.ends_early.get() {
            return 0.0;
        }
        let spent = Spent::so_far(self.context);
        let other = share_to_come * self.attempt_seconds + self.end_seconds;
        let seconds = self.seconds - spent.seconds - other;
        let in_time = seconds * self.context.cost.borrow().rays_per_second();
        (self.rays - spent.rays).min(in_time).max(0.0)
    }

    /// Learns from an attempt how long its passes take beside the rays.
    pub fn learn(&mut self, attempt: &Spent) {
        let mut cost = self.context.cost.borrow_mut();
        let rays_per_second = cost.rays_per_second();
        self.attempt_seconds = (attempt.seconds - attempt.ray_seconds).max(0.0);
        cost.pace = Some(Pace {
            rays_per_second,
            attempt_seconds: self.attempt_seconds,
            end_seconds: self.end_seconds,
            pixels: self.pixels,
        });
    }

    /// How many pilots like that the limits leave room for.
    pub fn room_for_pilots(&self, pilot: &Spent) -> f64 {
        self.rays_left(1.0) / pilot.rays.max(1.0)
    }

    /// How many attempts like that they leave room for, which are judged by `packets` for each of few pixels.
    pub fn room(&self, attempt: &Spent, packets: f64) -> f64 {
        let judging = self.rays_of_estimate(MIN_ESTIMATE_PIXELS, packets);
        (self.rays_left(1.0) - judging) / attempt.rays.max(1.0)
    }

    /// Pixels of the first pilot.
    pub fn pilot_pixels(&self, at_most: u32) -> u32 {
        let rays = PILOT_SHARE * self.rays_left(1.0);
        self.pixels_with(rays, 1.0)
            .clamp(MIN_PILOT_PIXELS.min(at_most), at_most)
    }

    /// Pixels of an estimate that takes this many packets per pixel, of what is left before its attempt.
    pub fn estimate_pixels(&self, packets: f64) -> u32 {
        let rays = ESTIMATE_SHARE * self.rays_left(1.0);
        self.pixels_with(rays, packets).max(MIN_ESTIMATE_PIXELS)
    }

    /// Pixels of an estimate after its attempt, for which this many were planned: all that fit if there is no room for another attempt.
    pub fn pixels_to_judge(&self, planned: u32, packets: f64) -> u32 {
        let left = self.rays_left(SHARE_OF_JUDGING);
        let fits = |pixels: &u32| self.rays_of_estimate(*pixels, packets) <= left;
        let most = 2 * planned.min(PROBE_PIXELS);
        if fits(&most) {
            return planned;
        }
        let pixels = (MIN_ESTIMATE_PIXELS..most).rev().find(fits);
        pixels.unwrap_or(MIN_ESTIMATE_PIXELS)
    }

    /// Rays to keep for an estimate, and for the rays from the lights of an image with so many samples a pixel.
    pub fn reserve(&self, pixels: u32, packets: f64, samples: u32) -> f64 {
        self.rays_of_estimate(pixels, packets) + light_rays_of_image(self.context.plan, samples)
    }

    /// Rays of the two gathers of an estimate.
    fn rays_of_estimate(&self, pixels: u32, packets: f64) -> f64 {
        let sets = LightRaySets {
            receivers: pixels,
            ..SETS_OF_ESTIMATE
        };
        let each = 2.0 * packets.max(1.0) * rays_of_pixel(self.context.plan);
        let from_lights = light_rays(self.context.plan, 2 * GROUPS * sets.set_size(false));
        f64::from(pixels) * each + from_lights
    }

    /// Rays and milliseconds of the least frame with an estimate: few pixels for the pilot, for the image and for the estimate.
    pub fn least(&self) -> (u64, f64) {
        let plan = self.context.plan;
        let [columns, rows] = plan.resolution_px.map(|px| px.div_ceil(MAX_STRIDE));
        let of_pilot = LightRaySets {
            receivers: MIN_PILOT_PIXELS,
            set_count: 1,
            ..SETS_OF_ESTIMATE
        };
        let gathered = f64::from(2 * MIN_PILOT_PIXELS + columns * rows) * rays_of_pixel(plan);
        let from_lights = light_rays(plan, 2 * of_pilot.set_size(true));
        let rays = gathered + from_lights + self.reserve(MIN_ESTIMATE_PIXELS, 1.0, PACKET_SAMPLES);
        let of_rays = rays / self.context.cost.borrow().rays_per_second();
        let seconds = self.before_seconds + self.attempt_seconds + self.end_seconds + of_rays;
        (rays as u64, 1e3 * seconds)
    }

    /// Stride of the pixels that an image begins with, so that their gathers fit beside the reserve.
    pub fn stride(&self, reserve: f64, finest: u32) -> u32 {
        let [width, height] = self.context.plan.resolution_px;
        let rays = GRID_SHARE * (self.rays_left(1.0) - reserve);
        let fits = |stride: &u32| {
            // The first refinements halve it.
            let points = width.div_ceil(stride / 2) * height.div_ceil(stride / 2);
            f64::from(points) * rays_of_pixel(self.context.plan) <= rays
        };
        let mut strides = (0..).map(|power| finest << power);
        let fitting = strides.find(|stride| 2 * stride > MAX_STRIDE || fits(stride));
        fitting.unwrap_or(finest)
    }

    /// Pixels that two gathers of this many packets per pixel take so many rays for.
    fn pixels_with(&self, rays: f64, packets: f64) -> u32 {
        (rays / (2.0 * packets.max(1.0) * rays_of_pixel(self.context.plan))) as u32
    }
}

/// Rays from the lights that an image's pixels with so many samples share.
pub(super) fn light_rays_of_image(plan: &Plan, samples: u32) -> f64 {
    let sets = LightRaySets {
        samples,
        receivers: u32::MAX,
        set_count: 1,
        ..SETS_OF_ESTIMATE
    };
    light_rays(plan, sets.set_size(false))
}

/// So many rays from the lights, and those of further bounces, which are as many at most.
fn light_rays(plan: &Plan, of_first_bounce: u32) -> f64 {
    let times = if plan.bounces() == 1 { 1.0 } else { 2.0 };
    times * f64::from(of_first_bounce)
}

/// Most rays of a packet of samples.
pub(super) fn rays_of_pixel(plan: &Plan) -> f64 {
    let lobes = 1 + u32::from(plan.is_specular);
    PacketRays::new(plan, lobes).of_packet().into()
}

/// A part of so many pixels that is enough for the target.
pub(super) fn pixels_for(plan: RefinementPlan, pixels: u32) -> u32 {
    let target = plan.target_error.unwrap_or_default();
    let share = (ALL_FROM_TARGET / target).clamp(LEAST_PIXELS_SHARE, 1.0);
    (share * f64::from(pixels)) as u32
}
