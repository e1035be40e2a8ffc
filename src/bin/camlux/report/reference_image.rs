//! The path-sampled reference image of a scene. The report measures all errors against it and keeps it for later reports.

use std::path::Path;
use std::time::Instant;

use camlux::metrics::{Comparison, CorrectedRmse, Pixels};
use camlux::model::SPEED_OF_LIGHT_M_S;
use camlux::output::{
    ExrOptions, Frame, Layer, OutputFile, TofQuantity, white_radiance, write_exr,
};
use camlux::reference::{Goal, Reference};
use camlux::{Error, Scene};

use super::Subject;
use super::measured::Group;
use super::picture::Pictures;
use super::results::{Entry, Kind, ModelError, PhasorError, ReferenceInfo};
use super::steps::Steps;
use super::stopwatch::{Seconds, median};
use crate::error_map::ErrorMap;
use crate::range_error::range_errors_m;
use crate::{Failure, reference, tell};

/// Samples of the first point of the reference's series. They are split into independent rounds, whose spread gives the error.
const FIRST_SAMPLES: u32 = 16;
const ROUNDS: u32 = 4;
const LAST_SAMPLES: u32 = 1 << 16;

/// A reference image, and how images are compared with it.
pub struct ReferenceImage {
    frame: Frame,
    /// Pixels that show a surface.
    valid: Vec<bool>,
    /// Pixels on edges, which are left out of all measurements.
    edges: Vec<bool>,
    /// Radiance of full brightness in all pictures, W/sr/m².
    white: f32,
}

/// Loads the image at `file` in the folder if it belongs to the scene, refines it to the standard error, and writes it. The width of its
/// edges fits the device.
///
/// # Errors
/// Errors of sampling and writing; cancelled after a signal.
pub fn obtain(
    scene: &Scene,
    folder: &Path,
    file: String,
    standard_error: f64,
    sub_pixel_bits: u32,
) -> Result<(ReferenceImage, ReferenceInfo), Failure> {
    let path = &folder.join(&file);
    // Checks the output path first, so that a long computation does not end in a write error.
    drop(OutputFile::create(path)?);
    let start = Instant::now();
    let stored = path.exists().then(|| Reference::resume(scene, path));
    let resumed = match stored.transpose() {
        Ok(resumed) => resumed,
        Err(Error::Input { at, problem, .. }) => {
            tell(&format!(
                "camlux: note: {at}: {problem}; camlux samples it again"
            ));
            None
        }
        Err(error) => return Err(error.into()),
    };
    let was_there = resumed.is_some();
    let goal = Goal::StandardError(standard_error);
    let reference = reference::refine(scene, goal, resumed, path)?;
    let reference = reference.with_sub_pixel_bits(sub_pixel_bits);
    let image = ReferenceImage::new(reference.frame())?;
    let surface_pixels = image.valid.iter().filter(|&&valid| valid).count();
    let pixels = image.valid.iter().zip(&image.edges);
    let edge_pixels = pixels.filter(|&(&valid, &edge)| valid && edge).count();
    let reference = ReferenceInfo {
        file,
        scene_hash: image.frame.description.scene_hash.clone(),
        samples_per_pixel: reference.samples_per_pixel(),
        bounces: image.bounces(),
        edge_pixels,
        edge_share: edge_pixels as f64 / surface_pixels.max(1) as f64,
        was_there,
        noise_floor: reference.relative_standard_error(),
        range_noise_m: image.range_noise_m(),
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok((image, reference))
}

impl ReferenceImage {
    fn new(frame: Frame) -> Result<ReferenceImage, Failure> {
        Ok(ReferenceImage {
            valid: frame.mask(Layer::InstanceId),
            edges: frame.mask(Layer::Edge),
            white: white_radiance(values(&frame, Layer::Indirect)?),
            frame,
        })
    }

    /// Most surfaces that reflect light before what the camera sees.
    pub fn bounces(&self) -> u32 {
        let samples = self.frame.description.reference;
        samples.map_or(1, |samples| samples.bounces)
    }

    /// # Errors
    /// If the PNG cannot be encoded.
    pub fn pictures(&self) -> Result<Pictures, Failure> {
        let indirect = values(&self.frame, Layer::Indirect)?;
        Pictures::new(self.frame.resolution_px, indirect, self.white, None)
    }

    /// The errors and pictures of an image of the reference's size; no error if the reference is black.
    ///
    /// # Errors
    /// If the image has another size.
    pub fn measure(&self, indirect: &[f32], total: &[f32]) -> Result<Entry, Failure> {
        let pixels = self.pixels(indirect, Layer::Indirect)?;
        let comparison = Comparison::new(&pixels)?;
        let size_px = self.frame.resolution_px;
        let map = ErrorMap::new(size_px, &pixels, &comparison);
        let of_total = self.pixels(total, Layer::Radiance)?;
        Ok(Entry {
            indirect: model_error(&pixels, &comparison)?,
            total: model_error(&of_total, &Comparison::new(&of_total)?)?,
            pictures: Some(Pictures::new(size_px, indirect, self.white, map.as_ref())?),
            ..Entry::default()
        })
    }

    /// The standard deviation of an image's errors, divided by the image's own standard errors; `None` if there is nothing to judge.
    ///
    /// # Errors
    /// If the image has another size.
    pub fn stderr_deviation(
        &self,
        indirect: &[f32],
        stated: &[f32],
    ) -> Result<Option<f64>, Failure> {
        let comparison = Comparison::new(&Pixels {
            image_standard_error: Some(stated),
            ..self.pixels(indirect, Layer::Indirect)?
        })?;
        Ok(comparison.z_scores.map(|scores| scores.deviation()))
    }

    fn pixels<'a>(&'a self, image: &'a [f32], layer: Layer) -> Result<Pixels<'a>, Failure> {
        let noise = layer.standard_error();
        let noise = noise.map(|noise| values(&self.frame, noise)).transpose()?;
        Ok(Pixels {
            image,
            reference: values(&self.frame, layer)?,
            image_standard_error: None,
            reference_standard_error: noise,
            valid: &self.valid,
            edges: Some(&self.edges),
            channels: layer.channel_names().len(),
        })
    }

    fn frequencies_hz(&self) -> &[f64] {
        let tof = self.frame.description.tof.as_ref();
        tof.map_or(&[], |tof| &tof.frequencies_hz)
    }

    fn counts(&self, pixel: usize) -> bool {
        self.valid[pixel] && !self.edges[pixel]
    }

    /// The errors of the phasors of each frequency, for an image with these layers. Skips frequencies whose layers are missing.
    ///
    /// # Errors
    /// If the image has another size.
    pub fn measure_phasors<'a>(
        &self,
        layer_of: impl Fn(Layer) -> Option<&'a [f32]>,
    ) -> Result<Vec<PhasorError>, Failure> {
        let frequencies = self.frequencies_hz().iter().enumerate();
        let measured = frequencies.filter_map(|(frequency, &frequency_hz)| {
            let layer = |quantity| Layer::Tof(frequency as u8, quantity);
            let indirect = layer_of(layer(TofQuantity::PhasorIndirect))?;
            let total = layer_of(layer(TofQuantity::Phasor))?;
            Some(self.phasor_error(frequency_hz, layer, [indirect, total]))
        });
        measured.collect()
    }

    fn phasor_error(
        &self,
        frequency_hz: f64,
        layer: impl Fn(TofQuantity) -> Layer,
        [indirect, total]: [&[f32]; 2],
    ) -> Result<PhasorError, Failure> {
        let pixels = self.pixels(indirect, layer(TofQuantity::PhasorIndirect))?;
        let reference = values(&self.frame, layer(TofQuantity::Phasor))?;
        let range = range_errors_m(total, reference, frequency_hz, |i| self.counts(i));
        Ok(PhasorError {
            frequency_hz,
            indirect: model_error(&pixels, &Comparison::new(&pixels)?)?,
            range_median_m: range.map(|[median, _]| median),
            range_p99_m: range.map(|[_, percentile_99]| percentile_99),
        })
    }

    /// The median of |error| of a Gaussian is 0.674 σ. The range error is c/(4πf) times the phase error. The phase error is the error of Z
    /// perpendicular to Z, divided by |Z|.
    fn range_noise_m(&self) -> Vec<f64> {
        let frequencies = self.frequencies_hz().iter().enumerate();
        let medians = frequencies.filter_map(|(frequency, &frequency_hz)| {
            let layer = |quantity| self.frame.values(Layer::Tof(frequency as u8, quantity));
            let (phasors, _) = layer(TofQuantity::Phasor)?.as_chunks::<2>();
            let (noise, _) = layer(TofQuantity::PhasorStandardError)?.as_chunks::<2>();
            let both = phasors.iter().zip(noise).enumerate();
            let both =
                both.filter(|(i, ([re, im], _))| self.counts(*i) && (*re, *im) != (0.0, 0.0));
            let shares = both.map(|(_, (z, sigma))| {
                let [z, sigma] = [z, sigma].map(|v| f64::from(v[0]).hypot(v[1].into()));
                sigma / z * std::f64::consts::FRAC_1_SQRT_2
            });
            let per_phase_m = SPEED_OF_LIGHT_M_S / (4.0 * std::f64::consts::PI * frequency_hz);
            Some(0.674 * per_phase_m * median(&shares.collect::<Vec<_>>())?)
        });
        medians.collect()
    }
}

/// Turns the library's comparison into the figures of the report. `None` if the reference is black or only noise.
fn model_error(pixels: &Pixels, comparison: &Comparison) -> Result<Option<ModelError>, Failure> {
    let with_edges = Comparison::new(&Pixels {
        edges: None,
        ..*pixels
    })?;
    let (Some(errors), Some(corrected)) = (comparison.errors, comparison.noise) else {
        return Ok(None);
    };
    let (relative_rmse, uncertainty) = match corrected.rmse {
        CorrectedRmse::Estimate {
            value,
            standard_error,
        } => (value, Some(standard_error)),
        CorrectedRmse::Below(bound) => (bound, None),
        CorrectedRmse::ReferenceIsNoise => return Ok(None),
    };
    Ok(Some(ModelError {
        relative_rmse,
        is_upper_bound: uncertainty.is_none(),
        relative_rmse_uncertainty: uncertainty,
        relative_rmse_uncorrected: Some(errors.rmse),
        relative_rmse_with_edges: with_edges
            .noise
            .and_then(|noise| noise.rmse.value_or_bound()),
        bias: Some(errors.bias),
        bias_uncertainty: Some(corrected.bias_standard_error),
        mean_relative_error: Some(errors.mean_absolute),
        p99: Some(errors.percentile_99),
        non_finite: with_edges.non_finite_image as u64,
    }))
}

/// Measures the reference as an entry of its own: its error (from its own spread) against its time. Doubles the number of samples until a
/// point takes longer than `longest_s`.
///
/// # Errors
/// Errors of sampling and writing; cancelled after a signal.
pub fn series(
    Subject { name, scene, .. }: &Subject,
    scratch: &Path,
    longest_s: f64,
    measured: &Group,
    steps: &Steps,
) -> Result<Vec<Entry>, Failure> {
    let mut entries = Vec::new();
    let mut samples = FIRST_SAMPLES;
    while samples <= LAST_SAMPLES {
        let what = format!("reference, {samples} samples");
        let entry = measured.obtain(&what, (), || {
            steps.begin(format!("{name}: {what}"))?;
            contender(scene, samples, scratch, steps)
        })?;
        let seconds = entry.seconds.median;
        entries.push(entry);
        if seconds > longest_s {
            break;
        }
        samples *= 2;
    }
    Ok(entries)
}

fn contender(scene: &Scene, samples: u32, scratch: &Path, steps: &Steps) -> Result<Entry, Failure> {
    let file = OutputFile::create(scratch)?;
    let start = Instant::now();
    let mut reference = Reference::new(scene, samples / ROUNDS)?;
    for _ in 0..ROUNDS {
        reference.add_round(&mut |_| steps.tick())?;
    }
    let sampled_s = start.elapsed().as_secs_f64();
    write_exr(file, &reference.frame(), &ExrOptions::default())?;
    let seconds = start.elapsed().as_secs_f64();
    let _ = std::fs::remove_file(scratch);

    let parts = [("sample", sampled_s), ("write", seconds - sampled_s)];
    let own_error = reference.relative_standard_error();
    Ok(Entry {
        kind: Kind::Reference,
        series: "camlux reference".into(),
        label: format!("{samples} spp"),
        seconds: Seconds::from_runs(vec![seconds], parts).unwrap_or_default(),
        // The only error of the reference is its noise.
        indirect: own_error.map(|relative_rmse| ModelError {
            relative_rmse,
            ..ModelError::default()
        }),
        ..Entry::default()
    })
}

/// A layer that every frame of the report has.
pub fn values(frame: &Frame, layer: Layer) -> Result<&[f32], Failure> {
    let missing = || format!("internal error: there is no layer {}", layer.name());
    Ok(frame.values(layer).ok_or_else(missing)?)
}
