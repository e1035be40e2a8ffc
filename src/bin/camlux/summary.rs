//! The result of a run, for readers.

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
    /// A description of each file, and its path.
    pub written: Vec<(String, PathBuf)>,
    /// Warnings about the scene, the frame and what its file lacks.
    pub warnings: Vec<String>,
}

/// Files, time and error; on request also passes, counts and the device.
pub fn text(run: &RunSummary) -> String {
    let stats = &run.frame.stats;
    let mut text = String::new();
    let mut line = |label: &str, content: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{label:<8}{content}");
    };
    for (content, path) in &run.written {
        line("wrote", format!("{} ({content})", path.display()));
    }
    let total_ms: f64 = run.wall.iter().map(|(_, ms)| ms).sum();
    let of_render = run.wall.iter().find(|(step, _)| *step == "render");
    let of_render = of_render.map(|(_, ms)| format!(", {} of it to render", duration(*ms)));
    line("time", duration(total_ms) + &of_render.unwrap_or_default());
    if let Some(indirect) = &run.frame.description.indirect {
        if let Some(gather) = indirect.gather() {
            let range_mm = gather.target_range_error_mm;
            let against = match (&run.frame.description.tof, range_mm) {
                (Some(_), None) => "of the indirect light or a phasor, whichever is larger",
                _ => "of the indirect light",
            };
            let estimated = stats.estimated_error_text();
            line(
                "error",
                describe_error(&estimated, gather.target_error, against),
            );
            if let (Some(requested), Some(text)) = (range_mm, stats.range_error_text()) {
                let target = format!("target {requested} mm (rms of the range)");
                line("error", format!("{text}, {target}"));
            }
        }
        if indirect.sum().is_some() {
            let problem = "unknown: a sum over VPLs is not the physical bounce; use final-gather (docs/guides/estimators.md)";
            line("error", problem.into());
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
            "estimated {} (relRMSE of the direct light of area lights)",
            percent(error)
        );
        line("error", text);
    }
    if !run.args.verbose {
        return text;
    }
    for (label, times) in [("passes", &stats.passes), ("host", &stats.host_steps)] {
        let times = times.iter();
        line(
            label,
            list_times(times.map(|time| (time.name, time.milliseconds))),
        );
    }
    line("steps", list_times(run.wall.iter().copied()));
    if run.frame.description.indirect.is_some() {
        let mut counts = stats.vpl_count.to_string();
        if stats.pixel_vpl_pairs > 0 {
            let pairs = count(stats.pixel_vpl_pairs as f64);
            let _ = write!(counts, ", {pairs} pixel-VPL pairs");
        }
        if let Some(rate) = stats.pairs_per_second() {
            let _ = write!(counts, ", {} pairs/s", count(rate));
        }
        line("VPLs", counts);
        line("rays", count(stats.ray_count as f64));
    }
    line(
        "device",
        format!("{}, driver {}", stats.device, stats.driver),
    );
    text
}

/// Such as 840 ms, 1.24 s, 73 s.
fn duration(milliseconds: f64) -> String {
    match milliseconds {
        ms if ms < 1000.0 => format!("{ms:.0} ms"),
        ms if ms < 10_000.0 => format!("{:.2} s", 1e-3 * ms),
        ms => format!("{:.0} s", 1e-3 * ms),
    }
}

/// The engine's estimate of an error, and the target error.
fn describe_error(estimated: &str, requested: f64, against: &str) -> String {
    let requested = percent(requested);
    format!("{estimated}, target {requested} (relRMSE {against})")
}

fn percent(error: f64) -> String {
    format!("{:.2} %", 100.0 * error)
}

fn list_times<'name>(times_ms: impl Iterator<Item = (&'name str, f64)>) -> String {
    let times = times_ms.map(|(name, ms)| format!("{name} {ms:.2} ms"));
    Vec::from_iter(times).join(", ")
}
