//! Times frames from the call to the written file.

use std::path::Path;
use std::time::Instant;

use camlux::output::{ExrOptions, Frame, OutputFile, write_exr};
use camlux::{Error, Renderer, Scene};
use serde::{Deserialize, Serialize};

use super::steps::Steps;
use crate::Failure;

/// Maximum number of timed runs of a frame.
const MAX_RUNS: usize = 15;
/// If a frame takes longer than this, one run is enough, s.
const LONG_S: f64 = 60.0;

/// Renders and times.
pub struct Stopwatch<'a> {
    pub renderer: &'a mut Renderer,
    /// A scratch file that may be overwritten and removed.
    pub scratch: &'a Path,
    pub steps: &'a Steps,
    min_runs: usize,
    /// After this time, no more runs are started beyond the minimum.
    enough_s: f64,
}

/// A frame that was rendered several times.
pub struct Timed {
    /// The frame of the last run.
    pub frame: Frame,
    pub seconds: Seconds,
    pub gpu_passes: Vec<PassMedian>,
}

impl<'a> Stopwatch<'a> {
    pub fn new(
        renderer: &'a mut Renderer,
        scratch: &'a Path,
        steps: &'a Steps,
        is_quick: bool,
    ) -> Self {
        Stopwatch {
            renderer,
            scratch,
            steps,
            min_runs: if is_quick { 2 } else { 3 },
            enough_s: if is_quick { 0.2 } else { 3.0 },
        }
    }

    /// Renders once.
    ///
    /// # Errors
    /// Errors of rendering.
    pub fn render(&mut self, scene: &Scene) -> Result<Frame, Error> {
        self.steps
            .watch(|options| self.renderer.render(scene, options))
    }

    /// Renders a frame several times and writes it to the scratch file. Pipelines must be warm.
    ///
    /// # Errors
    /// Errors of rendering and writing.
    pub fn time(&mut self, scene: &Scene) -> Result<Timed, Failure> {
        let (mut runs, mut render_s, mut write_s) = (Vec::new(), Vec::new(), Vec::new());
        let mut passes: Vec<(&'static str, Vec<f64>)> = Vec::new();
        let begin = Instant::now();
        loop {
            let file = OutputFile::create(self.scratch)?;
            let start = Instant::now();
            let frame = self.render(scene)?;
            let rendered = start.elapsed().as_secs_f64();
            write_exr(file, &frame, &ExrOptions::default())?;
            let written = start.elapsed().as_secs_f64();
            // The next run replaces the file; a leftover file does no harm.
            let _ = std::fs::remove_file(self.scratch);

            runs.push(written);
            render_s.push(rendered);
            write_s.push(written - rendered);
            for pass in &frame.stats.passes {
                match passes.iter_mut().find(|(name, _)| *name == pass.name) {
                    Some((_, times)) => times.push(pass.milliseconds),
                    None => passes.push((pass.name, vec![pass.milliseconds])),
                }
            }
            let wanted = match begin.elapsed().as_secs_f64() {
                spent if spent <= self.enough_s => MAX_RUNS,
                spent if spent <= LONG_S => self.min_runs,
                _ => 1,
            };
            if runs.len() >= wanted {
                let parts = [("render", render_s), ("write", write_s)];
                let parts = parts.map(|(name, times)| (name, median(&times).unwrap_or_default()));
                let gpu_passes = passes.iter().filter_map(|(name, times)| {
                    let milliseconds = median(times)?;
                    Some(PassMedian {
                        name: (*name).into(),
                        milliseconds,
                    })
                });
                return Ok(Timed {
                    frame,
                    seconds: Seconds::from_runs(runs, parts).unwrap_or_default(),
                    gpu_passes: gpu_passes.collect(),
                });
            }
        }
    }
}

#[derive(Serialize, Deserialize)]
pub struct PassMedian {
    pub name: String,
    pub milliseconds: f64,
}

/// Time of a frame from the call to the written file, with scene, device and pipelines already set up.
#[derive(Serialize, Deserialize, Default)]
pub struct Seconds {
    pub median: f64,
    pub min: f64,
    pub max: f64,
    pub runs: Vec<f64>,
    /// Median of each part.
    pub parts: Vec<TimePart>,
}

#[derive(Serialize, Deserialize)]
pub struct TimePart {
    pub name: String,
    pub seconds: f64,
}

impl Seconds {
    /// Combines timed runs and the medians of their parts; `None` if there are no runs.
    pub fn from_runs<Name: Into<String>>(
        runs: Vec<f64>,
        parts: impl IntoIterator<Item = (Name, f64)>,
    ) -> Option<Seconds> {
        let parts = parts.into_iter().map(|(name, seconds)| TimePart {
            name: name.into(),
            seconds,
        });
        Some(Seconds {
            median: median(&runs)?,
            min: runs.iter().copied().reduce(f64::min)?,
            max: runs.iter().copied().reduce(f64::max)?,
            runs,
            parts: parts.collect(),
        })
    }
}

/// The middle value, or the mean of the middle two.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let upper = *sorted.get(middle)?;
    if sorted.len().is_multiple_of(2) {
        Some(0.5 * (sorted[middle - 1] + upper))
    } else {
        Some(upper)
    }
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn median_is_the_middle() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&[]), None);
    }
}
