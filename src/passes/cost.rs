//! The cost of a frame so far, and the amount of work per submission.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use crate::{
    Result,
    vulkan::{PassTimes, Recorder},
};

/// Names for rays that estimate the error, also counted in "final_gather": for the first sample of pixels and for further samples.
pub(crate) const FIRST_ESTIMATE: &str = "error_estimate";
pub(crate) const FURTHER_ESTIMATES: &str = "further error estimates";

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
    pub fn new(submission_target: Duration) -> Cost {
        Cost {
            submission_target,
            speeds: BTreeMap::new(),
            work: BTreeMap::new(),
            times: PassTimes::default(),
            submissions: 0,
            copying: Duration::ZERO,
        }
    }

    /// Submits recorded passes, waits for them and adds their times.
    pub(super) fn submit(&mut self, recorder: Recorder) -> Result<()> {
        self.times.extend(recorder.submit()?);
        self.submissions += 1;
        Ok(())
    }

    /// Submits work in the same way, and measures the speed of its kernel.
    pub(super) fn submit_work(&mut self, recorder: Recorder, work: Work) -> Result<()> {
        self.submit(recorder)?;
        let seconds = work.start.elapsed().as_secs_f64().max(1e-6);
        if work.amount > 0 {
            let speed = (work.amount + work.along) as f64 / seconds;
            self.speeds.insert(work.kernel, speed);
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
