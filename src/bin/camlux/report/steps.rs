//! Progress of a report on stderr: a spinner on a terminal, a line for each step elsewhere.

use std::io::IsTerminal;
use std::ops::ControlFlow;

use camlux::Error;
use indicatif::{ProgressBar, ProgressStyle};

use crate::Failure;
use crate::progress::is_interrupted;
use crate::tell;

/// Shows what the report is at until dropped.
pub struct Steps {
    /// `None` where stderr is no terminal.
    bar: Option<ProgressBar>,
}

impl Steps {
    pub fn new() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{spinner} {elapsed} {wide_msg}")
                .unwrap_or_else(|_| ProgressStyle::default_spinner());
            ProgressBar::new_spinner().with_style(style)
        });
        Steps { bar }
    }

    /// Says what comes next.
    ///
    /// # Errors
    /// [`Error::Cancelled`] after a signal.
    pub fn begin(&self, step: &str) -> Result<(), Failure> {
        match &self.bar {
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
        if let Some(bar) = &self.bar {
            bar.set_message(text());
        }
    }

    /// Keeps the display alive within a step; breaks after a signal.
    pub fn tick(&self) -> ControlFlow<()> {
        if let Some(bar) = &self.bar {
            bar.tick();
        }
        if is_interrupted() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
