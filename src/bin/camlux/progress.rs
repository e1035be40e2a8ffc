//! Progress on stderr: a bar on a terminal, a line per pass elsewhere. And the end of it by Ctrl-C.

use std::cell::Cell;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use camlux::Progress;
use indicatif::{ProgressBar, ProgressStyle};

use crate::tell;

const STEPS: u64 = 1000;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From here on Ctrl-C and SIGTERM end the render between two submissions, so that the files under construction are
/// removed; the second one ends the program at once.
pub fn stop_on_signals() {
    // Without a handler a signal ends the program at once, as ever.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

/// Whether a signal has asked to stop.
pub fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// A long computation with an estimate of its end: a bar on a terminal, a line every ten percent elsewhere. Gone when
/// dropped.
pub struct Estimate {
    what: &'static str,
    bar: Option<ProgressBar>,
    told_tenths: Cell<u64>,
}

impl Estimate {
    pub fn new(what: &'static str) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template(
                "{msg:10} {wide_bar} {percent:>3} % {elapsed}, {eta} to go",
            )
            .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(STEPS).with_style(style).with_message(what)
        });
        Estimate {
            what,
            bar,
            told_tenths: Cell::new(0),
        }
    }

    /// `share`: 0 to 1.
    pub fn show(&self, share: f64) {
        if let Some(bar) = &self.bar {
            bar.set_position((share * STEPS as f64) as u64);
        } else if (share * 10.0) as u64 > self.told_tenths.get() {
            self.told_tenths.set((share * 10.0) as u64);
            tell(&format!("{:3.0} % {}", 100.0 * share, self.what));
        }
    }
}

impl Drop for Estimate {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Shows the progress of a render until dropped.
pub struct ProgressDisplay {
    /// `None` where stderr is no terminal.
    bar: Option<ProgressBar>,
    pass: &'static str,
}

impl ProgressDisplay {
    pub fn new() -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style =
                ProgressStyle::with_template("{msg:10} {wide_bar} {percent:>3} % {elapsed}")
                    .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(STEPS).with_style(style)
        });
        ProgressDisplay { bar, pass: "" }
    }

    pub fn show(&mut self, progress: Progress) -> ControlFlow<()> {
        let is_new_pass = self.pass != progress.pass;
        self.pass = progress.pass;
        match &self.bar {
            Some(bar) => {
                if is_new_pass {
                    bar.set_message(progress.pass);
                }
                bar.set_position((progress.fraction * STEPS as f32) as u64);
            }
            None if is_new_pass => {
                let percent = progress.fraction * 100.0;
                tell(&format!("{percent:3.0} % {}", progress.pass));
            }
            None => {}
        }
        if is_interrupted() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }
}

impl Drop for ProgressDisplay {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
