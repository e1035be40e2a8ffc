//! OpenEXR images, and their comparison.

use std::path::PathBuf;

use camlux::metrics::{self, CorrectedRmse, Pixels};
use camlux::output::{LayeredImage, srgb_byte, white_radiance};
use numpy::{
    IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArray1, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::raised;
use crate::layers::Layers;

/// An OpenEXR image: a mapping from the names of its layers to arrays, (height, width) or (height, width, channels).
///
/// Ids are uint32, all others float32. Arrays read the memory of the image and keep it alive. They are read-only: copy them to change them.
#[pyclass(module = "camlux", frozen, extends = Layers)]
pub struct Image;

#[pymethods]
impl Image {
    /// The texts and numbers of the header, as text by name; docs/output.md lists those that camlux writes.
    #[getter]
    fn attributes<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyDict>> {
        let attributes = PyDict::new(slf.py());
        let image = slf.as_super().get().image();
        for (name, value) in image.into_iter().flat_map(LayeredImage::attributes) {
            attributes.set_item(name, value)?;
        }
        Ok(attributes)
    }
}

/// Reads an OpenEXR file of camlux or of another program.
///
/// Raises FileError if it cannot be read.
#[pyfunction]
pub fn read_exr(py: Python, path: PathBuf) -> PyResult<Py<Image>> {
    let image = py.detach(|| LayeredImage::read(&path)).map_err(raised)?;
    Py::new(py, (Image, Layers::of_image(image)))
}

/// For pictures: a radiance, (height, width, 3), as the preview shows it, sRGB.
#[pyfunction]
pub fn preview<'py>(
    py: Python<'py>,
    radiance: PyReadonlyArrayDyn<'py, f32>,
) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
    let values = radiance.as_slice()?;
    let white = white_radiance(values);
    let bytes = values.iter().map(|&value| srgb_byte(value / white));
    let bytes = bytes.collect::<Vec<u8>>().into_pyarray(py);
    bytes.reshape(radiance.shape())
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
    /// Mean of the image's values.
    image_mean: f64,
    /// Mean of the reference's values.
    reference_mean: f64,
    /// Number of values that are compared.
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
