//! Progress of a frame, and its cancelling.

use std::ops::ControlFlow;

use crate::{Error, Result};

/// How far a render is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// 0 to 1, by estimated work.
    pub fraction: f32,
    /// The pass that runs next.
    pub pass: &'static str,
}

/// Turns the progress of passes into that of the frame.
pub(crate) struct ProgressReport<'a> {
    report: Option<&'a mut dyn FnMut(Progress) -> ControlFlow<()>>,
    light: usize,
    light_count: usize,
}

impl<'a> ProgressReport<'a> {
    pub fn new(
        report: Option<&'a mut dyn FnMut(Progress) -> ControlFlow<()>>,
        light_count: usize,
    ) -> Self {
        ProgressReport {
            report,
            light: 0,
            light_count,
        }
    }

    pub fn begin_light(&mut self, light: usize, pass: &'static str) -> Result<()> {
        self.light = light;
        self.report(pass, 0.0)
    }

    /// `fraction` is the share of the current light's work that is done.
    ///
    /// # Errors
    /// [`Error::Cancelled`] where the caller wants no more.
    pub fn report(&mut self, pass: &'static str, fraction: f64) -> Result<()> {
        let Some(report) = &mut self.report else {
            return Ok(());
        };
        let fraction = (self.light as f64 + fraction) / self.light_count.max(1) as f64;
        let progress = Progress {
            fraction: fraction as f32,
            pass,
        };
        match report(progress) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Cancelled),
        }
    }
}
