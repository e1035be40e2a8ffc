//! How long a frame takes, from the call to the file.

use std::path::Path;
use std::time::Instant;

use camlux::output::{ExrOptions, Frame, OutputFile, write_exr};
use camlux::{RenderOptions, Renderer, Scene};

use super::results::{PassMedian, Seconds, TimePart, median};
use super::steps::Steps;
use crate::Failure;

/// How often a frame is timed.
#[derive(Clone, Copy)]
pub struct TimingOptions {
    pub min_runs: usize,
    pub max_runs: usize,
    /// No more runs than the least are begun after this.
    pub enough_s: f64,
}

impl TimingOptions {
    pub fn new(is_quick: bool) -> Self {
        TimingOptions {
            min_runs: if is_quick { 2 } else { 3 },
            max_runs: 15,
            enough_s: if is_quick { 0.2 } else { 3.0 },
        }
    }
}

/// The last of the timed frames, and the times of all.
pub struct Timed {
    pub frame: Frame,
    pub seconds: Seconds,
    pub gpu_passes: Vec<PassMedian>,
}

/// Renders a frame again and again and writes it to `scratch`, a file that is removed. Pipelines must be warm: render the
/// scene once before.
///
/// # Errors
/// Those of rendering and writing; cancelled after a signal.
pub fn time(
    renderer: &mut Renderer,
    scene: &Scene,
    scratch: &Path,
    timing: TimingOptions,
    steps: &Steps,
) -> Result<Timed, Failure> {
    let (mut render_s, mut write_s) = (Vec::new(), Vec::new());
    let mut passes: Vec<(&'static str, Vec<f64>)> = Vec::new();
    let begin = Instant::now();
    loop {
        let file = OutputFile::create(scratch)?;
        let mut show = |_| steps.tick();
        let mut options = RenderOptions {
            progress: Some(&mut show),
            ..RenderOptions::default()
        };
        let start = Instant::now();
        let frame = renderer.render(scene, &mut options)?;
        let rendered = start.elapsed();
        write_exr(file, &frame, &ExrOptions::default())?;
        let written = start.elapsed();
        // The next run replaces it; one that is left behind does no harm.
        let _ = std::fs::remove_file(scratch);

        render_s.push(rendered.as_secs_f64());
        write_s.push((written - rendered).as_secs_f64());
        for pass in &frame.stats.passes {
            match passes.iter_mut().find(|(name, _)| *name == pass.name) {
                Some((_, times)) => times.push(pass.milliseconds),
                None => passes.push((pass.name, vec![pass.milliseconds])),
            }
        }
        let runs = render_s.len();
        let is_enough = runs >= timing.min_runs && begin.elapsed().as_secs_f64() > timing.enough_s;
        if is_enough || runs >= timing.max_runs {
            return Ok(Timed {
                seconds: sum_up(&render_s, &write_s)?,
                gpu_passes: passes
                    .iter()
                    .filter_map(|(name, times)| {
                        let milliseconds = median(times)?;
                        Some(PassMedian { name, milliseconds })
                    })
                    .collect(),
                frame,
            });
        }
    }
}

fn sum_up(render_s: &[f64], write_s: &[f64]) -> Result<Seconds, Failure> {
    let runs = render_s.iter().zip(write_s).map(|(a, b)| a + b).collect();
    let parts = [("render", render_s), ("write", write_s)].into_iter();
    let parts = parts
        .filter_map(|(name, times)| {
            Some(TimePart {
                name: name.into(),
                seconds: median(times)?,
            })
        })
        .collect();
    Seconds::from_runs(runs, parts).ok_or_else(|| "internal error: no run was timed".into())
}
