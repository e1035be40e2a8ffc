//! Progress and cancelling of a frame.

use std::{cell::Cell, ops::ControlFlow};

use crate::{Error, Result};

/// The progress of a render.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// 0 to 1, by estimated work.
    pub fraction: f32,
    /// The pass that runs next; "done" at the end, when the fraction is 1.
    pub pass: &'static str,
}

/// Turns the progress of passes into that of the frame.
pub(crate) struct ProgressReport<'a> {
    report: Option<&'a mut dyn FnMut(Progress) -> ControlFlow<()>>,
    /// Set instead of an error if the frame is to end with what it has.
    ends_early: Option<&'a Cell<bool>>,
    light: usize,
    light_count: usize,
    /// Share of the work that is done light by light.
    lights_share: f64,
    /// Share of all work that is for the pixels' samples.
    samples_share: f64,
    attempt: i32,
    is_last: bool,
    /// What was reported last.
    last: Progress,
}

/// Share of the work for all lights together, if indirect light is gathered.
const LIGHTS_SHARE_BEFORE_GATHER: f64 = 0.05;
/// Share of a frame's work for the pixels' samples, if pixels are averaged over samples.
const SAMPLES_SHARE: f64 = 0.3;
/// Share of attempts that need another one.
const FAILED_ATTEMPTS: f64 = 0.2;

impl<'a> ProgressReport<'a> {
    pub fn new(
        report: Option<&'a mut dyn FnMut(Progress) -> ControlFlow<()>>,
        ends_early: Option<&'a Cell<bool>>,
        light_count: usize,
        has_indirect: bool,
        has_samples: bool,
    ) -> Self {
        ProgressReport {
            report,
            ends_early,
            light: 0,
            light_count,
            lights_share: if has_indirect {
                LIGHTS_SHARE_BEFORE_GATHER
            } else {
                1.0
            },
            samples_share: if has_samples { SAMPLES_SHARE } else { 0.0 },
            attempt: 0,
            is_last: false,
            last: Progress {
                fraction: 0.0,
                pass: "direct",
            },
        }
    }

    pub fn begin_light(&mut self, light: usize, pass: &'static str) -> Result<()> {
        self.light = light;
        self.report(pass, 0.0)
    }

    /// `fraction` is the share of the current light's work that is done.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if the caller cancels.
    pub fn report(&mut self, pass: &'static str, fraction: f64) -> Result<()> {
        let of_lights = (self.light as f64 + fraction) / self.light_count.max(1) as f64;
        self.tell(pass, self.lights_share * of_lights)
    }

    /// Asks whether the caller wants to go on, when the progress of the work is unknown.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if the caller cancels.
    pub fn ask(&mut self) -> Result<()> {
        self.report_share(self.last.pass, self.last.fraction.into())
    }

    /// From here on indirect light is gathered, for the `attempt`-th time, counted from 0. No attempt follows the last one.
    pub fn begin_attempt(&mut self, attempt: u32, is_last: bool) {
        self.attempt = attempt as i32;
        self.is_last = is_last;
    }

    /// `fraction` is the share of the attempt that is done.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if the caller cancels.
    pub fn report_attempt(&mut self, pass: &'static str, fraction: f64) -> Result<()> {
        let left = FAILED_ATTEMPTS.powi(self.attempt);
        let of_left = if self.is_last {
            1.0
        } else {
            1.0 - FAILED_ATTEMPTS
        };
        let of_attempts = 1.0 - left + left * of_left * fraction;
        self.tell(
            pass,
            self.lights_share + (1.0 - self.lights_share) * of_attempts,
        )
    }

    /// `fraction` is the share of the pixels' samples that is done.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if the caller cancels.
    pub fn report_sample(&mut self, pass: &'static str, fraction: f64) -> Result<()> {
        let before = 1.0 - self.samples_share;
        self.report_share(pass, before + self.samples_share * fraction)
    }

    /// The frame is drawn.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if the caller cancels.
    pub fn end(&mut self) -> Result<()> {
        self.report_share("done", 1.0)
    }

    /// `fraction` is the share that is done of the work before the pixels' samples.
    fn tell(&mut self, pass: &'static str, fraction: f64) -> Result<()> {
        self.report_share(pass, (1.0 - self.samples_share) * fraction)
    }

    fn report_share(&mut self, pass: &'static str, fraction: f64) -> Result<()> {
        let Some(report) = &mut self.report else {
            return Ok(());
        };
        let progress = Progress {
            fraction: fraction as f32,
            pass,
        };
        self.last = progress;
        if self.ends_early.is_some_and(Cell::get) || report(progress).is_continue() {
            return Ok(());
        }
        let ends_early = self.ends_early.ok_or(Error::Cancelled)?;
        ends_early.set(true);
        Ok(())
    }
}
