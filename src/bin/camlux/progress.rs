//! Progress on stderr: a bar on a terminal, a line per pass elsewhere. And the end of it by Ctrl-C.

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
        if INTERRUPTED.load(Ordering::Relaxed) {
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
