//! Progress of a batch: a bar with rate and remaining time on a terminal, occasional lines elsewhere.

use std::time::{Duration, Instant};

use indicatif::ProgressBar;

use crate::{progress, tell};

/// A line is printed at each tenth of the batch, and at this interval if a tenth takes longer.
const TIME_BETWEEN_LINES: Duration = Duration::from_secs(30);

pub struct FrameProgress {
    bar: ProgressBar,
    count: u64,
    done: u64,
    start: Instant,
    last_line: (u64, Instant),
}

impl FrameProgress {
    pub fn new(count: u64) -> Self {
        let template = "{pos}/{len} frames {wide_bar} {per_sec}, {elapsed}, {eta} to go";
        let start = Instant::now();
        FrameProgress {
            bar: progress::bar(count, template),
            count,
            done: 0,
            start,
            last_line: (0, start),
        }
    }

    pub fn step(&mut self) {
        self.done += 1;
        self.bar.inc(1);
        if !self.bar.is_hidden() {
            return;
        }
        let tenth = 10 * self.done / self.count.max(1);
        if tenth == self.last_line.0 && self.last_line.1.elapsed() < TIME_BETWEEN_LINES {
            return;
        }
        self.last_line = (tenth, Instant::now());
        let (done, count) = (self.done, self.count);
        let rate = done as f64 / self.start.elapsed().as_secs_f64();
        let left_s = (count - done) as f64 / rate;
        tell(&format!(
            "{done}/{count} frames, {rate:.2} frames/s, {left_s:.0} s to go"
        ));
    }

    /// Prints a line without disturbing the bar.
    pub fn say(&self, line: &str) {
        self.bar.suspend(|| tell(line));
    }
}
