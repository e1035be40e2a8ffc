//! The true bounces, sampled by paths on the CPU.

use std::ops::ControlFlow;

use camlux::reference::{Goal, Reference};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::{count, number, refuse};
use crate::errors::{ArgumentError, Watch};
use crate::frame::Frame;
use crate::process;
use crate::scene::scene_from;

/// Path-traces the true bounces of a scene on the CPU to the requested error, without the GIL. Control-C ends it.
///
/// stderr: standard error of the indirect light divided by its root mean square; 0.01 is 1 %. samples_per_pixel: a number of samples
/// instead.
/// progress: called from time to time with a number from 0 to 1, which is 1 at the end; if it returns False, Cancelled is raised. True shows a
/// bar, for which tqdm must be installed.
///
/// The frame has the layers `stderr`, the standard error of each pixel, and `edge`, 1 where rounding decides which surface a pixel shows.
#[pyfunction]
#[pyo3(
    signature = (scene, *, stderr=None, samples_per_pixel=None, progress=None, **others),
    text_signature = "(scene, *, stderr=None, samples_per_pixel=None, progress=None)"
)]
pub fn reference(
    py: Python,
    scene: &Bound<'_, PyAny>,
    stderr: Option<Bound<'_, PyAny>>,
    samples_per_pixel: Option<Bound<'_, PyAny>>,
    progress: Option<Bound<'_, PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Py<Frame>> {
    refuse("reference", others)?;
    process::begin()?;
    let stderr = stderr.map(|value| number(&value, "stderr", "a number, such as 0.01 for 1 %"));
    let stderr = stderr.transpose()?;
    let samples_per_pixel = samples_per_pixel.map(|value| count(&value, "samples_per_pixel"));
    let samples_per_pixel = samples_per_pixel.transpose()?;
    let goal = match (stderr, samples_per_pixel) {
        (Some(share), None) if share > 0.0 && share < 1.0 => Goal::StandardError(share),
        (None, Some(samples)) if samples > 0 => Goal::SamplesPerPixel(samples),
        (Some(_), None) | (None, Some(_)) => {
            return Err(ArgumentError::new_err(
                "give a stderr between 0 and 1, such as 0.01, or samples_per_pixel above 0",
            ));
        }
        _ => {
            return Err(ArgumentError::new_err(
                "give one of stderr and samples_per_pixel, such as stderr=0.01",
            ));
        }
    };
    let scene = scene_from(scene)?;
    let mut watch = Watch::new(py, progress)?;
    let found = py.detach(|| {
        let mut reference = Reference::start(&scene, goal, &mut |_| watch.goes_on(|| (0.0,)))?;
        while !reference.meets(goal) {
            let now = reference.progress_to(goal);
            let then = reference.progress_after_round(goal);
            reference.add_round(&mut |fraction| {
                watch.goes_on(|| (now + (then - now) * f64::from(fraction),))
            })?;
        }
        match watch.goes_on(|| (1.0,)) {
            ControlFlow::Continue(()) => Ok(reference.frame()),
            ControlFlow::Break(()) => Err(camlux::Error::Cancelled),
        }
    });
    Frame::create(py, watch.outcome(py, "", found)?, &scene, None)
}
