//! What a frame cost so far, and how much work its submissions hold.

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use crate::{
    Result,
    vulkan::{PassTimes, Recorder},
};

/// Rays that estimate the error, beside those of "final_gather", at the first sample of pixels and at further ones.
pub(crate) const FIRST_ESTIMATE: &str = "error_estimate";
pub(crate) const FURTHER_ESTIMATES: &str = "further error estimates";

/// Work is counted in the unit of its pass: pairs of a pixel and a VPL, or rays.
pub(crate) struct Cost {
    /// Time that a submission of work should take, so that no watchdog fires and the caller can cancel.
    submission_target: Duration,
    /// Work per second of each kernel's last submission: they differ by up to ten.
    speeds: BTreeMap<&'static str, f64>,
    work: BTreeMap<&'static str, u64>,
    pub times: PassTimes,
    pub submissions: u32,
}

/// Work of a submission: how much, and by which kernel of which pass.
pub(crate) struct Work {
    pub pass: &'static str,
    pub kernel: &'static str,
    pub amount: u64,
    /// Of other passes that were recorded before, which takes as long.
    pub along: u64,
}

impl Cost {
    pub fn new(submission_target: Duration) -> Cost {
        Cost {
            submission_target,
            speeds: BTreeMap::new(),
            work: BTreeMap::new(),
            times: PassTimes::default(),
            submissions: 0,
        }
    }

    /// Submits recorded passes, waits for them and counts them in.
    pub(super) fn submit(&mut self, recorder: Recorder) -> Result<()> {
        self.times.extend(recorder.submit()?);
        self.submissions += 1;
        Ok(())
    }

    /// The same for work, which also tells the speed of its kernel.
    pub(super) fn submit_work(&mut self, recorder: Recorder, work: Work) -> Result<()> {
        let start = Instant::now();
        self.submit(recorder)?;
        let seconds = start.elapsed().as_secs_f64().max(1e-6);
        self.speeds
            .insert(work.kernel, (work.amount + work.along) as f64 / seconds);
        self.count_work(work.pass, work.amount);
        Ok(())
    }

    /// Counts in what a pass is for, besides those that do it.
    pub fn count_work(&mut self, pass: &'static str, amount: u64) {
        *self.work.entry(pass).or_default() += amount;
    }

    /// Work that a submission of a kernel should hold; `first` before its speed is known.
    pub fn budget(&self, kernel: &str, first: f64) -> f64 {
        let speed = self.speeds.get(kernel);
        speed.map_or(first, |speed| speed * self.submission_target.as_secs_f64())
    }

    /// Work of a pass so far.
    pub fn work_of(&self, pass: &str) -> u64 {
        self.work.get(pass).copied().unwrap_or_default()
    }
}
