//! What a run did, for people.

use std::fmt::Write;
use std::path::PathBuf;
use std::time::Instant;

use camlux::output::{Frame, PngPreview, PngView};

use crate::render::Args;

/// A finished run.
pub struct RunSummary<'run> {
    pub args: &'run Args,
    pub frame: &'run Frame,
    pub wall: WallTimes,
    pub written: Vec<Written>,
    /// Of the scene, of the frame, and of what its file does not hold.
    pub warnings: Vec<String>,
}

/// Wall times of the program's own steps.
pub struct WallTimes {
    /// Name and milliseconds, in the order of execution.
    pub steps: Vec<(&'static str, f64)>,
    step_start: Instant,
}

impl WallTimes {
    pub fn new() -> Self {
        WallTimes {
            steps: Vec::new(),
            step_start: Instant::now(),
        }
    }

    /// Ends a step; the next one begins.
    pub fn end_step(&mut self, name: &'static str) {
        let milliseconds = self.step_start.elapsed().as_secs_f64() * 1e3;
        self.steps.push((name, milliseconds));
        self.step_start = Instant::now();
    }
}

/// A file that was written.
pub struct Written {
    pub what: String,
    pub path: PathBuf,
}

impl Written {
    pub fn new(what: impl Into<String>, path: impl Into<PathBuf>) -> Self {
        Written {
            what: what.into(),
            path: path.into(),
        }
    }
}

/// Says what the panels of a preview are and how they are exposed.
pub fn describe_preview(view: PngView, preview: PngPreview) -> String {
    let white = preview.white_radiance;
    match view {
        PngView::Radiance => format!("radiance, white = {white:.3e} W/sr/m^2"),
        PngView::SideBySide => {
            format!("direct | indirect | total in one exposure, white = {white:.3e} W/sr/m^2")
        }
    }
}

/// A few lines: device, times, counts, files.
pub fn text(run: &RunSummary) -> String {
    let stats = &run.frame.stats;
    let mut text = String::new();
    let mut line = |label: &str, content: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{label:<8}{content}");
    };
    line(
        "device",
        format!("{}, driver {}", stats.device, stats.driver),
    );
    let passes = stats
        .passes
        .iter()
        .map(|pass| (pass.name, pass.milliseconds));
    line("GPU", list_times(passes));
    if let Some(indirect) = &run.frame.description.indirect {
        let mut counts = stats.vpl_count.to_string();
        if stats.pixel_vpl_pairs > 0 {
            let pairs = with_prefix(stats.pixel_vpl_pairs as f64);
            let _ = write!(counts, ", {pairs} pixel-VPL pairs");
        }
        if let Some(rate) = stats.pairs_per_second() {
            let _ = write!(counts, ", {} pairs/s", with_prefix(rate));
        }
        line("VPLs", counts);
        if let Some(requested) = indirect.target_error() {
            line("rays", with_prefix(stats.ray_count as f64));
            let description = describe_error(stats.estimated_error, requested);
            line("error", format!("{description} against the true bounce)"));
        }
        if let Some(requested) = indirect.interpolation_error() {
            let description = describe_error(stats.estimated_interpolation_error, requested);
            line(
                "error",
                format!("{description} against the sum at every pixel)"),
            );
        }
    }
    line("wall", list_times(run.wall.steps.iter().copied()));
    for file in &run.written {
        line("wrote", format!("{} ({})", file.path.display(), file.what));
    }
    text
}

/// What the engine estimates of an error, and what was requested.
fn describe_error(estimated: Option<f64>, requested: f64) -> String {
    let percent = |error: f64| format!("{:.2} %", 100.0 * error);
    let estimated = estimated.map_or("not estimated".into(), |error| {
        format!("estimated {}", percent(error))
    });
    format!("{estimated}, requested {} (relRMSE", percent(requested))
}

fn list_times<'name>(times_ms: impl Iterator<Item = (&'name str, f64)>) -> String {
    let times: Vec<String> = times_ms
        .map(|(name, ms)| format!("{name} {ms:.2} ms"))
        .collect();
    times.join(", ")
}

fn with_prefix(value: f64) -> String {
    match value {
        v if v >= 1e9 => format!("{:.2} G", v * 1e-9),
        v if v >= 1e6 => format!("{:.2} M", v * 1e-6),
        v => format!("{v:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::describe_error;

    #[test]
    fn the_error_line_says_whether_there_is_an_estimate() {
        let describe = |estimated| describe_error(estimated, 0.02);
        assert!(describe(Some(0.0173)).starts_with("estimated 1.73 %, requested 2.00 %"));
        assert!(describe(None).starts_with("not estimated, requested 2.00 %"));
    }
}
