//! Times and measures each setting of the engine that trades speed for accuracy.

use camlux::internals::{Intermediates, f64_kernels};
use camlux::metrics::{Comparison, Pixels};
use camlux::output::Layer;
use camlux::scene::{IndirectLight, VplSum};
use camlux::{Error, Scene};

use super::Subject;
use super::measured::Group;
use super::reference_image::{ReferenceImage, values};
use super::results::{EngineFigures, Entry};
use super::settings::{self, Setting};
use super::stopwatch::{Seconds, Stopwatch, Timed};
use crate::Failure;

/// Limits of the sweep.
#[derive(Clone, Copy, Debug)]
pub struct SweepOptions {
    pub is_quick: bool,
    /// Leaves out a frame that is expected to take longer than this.
    pub longest_s: f64,
    /// The series of the reference ends with the first point that takes longer than this.
    pub longest_reference_s: f64,
    /// Pixels on which the kernel error is measured.
    pub kernel_pixels: usize,
}

impl SweepOptions {
    pub fn new(is_quick: bool) -> Self {
        SweepOptions {
            is_quick,
            longest_s: if is_quick { 3.0 } else { 100.0 },
            longest_reference_s: if is_quick { 0.6 } else { 15.0 },
            kernel_pixels: if is_quick { 128 } else { 512 },
        }
    }
}

/// What a sweep needs.
pub struct Sweep<'a> {
    pub stopwatch: Stopwatch<'a>,
    pub subject: &'a Subject,
    pub reference: &'a ReferenceImage,
    pub measured: &'a Group<'a>,
    pub options: SweepOptions,
}

impl Sweep<'_> {
    /// Times the frame without indirect light.
    ///
    /// # Errors
    /// Errors of rendering and writing.
    pub fn direct_only(&mut self) -> Result<Seconds, Failure> {
        self.measured.obtain("direct light", (), || {
            let step = format!("{}: direct light", self.subject.name);
            self.stopwatch.steps.begin(step)?;
            let scene = Scene {
                indirect: None,
                ..self.subject.scene.clone()
            };
            // The warm-up.
            self.stopwatch.render(&scene)?;
            Ok(self.stopwatch.time(&scene)?.seconds)
        })
    }

    /// Renders every setting of every series. Skips settings that would take too long or that the device cannot hold, and returns one
    /// sentence for each of these.
    ///
    /// # Errors
    /// Errors of rendering and writing.
    pub fn settings(&mut self) -> Result<(Vec<Entry>, Vec<String>), Failure> {
        let (mut entries, mut skipped): (Vec<Entry>, Vec<String>) = (Vec::new(), Vec::new());
        for settings in settings::series(self.options.is_quick, self.reference.bounces()) {
            let first = entries.len();
            for setting in &settings {
                let what = format!("{} {}", setting.series, setting.label);
                let last = entries[first..].last();
                let expected_s = last.map_or(0.0, |last| next_seconds(last, setting));
                if expected_s > self.options.longest_s {
                    let limit = self.options.longest_s;
                    skipped.push(format!(
                        "{what} and finer: about {expected_s:.0} s a frame, the limit is {limit:.0} s"
                    ));
                    break;
                }
                let measured = self.measured.obtain(&what, setting.indirect, || {
                    let step = format!("{}: {what}", self.subject.name);
                    self.stopwatch.steps.begin(step)?;
                    self.setting(setting)
                });
                match measured {
                    Ok(entry) => entries.push(entry),
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
        // This render is also the warm-up.
        let (kernel_error, kernel_error_pixels, stderr_deviation) = match setting.sum {
            Some(sum) => {
                let (error, pixels) = self.kernel_error(&scene, sum)?;
                (error, pixels, None)
            }
            None => (None, 0, self.stderr_deviation(&scene)?),
        };
        let Timed {
            frame,
            seconds,
            gpu_passes,
        } = self.stopwatch.time(&scene)?;
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
            time_of_flight: self
                .reference
                .measure_phasors(|layer| frame.values(layer))?,
            ..self.reference.measure(indirect_light, total)?
        })
    }

    /// The standard deviation of final gathering's errors, divided by the standard errors that it states.
    fn stderr_deviation(&mut self, scene: &Scene) -> Result<Option<f64>, Failure> {
        let mut scene = scene.clone();
        if let Some(IndirectLight::FinalGather(gather)) = &mut scene.indirect {
            gather.stderr_layer = true;
        }
        let frame = self.stopwatch.render(&scene)?;
        let [indirect, stated] = [Layer::Indirect, Layer::StandardError].map(|l| values(&frame, l));
        self.reference.stderr_deviation(indirect?, stated?)
    }

    /// The relRMSE of a plain sum against the f64 kernels (`None` if these are black), and the number of pixels it was measured on.
    fn kernel_error(
        &mut self,
        scene: &Scene,
        sum: VplSum,
    ) -> Result<(Option<f64>, usize), Failure> {
        let Stopwatch {
            renderer, steps, ..
        } = &mut self.stopwatch;
        let (frame, kept) =
            steps.watch(|options| renderer.render_with_intermediates(scene, options))?;
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
}

/// Up to `count` pixels that show a surface, spread over the image at random; the same pixels every time.
fn spread(kept: &Intermediates, count: usize) -> Vec<usize> {
    let pixels = 0..kept.gbuffer.len();
    let seen = pixels.filter(|&pixel| kept.gbuffer[pixel].is_some());
    fastrand::Rng::with_seed(0).choose_multiple(seen, count)
}

/// Lower bound of the time for `next`, estimated from the setting before it. A plain sum at every pixel has four times the pairs; its other
/// passes take the same time. For final gathering, the error falls with the power 0.72 of the number of rays.
fn next_seconds(entry: &Entry, next: &Setting) -> f64 {
    let Some(engine) = &entry.engine else {
        return 0.0;
    };
    if let (Some(asked), Some(next)) = (engine.target_error, next.indirect.target_error()) {
        let reached = entry.indirect.as_ref().map_or(asked, |e| e.relative_rmse);
        return entry.seconds.median * (reached.min(asked) / next).max(1.0).powf(1.0 / 0.72);
    }
    let passes = engine.gpu_passes.iter();
    let gather_ms = passes.filter(|pass| pass.name == "gather");
    entry.seconds.median + 3e-3 * gather_ms.map(|pass| pass.milliseconds).sum::<f64>()
}
