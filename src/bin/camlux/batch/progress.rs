//! How far a batch is: a bar with rate and estimate on a terminal, now and then a line elsewhere.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::tell;

/// Lines come at each tenth, and this often where that takes longer.
const TIME_BETWEEN_LINES: Duration = Duration::from_secs(30);

/// Gone when dropped.
pub struct FrameProgress {
    bar: Option<ProgressBar>,
    count: u64,
    done: u64,
    start: Instant,
    told: (u64, Instant),
}

impl FrameProgress {
    pub fn new(count: u64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template(
                "{pos}/{len} frames {wide_bar} {per_sec}, {elapsed}, {eta} to go",
            )
            .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(count).with_style(style)
        });
        let start = Instant::now();
        FrameProgress {
            bar,
            count,
            done: 0,
            start,
            told: (0, start),
        }
    }

    pub fn step(&mut self) {
        self.done += 1;
        if let Some(bar) = &self.bar {
            return bar.inc(1);
        }
        let tenth = 10 * self.done / self.count.max(1);
        if tenth == self.told.0 && self.told.1.elapsed() < TIME_BETWEEN_LINES {
            return;
        }
        self.told = (tenth, Instant::now());
        let elapsed_s = self.start.elapsed().as_secs_f64();
        let rate = self.done as f64 / elapsed_s;
        let left_s = (self.count - self.done) as f64 / rate;
        let (done, count) = (self.done, self.count);
        tell(&format!(
            "{done}/{count} frames, {rate:.2} frames/s, {left_s:.0} s to go"
        ));
    }

    /// A line that does not tear the bar.
    pub fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| tell(line)),
            None => tell(line),
        }
    }
}

impl Drop for FrameProgress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
