//! The cost of a frame so far, and the amount of work per submission.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use crate::{
    Result,
    vulkan::{PassTimes, Pipelines, Recorder},
};

/// Names for rays that estimate the error, also counted in "final_gather": for the first sample of pixels and for further samples.
pub(crate) const FIRST_ESTIMATE: &str = "error_estimate";
pub(crate) const FURTHER_ESTIMATES: &str = "further error estimates";

/// Rays per second of a renderer's first frame until they are measured, and the seconds that this guess counts as. A guess below the speed of
/// any device leaves some time unused; one above it exceeds a limit.
const USUAL_RAYS_PER_SECOND: f64 = 2e6;
const SECONDS_OF_GUESS: f64 = 2e-3;

/// How fast a renderer was. Later frames go by it if they have a limit of time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pace {
    /// Rays of final gathering, all its passes included.
    pub rays_per_second: f64,
    /// Time of an attempt at the image beside its rays, and of the passes after the gather and of reading the frame; for an image of so many
    /// pixels.
    pub attempt_seconds: f64,
    pub end_seconds: f64,
    pub pixels: u32,
}

/// Work that submissions are measured by.
#[derive(Clone, Copy)]
pub(crate) struct WorkKind {
    /// The pass that it is counted for, and its kernel. Kernels differ in speed by a factor of up to ten.
    pub pass: &'static str,
    pub kernel: &'static str,
    /// The beginnings of the names of the passes that do it.
    pub done_by: &'static [&'static str],
    /// Work of the first submission, before the device's speed is known.
    pub first: f64,
}

impl WorkKind {
    pub fn is_done_by(&self, pass: &str) -> bool {
        self.done_by.iter().any(|name| pass.starts_with(name))
    }
}

/// A submission with less room than this share is full.
const LEAST_ROOM: f64 = 0.25;

/// Work that is recorded and not yet submitted.
struct Pending {
    kind: WorkKind,
    amount: u64,
    /// Pass times from here on are those of this work.
    first_time: usize,
    /// When recording began, and how long pipelines had been made by then.
    started: Instant,
    made_before: Duration,
}

/// Counts work in the unit of each pass: pairs of a pixel and a VPL, or rays.
pub(crate) struct Cost {
    /// Time that a submission of work should take, so that no watchdog fires and the caller can cancel.
    submission_target: Duration,
    /// Work per second in the last submission of each kernel.
    speeds: BTreeMap<&'static str, f64>,
    work: BTreeMap<&'static str, u64>,
    pending: Option<Pending>,
    times: PassTimes,
    pub submissions: u32,
    /// Time of the host by step, without waiting for the device and without making pipelines; and what the step before ended with.
    host: PassTimes,
    step: (&'static str, Duration),
    /// Time in which the host waited for passes, or ran them.
    waiting: Duration,
    /// Time in which surfaces were copied to the device.
    pub copying: Duration,
    /// When the call began, and how long pipelines had been made by then.
    started: Instant,
    made_before: Duration,
    /// Rays of final gathering, and the seconds that they took. Begins with a guess.
    traced: (f64, f64),
    /// That of the frame before; from the first attempt at the image on, of this one.
    pub pace: Option<Pace>,
    /// When the bounce was gathered, seconds from the call on.
    pub gathered_at: f64,
}

impl Cost {
    /// `pace` is that of the frame before.
    pub fn new(submission_target: Duration, pipelines: &Pipelines, pace: Option<Pace>) -> Cost {
        let rays_per_second = pace.map_or(USUAL_RAYS_PER_SECOND, |pace| pace.rays_per_second);
        Cost {
            submission_target,
            speeds: BTreeMap::new(),
            work: BTreeMap::new(),
            pending: None,
            times: PassTimes::default(),
            submissions: 0,
            host: PassTimes::default(),
            step: ("scene", Duration::ZERO),
            waiting: Duration::ZERO,
            copying: Duration::ZERO,
            started: Instant::now(),
            made_before: pipelines.making_time(),
            traced: (rays_per_second * SECONDS_OF_GUESS, SECONDS_OF_GUESS),
            pace,
            gathered_at: 0.0,
        }
    }

    /// Time in which pipelines were made.
    pub fn making(&self, pipelines: &Pipelines) -> Duration {
        pipelines.making_time() - self.made_before
    }

    /// Wall time from the call on.
    pub fn wall(&self) -> Duration {
        self.started.elapsed()
    }

    /// Wall time from the call on, seconds, without making pipelines.
    pub fn seconds(&self, pipelines: &Pipelines) -> f64 {
        let making = self.making(pipelines);
        self.wall().saturating_sub(making).as_secs_f64()
    }

    /// Rays of the bounce.
    pub fn ray_count(&self) -> u64 {
        self.work_of("final_gather") + self.work_of("light_rays")
    }

    /// Seconds of final gathering so far, and those of the first guess.
    pub fn ray_seconds(&self) -> f64 {
        self.traced.1
    }

    /// How fast final gathering was so far, all its passes included.
    pub fn rays_per_second(&self) -> f64 {
        let (rays, seconds) = self.traced;
        rays / seconds
    }

    /// Begins a step of the host's work.
    pub fn begin_step(&mut self, name: &'static str, pipelines: &Pipelines) {
        let making = self.making(pipelines);
        let now = self.wall().saturating_sub(making + self.waiting);
        let (last, began) = std::mem::replace(&mut self.step, (name, now));
        let milliseconds = 1e3 * now.saturating_sub(began).as_secs_f64();
        self.host.push((last, milliseconds));
    }

    /// Time of the host in the steps that have ended.
    pub fn host(&self) -> &PassTimes {
        &self.host
    }

    /// Times of the passes, one after the other.
    pub fn times(&self) -> &PassTimes {
        &self.times
    }

    /// Adds a pass that the host has run.
    pub fn add_host_pass(&mut self, pass: &'static str, time: Duration) {
        self.waiting += time;
        self.times.push((pass, 1e3 * time.as_secs_f64()));
    }

    /// Submits recorded passes, waits for them and adds their times. Measures the speed of the work among them.
    pub(super) fn submit(&mut self, recorder: Recorder, pipelines: &Pipelines) -> Result<()> {
        let start = Instant::now();
        self.times.extend(recorder.submit()?);
        self.waiting += start.elapsed();
        self.submissions += 1;
        let Some(done) = self.pending.take_if(|pending| pending.amount > 0) else {
            return Ok(());
        };
        let (kind, amount) = (done.kind, done.amount as f64);
        // Where the host traces rays, a submission ends in the middle of the next work.
        self.begin_work(kind, pipelines);
        let (mut own, mut others) = (0.0, 0.0);
        for (pass, milliseconds) in &self.times[done.first_time..] {
            match kind.is_done_by(pass) {
                true => own += 1e-3 * milliseconds,
                false => others += 1e-3 * milliseconds,
            }
        }
        self.speeds
            .insert(kind.kernel, amount / f64::max(own, 1e-6));
        if kind.pass == "final_gather" {
            // With what the host does for the rays.
            let making = pipelines.making_time() - done.made_before;
            let wall = done.started.elapsed().saturating_sub(making).as_secs_f64();
            self.traced.0 += amount;
            self.traced.1 += (wall - others).max(own);
        }
        Ok(())
    }

    /// Whether work of another kernel is recorded.
    pub(super) fn has_other_work(&self, kind: WorkKind) -> bool {
        let pending = self.pending.as_ref();
        pending.is_some_and(|pending| pending.amount > 0 && pending.kind.kernel != kind.kernel)
    }

    /// From here on, passes and the host's time are those of this work.
    pub(super) fn begin_work(&mut self, kind: WorkKind, pipelines: &Pipelines) {
        if self
            .pending
            .as_ref()
            .is_none_or(|pending| pending.amount == 0)
        {
            self.pending = Some(Pending {
                kind,
                amount: 0,
                first_time: self.times.len(),
                started: Instant::now(),
                made_before: pipelines.making_time(),
            });
        }
    }

    /// Work of this kind that the next submission has room for.
    pub(super) fn room_for(&self, kind: WorkKind) -> f64 {
        let pending = self.pending.as_ref();
        self.budget(kind) - pending.map_or(0.0, |pending| pending.amount as f64)
    }

    /// Counts work that was recorded, and `along`: work of other passes, which takes as long per unit. Returns whether the submission is full.
    pub(super) fn add_work(&mut self, kind: WorkKind, amount: u64, along: u64) -> bool {
        self.count_work(kind.pass, amount);
        let budget = self.budget(kind);
        self.pending.as_mut().is_some_and(|pending| {
            pending.amount += amount + along;
            budget - pending.amount as f64 <= LEAST_ROOM * budget
        })
    }

    /// Seconds that recorded rays are expected to take.
    pub fn pending_seconds(&self) -> f64 {
        let rays = self.pending.iter();
        let rays = rays.filter(|pending| pending.kind.pass == "final_gather");
        rays.map(|pending| pending.amount as f64).sum::<f64>() / self.rays_per_second()
    }

    /// Work that a submission should hold.
    fn budget(&self, kind: WorkKind) -> f64 {
        let speed = self.speeds.get(kind.kernel);
        speed.map_or(kind.first, |speed| {
            speed * self.submission_target.as_secs_f64()
        })
    }

    /// Adds to the work counted for a pass.
    pub fn count_work(&mut self, pass: &'static str, amount: u64) {
        *self.work.entry(pass).or_default() += amount;
    }

    /// Work of a pass so far.
    pub fn work_of(&self, pass: &str) -> u64 {
        self.work.get(pass).copied().unwrap_or_default()
    }
}
