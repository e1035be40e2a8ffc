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

/// Counts work in the unit of each pass: pairs of a pixel and a VPL, or rays.
pub(crate) struct Cost {
    /// Time that a submission of work should take, so that no watchdog fires and the caller can cancel.
    submission_target: Duration,
    /// Work per second in the last submission of each kernel. Kernels differ by a factor of up to ten.
    speeds: BTreeMap<&'static str, f64>,
    work: BTreeMap<&'static str, u64>,
    pub times: PassTimes,
    pub submissions: u32,
    /// Time in which surfaces were copied to the device.
    pub copying: Duration,
    /// When the call began, and how long pipelines had been made by then.
    started: Instant,
    made_before: Duration,
    /// How long by the last submission of work.
    made: Duration,
    /// Rays of final gathering, and the seconds that they took. Begins with a guess.
    traced: (f64, f64),
    /// That of the frame before; from the first attempt at the image on, of this one.
    pub pace: Option<Pace>,
    /// When the bounce was gathered, seconds from the call on.
    pub gathered_at: f64,
}

/// The work of a submission: its amount, and the pass and kernel that do it.
pub(crate) struct Work {
    pub pass: &'static str,
    pub kernel: &'static str,
    pub amount: u64,
    /// Work of other passes recorded before, which takes as long per unit.
    pub along: u64,
    /// When it began.
    pub start: Instant,
}

impl Cost {
    /// `pace` is that of the frame before.
    pub fn new(submission_target: Duration, pipelines: &Pipelines, pace: Option<Pace>) -> Cost {
        let rays_per_second = pace.map_or(USUAL_RAYS_PER_SECOND, |pace| pace.rays_per_second);
        Cost {
            submission_target,
            speeds: BTreeMap::new(),
            work: BTreeMap::new(),
            times: PassTimes::default(),
            submissions: 0,
            copying: Duration::ZERO,
            started: Instant::now(),
            made_before: pipelines.making_time(),
            made: pipelines.making_time(),
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

    /// How fast final gathering was so far, all its passes included.
    pub fn rays_per_second(&self) -> f64 {
        let (rays, seconds) = self.traced;
        rays / seconds
    }

    /// Submits recorded passes, waits for them and adds their times.
    pub(super) fn submit(&mut self, recorder: Recorder) -> Result<()> {
        self.times.extend(recorder.submit()?);
        self.submissions += 1;
        Ok(())
    }

    /// Submits work in the same way, and measures the speed of its kernel.
    pub(super) fn submit_work(
        &mut self,
        recorder: Recorder,
        work: Work,
        pipelines: &Pipelines,
    ) -> Result<()> {
        self.submit(recorder)?;
        let made = pipelines.making_time();
        let making = made - std::mem::replace(&mut self.made, made);
        let elapsed = work.start.elapsed().saturating_sub(making);
        let seconds = elapsed.as_secs_f64().max(1e-6);
        if work.amount > 0 {
            let speed = (work.amount + work.along) as f64 / seconds;
            self.speeds.insert(work.kernel, speed);
            if work.pass == "final_gather" {
                self.traced.0 += (work.amount + work.along) as f64;
                self.traced.1 += seconds;
            }
        }
        self.count_work(work.pass, work.amount);
        Ok(())
    }

    /// Adds to the work counted for a pass.
    pub fn count_work(&mut self, pass: &'static str, amount: u64) {
        *self.work.entry(pass).or_default() += amount;
    }

    /// Work that a submission of a kernel should hold; `first` until its speed is known.
    pub fn budget(&self, kernel: &str, first: f64) -> f64 {
        let speed = self.speeds.get(kernel);
        speed.map_or(first, |speed| speed * self.submission_target.as_secs_f64())
    }

    /// Work of a pass so far.
    pub fn work_of(&self, pass: &str) -> u64 {
        self.work.get(pass).copied().unwrap_or_default()
    }
}
