//! What a run did, for people.

use std::fmt::Write;
use std::path::PathBuf;

use camlux::output::Frame;

use crate::numbers::count;
use crate::render::Args;

/// A finished run.
pub struct RunSummary<'run> {
    pub args: &'run Args,
    pub frame: &'run Frame,
    /// Name and milliseconds of the program's own steps, in the order of execution.
    pub wall: Vec<(&'static str, f64)>,
    /// What each file holds, and where it is.
    pub written: Vec<(String, PathBuf)>,
    /// Of the scene, of the frame, and of what its file does not hold.
    pub warnings: Vec<String>,
}

/// A few lines: device, times, counts, files.
pub fn text(run: &RunSummary) -> String {
    let stats = &run.frame.stats;
    let mut text = String::new();
    let mut line = |label: &str, content: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{label:<8}{content}");
    };
    let device = format!("{}, driver {}", stats.device, stats.driver);
    line("device", device);
    let passes = stats.passes.iter();
    let times = passes.map(|pass| (pass.name, pass.milliseconds));
    line("GPU", list_times(times));
    if let Some(indirect) = &run.frame.description.indirect {
        let mut counts = stats.vpl_count.to_string();
        if stats.pixel_vpl_pairs > 0 {
            let pairs = count(stats.pixel_vpl_pairs as f64);
            let _ = write!(counts, ", {pairs} pixel-VPL pairs");
        }
        if let Some(rate) = stats.pairs_per_second() {
            let _ = write!(counts, ", {} pairs/s", count(rate));
        }
        line("VPLs", counts);
        if let Some(requested) = indirect.target_error() {
            line("rays", count(stats.ray_count as f64));
            let against = "against the true bounce";
            let error = describe_error(&stats.estimated_error_text(), requested, against);
            line("error", error);
        }
        if let Some(requested) = indirect.interpolation_error() {
            let against = "against the sum at every pixel";
            let estimated = stats.estimated_interpolation_error;
            let estimated = estimated.map(|error| format!("estimated {}", percent(error)));
            let estimated = estimated.as_deref().unwrap_or("not estimated");
            line("error", describe_error(estimated, requested, against));
        }
    }
    if let Some(error) = stats.estimated_area_light_error {
        let text = format!(
            "estimated {} (relRMSE of the direct light of lights with an area)",
            percent(error)
        );
        line("error", text);
    }
    line("wall", list_times(run.wall.iter().copied()));
    for (content, path) in &run.written {
        line("wrote", format!("{} ({content})", path.display()));
    }
    text
}

/// What the engine estimates of an error, and what was requested.
fn describe_error(estimated: &str, requested: f64, against: &str) -> String {
    let requested = percent(requested);
    format!("{estimated}, requested {requested} (relRMSE {against})")
}

fn percent(error: f64) -> String {
    format!("{:.2} %", 100.0 * error)
}

fn list_times<'name>(times_ms: impl Iterator<Item = (&'name str, f64)>) -> String {
    let times = times_ms.map(|(name, ms)| format!("{name} {ms:.2} ms"));
    Vec::from_iter(times).join(", ")
}
