//! What the errors of a scene are measured against: its path-sampled reference, kept from report to report.

use std::path::Path;
use std::time::Instant;

use camlux::output::{ExrOptions, Frame, Layer, OutputFile, write_exr};
use camlux::reference::{Goal, Reference};
use camlux::{Error, Scene};

use super::error;
use super::picture::{Gallery, Pictures};
use super::results::{Entry, Kind, ModelError, REFERENCE, Seconds, TimePart, Truth};
use super::steps::Steps;
use crate::{Failure, reference, tell};

/// Samples of the first point of the reference's series, in so many independent rounds, whose spread tells the error.
const FIRST_SAMPLES: u32 = 16;
const ROUNDS: u32 = 4;
const LAST_SAMPLES: u32 = 1 << 16;

/// A truth, and how images are compared with it.
pub struct TruthImage {
    frame: Frame,
    /// Pixels that show a surface.
    valid: Vec<bool>,
    /// Pixels on edges, where no image is measured.
    edges: Vec<bool>,
    pub gallery: Gallery,
}

/// What an image is next to the truth. No error where the truth is black.
pub struct Measured {
    pub indirect: Option<ModelError>,
    pub total: Option<ModelError>,
    pub pictures: Pictures,
}

/// Takes the image at `path` where it is the scene's, refines it to the standard error, and writes it.
///
/// # Errors
/// Those of sampling and writing; cancelled after a signal.
pub fn obtain(
    scene: &Scene,
    path: &Path,
    standard_error: f64,
) -> Result<(TruthImage, Truth), Failure> {
    // Before anything that takes time: a place that cannot be written is said at once.
    drop(OutputFile::create(path)?);
    let start = Instant::now();
    let stored = path.exists().then(|| Reference::resume(scene, path));
    let resumed = match stored.transpose() {
        Ok(resumed) => resumed,
        Err(Error::Input { at, problem, .. }) => {
            tell(&format!("camlux: note: {at}: {problem}; it is made anew"));
            None
        }
        Err(error) => return Err(error.into()),
    };
    let was_there = resumed.is_some();
    let goal = Goal::StandardError(standard_error);
    let reference = reference::refine(scene, goal, resumed, |reference| {
        reference::save(reference, path)
    })?;
    let image = TruthImage::new(reference.frame())?;
    let truth = Truth {
        file: path.to_string_lossy().into_owned(),
        scene_hash: image.frame.description.scene_hash.clone(),
        samples_per_pixel: reference.samples_per_pixel(),
        edge_pixels: image.edge_pixels(),
        edge_share: image.edge_pixels() as f64 / image.surface_pixels().max(1) as f64,
        was_there,
        noise_floor: reference.relative_standard_error(),
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok((image, truth))
}

impl TruthImage {
    fn new(frame: Frame) -> Result<TruthImage, Failure> {
        let are_set = |layer: Layer| -> Vec<bool> {
            let ids = frame.ids(layer).unwrap_or_default();
            ids.iter().map(|&id| id > 0).collect()
        };
        let (valid, edges) = (are_set(Layer::InstanceId), are_set(Layer::Edge));
        let gallery = Gallery::new(
            frame.resolution_px,
            values(&frame, Layer::Indirect)?,
            &valid,
            &edges,
        );
        Ok(TruthImage {
            frame,
            valid,
            edges,
            gallery,
        })
    }

    fn surface_pixels(&self) -> usize {
        self.valid.iter().filter(|&&valid| valid).count()
    }

    /// Those among the pixels with a surface.
    fn edge_pixels(&self) -> usize {
        let pairs = self.valid.iter().zip(&self.edges);
        pairs.filter(|&(&valid, &edge)| valid && edge).count()
    }

    /// Measures an image of the truth's size against it.
    ///
    /// # Errors
    /// Where the image has another size.
    pub fn measure(&self, indirect: &[f32], total: &[f32]) -> Result<Measured, Failure> {
        let error = |image, layer| {
            let truth = values(&self.frame, layer)?;
            let noise = values(&self.frame, Layer::StandardError)?;
            error::model_error(image, truth, noise, &self.valid, &self.edges)
        };
        Ok(Measured {
            indirect: error(indirect, Layer::Indirect)?,
            total: error(total, Layer::Radiance)?,
            pictures: self.gallery.of_image(indirect)?,
        })
    }
}

/// The reference as a contender: its own error, from its own spread, against its time, at doubled numbers of samples until
/// one takes longer than `longest_s`.
///
/// # Errors
/// Those of sampling and writing; cancelled after a signal.
pub fn series(
    name: &str,
    scene: &Scene,
    scratch: &Path,
    longest_s: f64,
    steps: &Steps,
) -> Result<Vec<Entry>, Failure> {
    let mut entries = Vec::new();
    let mut samples = FIRST_SAMPLES;
    while samples <= LAST_SAMPLES {
        steps.begin(&format!("{name}: reference, {samples} samples"))?;
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
        let parts = parts.map(|(name, seconds)| TimePart {
            name: name.into(),
            seconds,
        });
        let Some(times) = Seconds::from_runs(vec![seconds], parts.into()) else {
            break;
        };
        let own = reference.relative_standard_error();
        entries.push(Entry {
            kind: Kind::Reference,
            series: REFERENCE.into(),
            label: format!("{samples} spp"),
            description: None,
            seconds: times,
            indirect: own.map(ModelError::from_standard_error),
            total: None,
            engine: None,
            is_on_engine_front: false,
            is_on_front: false,
            pictures: None,
        });
        if seconds > longest_s {
            break;
        }
        samples *= 2;
    }
    Ok(entries)
}

fn values(frame: &Frame, layer: Layer) -> Result<&[f32], Failure> {
    let missing = || format!("internal error: the truth has no layer {}", layer.name());
    Ok(frame.values(layer).ok_or_else(missing)?)
}
