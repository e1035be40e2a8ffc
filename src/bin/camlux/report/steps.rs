//! Progress of a report on stderr: a spinner on a terminal, a line for each step elsewhere.

use std::ops::ControlFlow;

use camlux::{Error, RenderOptions};
use indicatif::ProgressBar;

use crate::progress::{bar, go_on};
use crate::{Failure, tell};

/// Shows the current step of the report until dropped.
pub struct Steps(ProgressBar);

impl Steps {
    pub fn new() -> Self {
        Steps(bar(0, "{spinner} {elapsed} {wide_msg}"))
    }

    /// Announces the next step.
    ///
    /// # Errors
    /// [`Error::Cancelled`] after a signal.
    pub fn begin(&self, step: String) -> Result<(), Failure> {
        if self.0.is_hidden() {
            tell(&step);
        }
        self.detail(step);
        match self.tick() {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Cancelled.into()),
        }
    }

    /// Shows the progress of a step; only on a terminal.
    pub fn detail(&self, text: String) {
        self.0.set_message(text);
    }

    /// Keeps the display updated within a step; breaks after a signal.
    pub fn tick(&self) -> ControlFlow<()> {
        self.0.tick();
        go_on()
    }

    /// Renders with options that update the display.
    pub fn watch<T>(&self, render: impl FnOnce(&mut RenderOptions) -> T) -> T {
        let mut show = |_| self.tick();
        render(&mut RenderOptions {
            progress: Some(&mut show),
            ..RenderOptions::default()
        })
    }
}
