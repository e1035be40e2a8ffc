//! Progress on stderr: a bar on a terminal, a line every ten seconds elsewhere. Also handles Ctrl-C.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use camlux::Progress;
use indicatif::{ProgressBar, ProgressStyle};

use crate::tell;

const STEPS: u64 = 1000;
/// So that the log of many short renders stays short.
const LINE_INTERVAL: Duration = Duration::from_secs(10);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From here on, Ctrl-C and SIGTERM end the render between two submissions, so that unfinished files are removed. A second signal ends the
/// program at once.
pub fn stop_on_signals() {
    // Without a handler, a signal ends the program at once: the system's default.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

/// Whether a signal has asked the program to stop.
pub fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Breaks if a signal has arrived.
pub fn go_on() -> ControlFlow<()> {
    if is_interrupted() {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

/// A bar on a terminal, hidden elsewhere. It disappears when dropped. `template` uses the syntax of `indicatif`.
pub fn bar(steps: u64, template: &str) -> ProgressBar {
    let style = ProgressStyle::with_template(template);
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(steps).with_style(style)
}

/// Progress of a long computation with an estimated end: a bar on a terminal, a line for every ten per cent elsewhere.
pub struct Estimate {
    what: &'static str,
    bar: ProgressBar,
    reported_tenths: u64,
}

impl Estimate {
    pub fn new(what: &'static str) -> Self {
        let template =
            format!("{what:10} {{wide_bar}} {{percent:>3}} % {{elapsed}}, {{eta}} to go");
        Estimate {
            what,
            bar: bar(STEPS, &template),
            reported_tenths: 0,
        }
    }

    /// `share`: 0 to 1.
    pub fn show(&mut self, share: f64) {
        self.bar.set_position((share * STEPS as f64) as u64);
        let tenths = (share * 10.0) as u64;
        if self.bar.is_hidden() && tenths > self.reported_tenths {
            self.reported_tenths = tenths;
            tell(&format!("{:3.0} % {}", 100.0 * share, self.what));
        }
    }
}

/// Shows the progress of a render until dropped: a bar on a terminal, a line every [`LINE_INTERVAL`] elsewhere.
pub struct ProgressDisplay {
    bar: ProgressBar,
    last_line: Instant,
}

impl ProgressDisplay {
    pub fn new() -> Self {
        ProgressDisplay {
            bar: bar(STEPS, "{msg:10} {wide_bar} {percent:>3} % {elapsed}"),
            last_line: Instant::now(),
        }
    }

    pub fn show(&mut self, Progress { pass, fraction }: Progress) -> ControlFlow<()> {
        self.bar.set_message(pass);
        if self.bar.is_hidden() && self.last_line.elapsed() >= LINE_INTERVAL {
            self.last_line = Instant::now();
            tell(&format!("{:3.0} % {pass}", fraction * 100.0));
        }
        self.bar.set_position((fraction * STEPS as f32) as u64);
        go_on()
    }
}
