//! Progress of a report on stderr: a spinner on a terminal, a line for each step elsewhere.

use std::ops::ControlFlow;

use camlux::Error;

use crate::progress::{Bar, go_on};
use crate::{Failure, tell};

/// Shows what the report is at until dropped.
pub struct Steps {
    bar: Bar,
}

impl Steps {
    pub fn new() -> Self {
        let bar = Bar::new(0, "{spinner} {elapsed} {wide_msg}");
        Steps { bar }
    }

    /// Says what comes next.
    ///
    /// # Errors
    /// [`Error::Cancelled`] after a signal.
    pub fn begin(&self, step: &str) -> Result<(), Failure> {
        match self.bar.get() {
            Some(bar) => bar.set_message(step.to_owned()),
            None => tell(step),
        }
        match self.tick() {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Cancelled.into()),
        }
    }

    /// Tells how far a step is; only where there is a terminal.
    pub fn detail(&self, text: impl FnOnce() -> String) {
        if let Some(bar) = self.bar.get() {
            bar.set_message(text());
        }
    }

    /// Keeps the display alive within a step; breaks after a signal.
    pub fn tick(&self) -> ControlFlow<()> {
        if let Some(bar) = self.bar.get() {
            bar.tick();
        }
        go_on()
    }
}
