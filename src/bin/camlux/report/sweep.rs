//! The engine's settings that trade speed for accuracy, each timed and measured.

use std::path::Path;

use camlux::internals::Intermediates;
use camlux::output::{Frame, Layer};
use camlux::scene::VplSum;
use camlux::{Error, RenderOptions, Renderer, Scene, internals::f64_kernels};

use super::error;
use super::results::{EngineFigures, Entry, Kind, PassMedian, Seconds};
use super::settings::{self, Setting};
use super::steps::Steps;
use super::timing::{Timed, TimingOptions, time};
use super::truth::TruthImage;
use crate::Failure;

/// How far the sweep goes.
#[derive(Clone, Copy)]
pub struct SweepOptions {
    pub is_quick: bool,
    /// A frame that is expected to take longer is left out.
    pub longest_s: f64,
    /// The reference's series ends with the first point that took longer.
    pub longest_reference_s: f64,
    /// Pixels on which the kernel error is measured.
    pub kernel_pixels: usize,
    pub timing: TimingOptions,
}

impl SweepOptions {
    pub fn new(is_quick: bool) -> Self {
        SweepOptions {
            is_quick,
            longest_s: if is_quick { 3.0 } else { 60.0 },
            longest_reference_s: if is_quick { 0.6 } else { 15.0 },
            kernel_pixels: if is_quick { 128 } else { 512 },
            timing: TimingOptions::new(is_quick),
        }
    }
}

/// What a sweep works with.
pub struct Sweep<'a> {
    pub renderer: &'a mut Renderer,
    pub name: &'a str,
    pub scene: &'a Scene,
    pub truth: &'a TruthImage,
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
        self.steps.begin(&format!("{}: direct light", self.name))?;
        let scene = Scene {
            indirect: None,
            ..self.scene.clone()
        };
        self.warm_up(&scene)?;
        Ok(self.time(&scene)?.seconds)
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
                self.steps.begin(&format!("{}: {what}", self.name))?;
                match self.setting(setting) {
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
            ..self.scene.clone()
        };
        // Also the warm-up.
        let (kernel_error, kernel_error_pixels) = match setting.sum {
            Some(sum) => self.kernel_error(&scene, sum)?,
            None => {
                self.warm_up(&scene)?;
                (None, 0)
            }
        };
        let Timed {
            frame,
            seconds,
            gpu_passes,
        } = self.time(&scene)?;
        let measured = self.truth.measure(
            frame_values(&frame, Layer::Indirect)?,
            frame_values(&frame, Layer::Radiance)?,
        )?;
        Ok(Entry {
            kind: Kind::Engine,
            series: setting.series.into(),
            label: setting.label.clone(),
            description: None,
            seconds,
            indirect: measured.indirect,
            total: measured.total,
            engine: Some(EngineFigures {
                estimator: indirect.name(),
                rsm_size: indirect.rsm_size(),
                target_error: indirect.target_error(),
                estimated_error: frame.stats.estimated_error,
                vpl_count: frame.stats.vpl_count,
                pixel_vpl_pairs: frame.stats.pixel_vpl_pairs,
                ray_count: frame.stats.ray_count,
                pairs_per_second: pairs_per_second(&frame, &gpu_passes),
                gpu_passes,
                kernel_error,
                kernel_error_pixels,
            }),
            is_on_engine_front: false,
            is_on_front: false,
            pictures: Some(measured.pictures),
        })
    }

    fn warm_up(&mut self, scene: &Scene) -> Result<(), Failure> {
        let mut show = |_| self.steps.tick();
        let mut options = RenderOptions {
            progress: Some(&mut show),
            ..RenderOptions::default()
        };
        self.renderer.render(scene, &mut options)?;
        Ok(())
    }

    /// relRMSE of a plain sum against that of the f64 kernels, `None` where that is black, and on how many pixels.
    fn kernel_error(
        &mut self,
        scene: &Scene,
        sum: VplSum,
    ) -> Result<(Option<f64>, usize), Failure> {
        let mut show = |_| self.steps.tick();
        let mut options = RenderOptions {
            progress: Some(&mut show),
            ..RenderOptions::default()
        };
        let (frame, kept) = self
            .renderer
            .render_with_intermediates(scene, &mut options)?;
        let pixels = spread(&kept, self.options.kernel_pixels);
        let exact = f64_kernels::indirect_at(scene, sum, &kept, &pixels);
        let (values, _) = frame_values(&frame, Layer::Indirect)?.as_chunks::<3>();
        let computed: Vec<f32> = pixels.iter().flat_map(|&pixel| values[pixel]).collect();
        let error = error::relative_rmse(&computed, exact.as_flattened())?;
        Ok((error, pixels.len()))
    }

    fn time(&mut self, scene: &Scene) -> Result<Timed, Failure> {
        let timing = self.options.timing;
        time(self.renderer, scene, self.scratch, timing, self.steps)
    }
}

/// Up to `count` pixels with a surface, spread over the image: multiples of the golden ratio fall evenly into the list and
/// into no pattern of the rows.
fn spread(kept: &Intermediates, count: usize) -> Vec<usize> {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    let points = kept.gbuffer.iter().enumerate();
    let seen: Vec<usize> = points.filter_map(|(i, p)| p.map(|_| i)).collect();
    if seen.len() <= count {
        return seen;
    }
    (0..count)
        .map(|i| seen[((i as f64 * GOLDEN).fract() * seen.len() as f64) as usize])
        .collect()
}

/// What the next setting of the series will take, at least. A plain sum at every pixel: four times the pairs, and the rest as it is.
fn next_seconds(entry: &Entry) -> f64 {
    let sums = entry.engine.iter().filter(|e| e.target_error.is_none());
    let gather_ms = sums
        .flat_map(|engine| &engine.gpu_passes)
        .filter(|pass| pass.name == "gather");
    entry.seconds.median + 3e-3 * gather_ms.map(|pass| pass.milliseconds).sum::<f64>()
}

fn pairs_per_second(frame: &Frame, gpu_passes: &[PassMedian]) -> Option<f64> {
    let gather = gpu_passes.iter().find(|pass| pass.name == "gather")?;
    let seconds = gather.milliseconds * 1e-3;
    (seconds > 0.0).then(|| frame.stats.pixel_vpl_pairs as f64 / seconds)
}

fn frame_values(frame: &Frame, layer: Layer) -> Result<&[f32], Failure> {
    let missing = || format!("internal error: the frame has no layer {}", layer.name());
    Ok(frame.values(layer).ok_or_else(missing)?)
}
