//! OpenEXR images, and their comparison.

use std::path::PathBuf;

use camlux::metrics::{self, CorrectedRmse, Pixels};
use camlux::output::LayeredImage;
use numpy::{PyReadonlyArray1, PyReadonlyArrayDyn};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::view;
use crate::errors::raised;

/// An OpenEXR image: a mapping from the names of its layers to float32 arrays, (height, width) or (height, width, channels).
///
/// Arrays read the memory of the image and keep it alive. They are read-only: copy them to change them.
#[pyclass(module = "camlux", frozen, mapping)]
pub struct Image(LayeredImage);

#[pymethods]
impl Image {
    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let image = &slf.get().0;
        let Some(layer) = image.layer(name) else {
            return Err(PyKeyError::new_err(format!(
                "the image has no layer \"{name}\"; it has {}",
                slf.get().keys().join(", ")
            )));
        };
        let [width, height] = image.resolution_px().map(|px| px as usize);
        let shape = match layer.channel_names.len() {
            1 => vec![height, width],
            channels => vec![height, width, channels],
        };
        Ok(view(&layer.values, &shape, slf.clone().into_any())?.into_any())
    }

    fn __contains__(&self, name: &str) -> bool {
        self.0.layer(name).is_some()
    }

    fn __len__(&self) -> usize {
        self.0.layers().len()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let names = self.keys().into_pyobject(py)?;
        Ok(names.try_iter()?.into_any())
    }

    /// The names of the layers.
    fn keys(&self) -> Vec<&str> {
        let layers = self.0.layers().iter();
        layers.map(|layer| layer.name.as_str()).collect()
    }

    /// Width, height.
    #[getter]
    fn resolution_px(&self) -> (u32, u32) {
        self.0.resolution_px().into()
    }

    /// The texts and numbers of the header, as text by name; docs/output.md lists those that camlux writes.
    #[getter]
    fn attributes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let attributes = PyDict::new(py);
        for (name, value) in self.0.attributes() {
            attributes.set_item(name, value)?;
        }
        Ok(attributes)
    }

    fn __repr__(&self) -> String {
        let [width, height] = self.0.resolution_px();
        format!(
            "<camlux.Image {width} x {height}: {}>",
            self.keys().join(", ")
        )
    }
}

/// Reads an OpenEXR file of camlux or of another program.
///
/// Raises FileError if it cannot be read.
#[pyfunction]
pub fn read_exr(py: Python, path: PathBuf) -> PyResult<Image> {
    let image = py.detach(|| LayeredImage::read(&path));
    Ok(Image(image.map_err(raised)?))
}

/// An image compared with a reference. Errors are relative to the reference, 1 is 100 %; they are None if the reference is dark.
#[pyclass(module = "camlux", frozen, get_all)]
pub struct Comparison {
    /// sqrt(Σ(x − t)²/Σt²), including the noise of the reference.
    rel_rmse: Option<f64>,
    /// The relRMSE without the noise; None if no standard error is given, or if the noise hides the error.
    rel_rmse_without_noise: Option<f64>,
    /// The probable upper bound of the error, if the noise hides it.
    rel_rmse_below: Option<f64>,
    /// The relRMSE that an image without error would show, from the noise alone.
    noise_floor: Option<f64>,
    /// Σ(x − t)/Σ|t|
    bias: Option<f64>,
    /// Σ|x − t|/Σ|t|
    mean_absolute: Option<f64>,
    /// The 99th percentile of |x − t|/(|t| + 0.01·mean|t|).
    percentile_99: Option<f64>,
    image_mean: f64,
    reference_mean: f64,
    value_count: usize,
    /// Number of pixels that are left out because they are on an edge.
    edge_pixels: usize,
    /// Number of values that are left out because the image's value is not finite.
    non_finite_image: usize,
}

#[pymethods]
impl Comparison {
    fn __repr__(&self) -> String {
        let percent = |error: Option<f64>| match error {
            Some(error) => format!("{:.3} %", 100.0 * error),
            None => "unknown".into(),
        };
        format!(
            "<camlux.Comparison relRMSE {}, without noise {}>",
            percent(self.rel_rmse),
            percent(self.rel_rmse_without_noise)
        )
    }
}

/// For `camlux.compare`: arrays of one shape, (height, width) or (height, width, channels), and flat arrays with one flag per pixel.
#[pyfunction]
#[pyo3(signature = (image, reference, channels, valid, edges=None, standard_error=None))]
pub fn compare_arrays(
    image: PyReadonlyArrayDyn<f32>,
    reference: PyReadonlyArrayDyn<f32>,
    channels: usize,
    valid: PyReadonlyArray1<bool>,
    edges: Option<PyReadonlyArray1<bool>>,
    standard_error: Option<PyReadonlyArrayDyn<f32>>,
) -> PyResult<Comparison> {
    let found = metrics::Comparison::new(&Pixels {
        image: image.as_slice()?,
        reference: reference.as_slice()?,
        image_standard_error: None,
        reference_standard_error: standard_error.as_ref().map(|s| s.as_slice()).transpose()?,
        valid: valid.as_slice()?,
        edges: edges.as_ref().map(|e| e.as_slice()).transpose()?,
        channels,
    });
    let found = found.map_err(raised)?;
    let errors = found.errors;
    let noise = found.noise.map(|noise| noise.rmse);
    Ok(Comparison {
        rel_rmse: errors.map(|e| e.rmse),
        rel_rmse_without_noise: match noise {
            Some(CorrectedRmse::Estimate { value, .. }) => Some(value),
            _ => None,
        },
        rel_rmse_below: match noise {
            Some(CorrectedRmse::Below(bound)) => Some(bound),
            _ => None,
        },
        noise_floor: found.noise.map(|noise| noise.floor),
        bias: errors.map(|e| e.bias),
        mean_absolute: errors.map(|e| e.mean_absolute),
        percentile_99: errors.map(|e| e.percentile_99),
        image_mean: found.image_mean,
        reference_mean: found.reference_mean,
        value_count: found.value_count,
        edge_pixels: found.edge_pixels,
        non_finite_image: found.non_finite_image,
    })
}
