//! What the errors of a scene are measured against: its path-sampled reference, kept from report to report.

use std::path::{Path, PathBuf};
use std::time::Instant;

use camlux::output::{ExrOptions, Frame, Layer, LayeredImage, OutputFile, write_exr};
use camlux::reference::{Goal, Reference};
use camlux::{Error, Scene};

use super::error::{self, ErrorScale};
use super::picture::Pictures;
use super::results::{Entry, Kind, ModelError, Part, REFERENCE, Seconds, Truth};
use super::steps::Steps;
use crate::{Failure, reference, tell};

/// A truth and what is taken from it again and again.
pub struct TruthImage {
    frame: Frame,
    /// Pixels that show a surface.
    valid: Vec<bool>,
    scale: ErrorScale,
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
    let start = Instant::now();
    let stored = path.exists().then(|| {
        let image = LayeredImage::read(path)?;
        Reference::resume(scene, &image)
    });
    let resumed = match stored.transpose() {
        Ok(resumed) => resumed,
        Err(problem @ Error::Input { .. }) => {
            tell(&format!("camlux: note: {problem}; it is made anew"));
            None
        }
        Err(problem) => return Err(problem.into()),
    };
    let was_there = resumed.is_some();
    let goal = Goal::StandardError(standard_error);
    let reference = reference::refine(scene, goal, resumed, |reference| {
        reference::save(reference, path)
    })?;
    let frame = reference.frame();
    let truth = Truth {
        file: path.to_string_lossy().into_owned(),
        scene_hash: frame.description.scene_hash.clone(),
        samples_per_pixel: reference.samples_per_pixel(),
        was_there,
        noise_floor: reference.relative_standard_error(),
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok((TruthImage::new(frame)?, truth))
}
