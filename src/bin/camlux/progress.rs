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

/// Breaks after a signal.
pub fn go_on() -> ControlFlow<()> {
    match is_interrupted() {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}

/// A bar on a terminal, nothing elsewhere. Gone when dropped.
pub struct Bar(Option<ProgressBar>);

impl Bar {
    /// `template`: in the language of `indicatif`.
    pub fn new(steps: u64, template: &str) -> Self {
        Bar(std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template(template);
            let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(steps).with_style(style)
        }))
    }

    /// `None` where stderr is no terminal.
    pub fn get(&self) -> Option<&ProgressBar> {
        self.0.as_ref()
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Some(bar) = self.get() {
            bar.finish_and_clear();
        }
    }
}

/// A long computation with an estimate of its end: a bar on a terminal, a line every ten percent elsewhere.
pub struct Estimate {
    what: &'static str,
    bar: Bar,
    reported_tenths: Cell<u64>,
}

impl Estimate {
    pub fn new(what: &'static str) -> Self {
        let template =
            format!("{what:10} {{wide_bar}} {{percent:>3}} % {{elapsed}}, {{eta}} to go");
        Estimate {
            what,
            bar: Bar::new(STEPS, &template),
            reported_tenths: Cell::new(0),
        }
    }

    /// `share`: 0 to 1.
    pub fn show(&self, share: f64) {
        let tenths = (share * 10.0) as u64;
        if let Some(bar) = self.bar.get() {
            bar.set_position((share * STEPS as f64) as u64);
        } else if tenths
            > self
                .reported_tenths
                .replace(tenths.max(self.reported_tenths.get()))
        {
            tell(&format!("{:3.0} % {}", 100.0 * share, self.what));
        }
    }
}

/// Shows the progress of a render until dropped: a bar on a terminal, a line per pass elsewhere.
pub struct ProgressDisplay {
    bar: Bar,
    pass: &'static str,
}

impl ProgressDisplay {
    pub fn new() -> Self {
        ProgressDisplay {
            bar: Bar::new(STEPS, "{msg:10} {wide_bar} {percent:>3} % {elapsed}"),
            pass: "",
        }
    }

    pub fn show(&mut self, progress: Progress) -> ControlFlow<()> {
        let is_new_pass = self.pass != progress.pass;
        self.pass = progress.pass;
        match self.bar.get() {
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
        go_on()
    }
}
