//! The engine's settings that trade speed for accuracy, each timed and measured.

use std::path::Path;
use std::time::Instant;

use camlux::internals::{Intermediates, f64_kernels};
use camlux::metrics::{Comparison, Pixels};
use camlux::output::{ExrOptions, Frame, Layer, OutputFile, write_exr};
use camlux::scene::{IndirectLight, VplSum};
use camlux::{Error, Renderer, Scene};

use super::Subject;
use super::measured::Group;
use super::results::{EngineFigures, Entry, PassMedian, Seconds, median};
use super::settings::{self, Setting};
use super::steps::Steps;
use super::truth::{TruthImage, values};
use crate::Failure;

/// A frame is timed no more often.
const MAX_RUNS: usize = 15;

/// How far the sweep goes.
#[derive(Clone, Copy, Debug)]
pub struct SweepOptions {
    pub is_quick: bool,
    /// A frame that is expected to take longer is left out.
    pub longest_s: f64,
    /// The reference's series ends with the first point that took longer.
    pub longest_reference_s: f64,
    /// Pixels on which the kernel error is measured.
    pub kernel_pixels: usize,
    pub min_runs: usize,
    /// No more runs than the least are begun after this.
    pub enough_s: f64,
}

impl SweepOptions {
    pub fn new(is_quick: bool) -> Self {
        SweepOptions {
            is_quick,
            longest_s: if is_quick { 3.0 } else { 60.0 },
            longest_reference_s: if is_quick { 0.6 } else { 15.0 },
            kernel_pixels: if is_quick { 128 } else { 512 },
            min_runs: if is_quick { 2 } else { 3 },
            enough_s: if is_quick { 0.2 } else { 3.0 },
        }
    }
}

/// What a sweep works with.
pub struct Sweep<'a> {
    pub renderer: &'a mut Renderer,
    pub subject: &'a Subject,
    pub truth: &'a TruthImage,
    pub measured: &'a Group<'a>,
    pub options: SweepOptions,
    /// A file that may be written and removed.
    pub scratch: &'a Path,
    pub steps: &'a Steps,
}

impl Sweep<'_> {
    /// The frame without indirect light.
    ///
    /// # Errors
    /// Those of rendering and writing.
    pub fn direct_only(&mut self) -> Result<Seconds, Failure> {
        self.measured.obtain("direct light", (), || {
            self.steps
                .begin(format!("{}: direct light", self.subject.name))?;
            let scene = Scene {
                indirect: None,
                ..self.subject.scene.clone()
            };
            // The warm-up.
            self.render(&scene)?;
            let (_, seconds, _) = self.time(&scene)?;
            Ok(seconds)
        })
    }

    /// Every setting of every series, but those that would take too long or that the device cannot hold: for these a
    /// sentence each.
    ///
    /// # Errors
    /// Those of rendering and writing.
    pub fn settings(&mut self) -> Result<(Vec<Entry>, Vec<String>), Failure> {
        let (mut entries, mut skipped) = (Vec::new(), Vec::new());
        for settings in settings::series(self.options.is_quick) {
            let mut expected_s = 0.0;
            for setting in &settings {
                let what = format!("{} {}", setting.series, setting.label);
                if expected_s > self.options.longest_s {
                    let limit = self.options.longest_s;
                    skipped.push(format!(
                        "{what} and finer: about {expected_s:.0} s a frame, the limit is {limit:.0} s"
                    ));
                    break;
                }
                let measured = self.measured.obtain(&what, setting.indirect, || {
                    self.steps.begin(format!("{}: {what}", self.subject.name))?;
                    self.setting(setting)
                });
                match measured {
                    Ok(entry) => {
                        expected_s = next_seconds(&entry);
                        entries.push(entry);
                    }
                    Err(failure) => match failure.downcast_ref::<Error>() {
                        Some(Error::DeviceLimit { .. } | Error::Memory { .. }) => {
                            skipped.push(format!("{what} and finer: {failure}"));
                            break;
                        }
                        _ => return Err(failure),
                    },
                }
            }
        }
        Ok((entries, skipped))
    }

    fn setting(&mut self, setting: &Setting) -> Result<Entry, Failure> {
        let indirect = setting.indirect;
        let scene = Scene {
            indirect: Some(indirect),
            ..self.subject.scene.clone()
        };
        // Also the warm-up.
        let (kernel_error, kernel_error_pixels, stderr_deviation) = match setting.sum {
            Some(sum) => {
                let (error, pixels) = self.kernel_error(&scene, sum)?;
                (error, pixels, None)
            }
            None => (None, 0, self.stderr_deviation(&scene)?),
        };
        let (frame, seconds, gpu_passes) = self.time(&scene)?;
        let layer = |layer| values(&frame, layer);
        let (indirect_light, total) = (layer(Layer::Indirect)?, layer(Layer::Radiance)?);
        Ok(Entry {
            series: setting.series.into(),
            label: setting.label.clone(),
            seconds,
            engine: Some(EngineFigures {
                estimator: indirect.name().into(),
                rsm_size: indirect.rsm_size(),
                target_error: indirect.target_error(),
                estimated_error: frame.stats.estimated_error,
                estimated_error_upper: frame.stats.estimated_error_upper,
                stderr_deviation,
                stop: frame.stats.stop.map(|stop| stop.name().into()),
                vpl_count: frame.stats.vpl_count,
                pixel_vpl_pairs: frame.stats.pixel_vpl_pairs,
                ray_count: frame.stats.ray_count,
                pairs_per_second: frame.stats.pairs_per_second(),
                gpu_passes,
                kernel_error,
                kernel_error_pixels,
            }),
            ..self.truth.measure(indirect_light, total)?
        })
    }

    fn render(&mut self, scene: &Scene) -> Result<Frame, Error> {
        self.steps
            .watch(|options| self.renderer.render(scene, options))
    }

    /// The errors of final gathering over what it says of them.
    fn stderr_deviation(&mut self, scene: &Scene) -> Result<Option<f64>, Failure> {
        let mut scene = scene.clone();
        if let Some(IndirectLight::FinalGather { stderr_layer, .. }) = &mut scene.indirect {
            *stderr_layer = true;
        }
        let frame = self.render(&scene)?;
        let [indirect, stated] = [Layer::Indirect, Layer::StandardError].map(|l| values(&frame, l));
        self.truth.stderr_deviation(indirect?, stated?)
    }

    /// relRMSE of a plain sum against that of the f64 kernels, `None` where that is black, and on how many pixels.
    fn kernel_error(
        &mut self,
        scene: &Scene,
        sum: VplSum,
    ) -> Result<(Option<f64>, usize), Failure> {
        let (frame, kept) = self
            .steps
            .watch(|options| self.renderer.render_with_intermediates(scene, options))?;
        let pixels = spread(&kept, self.options.kernel_pixels);
        let exact = f64_kernels::indirect_at(scene, sum, &kept, &pixels);
        let (computed, _) = values(&frame, Layer::Indirect)?.as_chunks::<3>();
        let computed: Vec<f32> = pixels.iter().flat_map(|&pixel| computed[pixel]).collect();
        let comparison = Comparison::new(&Pixels {
            image: &computed,
            reference: exact.as_flattened(),
            image_standard_error: None,
            reference_standard_error: None,
            valid: &vec![true; pixels.len()],
            edges: None,
            channels: 3,
        })?;
        let error = comparison.errors.map(|errors| errors.rmse);
        Ok((error, pixels.len()))
    }

    /// Renders a frame again and again and writes it to the scratch file: the last frame, and the times of all. Pipelines
    /// must be warm.
    fn time(&mut self, scene: &Scene) -> Result<(Frame, Seconds, Vec<PassMedian>), Failure> {
        let options = self.options;
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
            // The next run replaces it; one that is left behind does no harm.
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
            let has_time = begin.elapsed().as_secs_f64() <= options.enough_s;
            let wanted = if has_time { MAX_RUNS } else { options.min_runs };
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
                let seconds = Seconds::from_runs(runs, parts).unwrap_or_default();
                return Ok((frame, seconds, gpu_passes.collect()));
            }
        }
    }
}

/// Up to `count` pixels with a surface, spread over the image without a pattern; the same ones every time.
fn spread(kept: &Intermediates, count: usize) -> Vec<usize> {
    let pixels = 0..kept.gbuffer.len();
    let seen = pixels.filter(|&pixel| kept.gbuffer[pixel].is_some());
    fastrand::Rng::with_seed(0).choose_multiple(seen, count)
}

/// What the next setting of the series will take, at least. A plain sum at every pixel: four times the pairs, and the rest as it is.
fn next_seconds(entry: &Entry) -> f64 {
    let sums = entry.engine.iter().filter(|e| e.target_error.is_none());
    let gather_ms = sums
        .flat_map(|engine| &engine.gpu_passes)
        .filter(|pass| pass.name == "gather");
    entry.seconds.median + 3e-3 * gather_ms.map(|pass| pass.milliseconds).sum::<f64>()
}
