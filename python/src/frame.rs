//! Frames: their layers as arrays, and their statistics.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use camlux::output::{
    self, ExrCompression, ExrOptions, Layer, LayerData, OutputFile, PngView, write_exr_files,
    write_png,
};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::view;
use crate::errors::raised;

/// Where a frame that is no longer used leaves its buffers for the next one.
pub type Returned = Arc<Mutex<Option<output::Frame>>>;

/// A rendered frame, or a reference: a mapping from the names of its layers to arrays.
///
/// frame["radiance"] is (height, width, 3), float32, W/sr/m². A layer of one value per pixel, such as frame["depth"], is (height, width).
/// Ids are uint32. Arrays read the memory of the frame and keep it alive. They are read-only: copy them to change them.
#[pyclass(module = "camlux", frozen, mapping)]
pub struct Frame {
    /// Present until it is dropped.
    frame: Option<output::Frame>,
    returned: Option<Returned>,
    /// Names for the ids of `id.instance`, from 1.
    #[pyo3(get)]
    mesh_names: Vec<String>,
    /// Names for the ids of `id.material`, from 1.
    #[pyo3(get)]
    material_names: Vec<String>,
}

impl Frame {
    pub fn new(frame: output::Frame, scene: &camlux::Scene, returned: Option<Returned>) -> Self {
        Frame {
            frame: Some(frame),
            returned,
            mesh_names: scene.meshes.iter().map(|mesh| mesh.name.clone()).collect(),
            material_names: scene.materials.iter().map(|m| m.name.clone()).collect(),
        }
    }

    pub fn get(&self) -> PyResult<&output::Frame> {
        let gone = || PyValueError::new_err("the frame is gone");
        self.frame.as_ref().ok_or_else(gone)
    }
}

impl Drop for Frame {
    fn drop(&mut self) {
        if let Some(returned) = &self.returned
            && let Ok(mut returned) = returned.lock()
        {
            *returned = self.frame.take();
        }
    }
}

/// The layer of a name.
pub fn layer_named(name: &str) -> PyResult<Layer> {
    Layer::from_name(name).ok_or_else(|| {
        PyValueError::new_err(format!(
            "there is no layer \"{name}\"; docs/output.md lists them"
        ))
    })
}

/// The compression of a name.
pub fn compression_named(name: &str) -> PyResult<ExrCompression> {
    ExrCompression::from_name(name).ok_or_else(|| {
        let names = ExrCompression::ALL.map(ExrCompression::name).join(", ");
        PyValueError::new_err(format!("compression is \"{name}\"; give one of: {names}"))
    })
}

/// The layers of these names.
pub fn layers_named(names: Vec<String>) -> PyResult<Vec<Layer>> {
    names.iter().map(|name| layer_named(name)).collect()
}

#[pymethods]
impl Frame {
    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let frame = slf.get().get()?;
        let found = frame.layers.iter().find(|(layer, _)| layer.name() == name);
        let Some((layer, data)) = found else {
            return Err(PyKeyError::new_err(format!(
                "the frame has no layer \"{name}\"; it has {}",
                slf.get().keys()?.join(", ")
            )));
        };
        let [width, height] = frame.resolution_px.map(|px| px as usize);
        let shape = match layer.channel_names().len() {
            1 => vec![height, width],
            channels => vec![height, width, channels],
        };
        let owner = slf.clone().into_any();
        Ok(match data {
            LayerData::Float(values) => view(values, &shape, owner)?.into_any(),
            LayerData::Id(ids) => view(ids, &shape, owner)?.into_any(),
        })
    }

    fn __contains__(&self, name: &str) -> PyResult<bool> {
        Ok(self.keys()?.contains(&name))
    }

    fn __len__(&self) -> PyResult<usize> {
        Ok(self.get()?.layers.len())
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let names = self.keys()?.into_pyobject(py)?;
        Ok(names.try_iter()?.into_any())
    }

    /// The names of the layers.
    fn keys(&self) -> PyResult<Vec<&'static str>> {
        let layers = self.get()?.layers.iter();
        Ok(layers.map(|(layer, _)| layer.name()).collect())
    }

    /// Names and arrays of the layers.
    fn items<'py>(slf: &Bound<'py, Self>) -> PyResult<Vec<(&'static str, Bound<'py, PyAny>)>> {
        let names = slf.get().keys()?.into_iter();
        let items = names.map(|name| Ok((name, Self::__getitem__(slf, name)?)));
        items.collect()
    }

    /// The unit of each layer: W/sr/m^2, m, J, px, or 1 for a plain number.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let frame = self.get()?;
        let units = PyDict::new(py);
        for (layer, _) in &frame.layers {
            units.set_item(layer.name(), layer.unit_by(frame.description.tof.as_ref()))?;
        }
        Ok(units)
    }

    /// Width, height.
    #[getter]
    fn resolution_px(&self) -> PyResult<(u32, u32)> {
        Ok(self.get()?.resolution_px.into())
    }

    #[getter]
    fn stats(&self) -> PyResult<FrameStats> {
        Ok(FrameStats(self.get()?.stats.clone()))
    }

    /// Identifies the scene, including its meshes and textures.
    #[getter]
    fn scene_hash(&self) -> PyResult<&str> {
        Ok(&self.get()?.description.scene_hash)
    }

    /// Probable mistakes that only the finished frame shows, one sentence each.
    fn warnings(&self) -> PyResult<Vec<String>> {
        Ok(self.get()?.warnings())
    }

    /// Writes an OpenEXR file, which appears complete or not at all.
    ///
    /// half: stores radiance, direct, indirect and N as 16-bit floats. layers: writes only these. compression: none, rle, zips, zip or piz.
    /// plain: writes a file for each layer, with the channels R, G, B or Y that OpenCV reads: x.depth.exr for x.exr.
    ///
    /// Raises FileError.
    #[pyo3(signature = (path, *, layers=None, half=false, compression="none", plain=false))]
    fn save(
        &self,
        py: Python,
        path: PathBuf,
        layers: Option<Vec<String>>,
        half: bool,
        compression: &str,
        plain: bool,
    ) -> PyResult<()> {
        let frame = self.get()?;
        let options = ExrOptions {
            half,
            layers: layers.map(layers_named).transpose()?,
            compression: compression_named(compression)?,
            plain,
            ..ExrOptions::default()
        };
        let written = py.detach(|| write_exr_files(&path, frame, &options));
        written.map_err(raised)?;
        Ok(())
    }

    /// Writes a preview of the light: direct, indirect and total side by side if there is indirect light. Returns the radiance that is
    /// shown as white, W/sr/m².
    ///
    /// Raises FileError.
    fn save_png(&self, py: Python, path: PathBuf) -> PyResult<f32> {
        let frame = self.get()?;
        let view = PngView::for_frame(frame);
        let written = py.detach(|| write_png(OutputFile::create(path)?, frame, view));
        Ok(written.map_err(raised)?.white_radiance)
    }

    fn __repr__(&self) -> PyResult<String> {
        let [width, height] = self.get()?.resolution_px;
        let layers = self.keys()?.join(", ");
        Ok(format!("<camlux.Frame {width} x {height}: {layers}>"))
    }
}

/// The cost of a frame, and its estimated error.
#[pyclass(module = "camlux", frozen)]
pub struct FrameStats(output::FrameStats);

#[pymethods]
impl FrameStats {
    #[getter]
    fn device(&self) -> &str {
        &self.0.device
    }

    #[getter]
    fn driver(&self) -> &str {
        &self.0.driver
    }

    /// GPU time of each pass, ms.
    #[getter]
    fn passes_ms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let passes = PyDict::new(py);
        for pass in &self.0.passes {
            passes.set_item(pass.name, pass.milliseconds)?;
        }
        Ok(passes)
    }

    /// Time from the call of the renderer to its return, ms.
    #[getter]
    fn wall_ms(&self) -> f64 {
        self.0.wall_milliseconds
    }

    /// Number of virtual point lights with flux, over all lights.
    #[getter]
    fn vpl_count(&self) -> u64 {
        self.0.vpl_count
    }

    /// Number of rays that were cast for the indirect light.
    #[getter]
    fn ray_count(&self) -> u64 {
        self.0.ray_count
    }

    /// Number of pairs of pixel and VPL that the gather pass summed.
    #[getter]
    fn pixel_vpl_pairs(&self) -> u64 {
        self.0.pixel_vpl_pairs
    }

    /// Estimated relRMSE of the indirect light against the true bounce; None for sums over VPLs, and if there is no indirect light.
    #[getter]
    fn estimated_error(&self) -> Option<f64> {
        self.0.estimated_error
    }

    /// Upper bound of that error with a confidence of 95 %.
    #[getter]
    fn estimated_error_upper(&self) -> Option<f64> {
        self.0.estimated_error_upper
    }

    /// Estimated relRMSE against the sum over VPLs at every pixel; None unless an interpolation error was requested.
    #[getter]
    fn estimated_interpolation_error(&self) -> Option<f64> {
        self.0.estimated_interpolation_error
    }

    /// Estimated relRMSE of the direct light of area lights; None if there are none.
    #[getter]
    fn estimated_area_light_error(&self) -> Option<f64> {
        self.0.estimated_area_light_error
    }

    /// Why final gathering stopped: target-met, budget-spent or samples-exhausted.
    #[getter]
    fn stop(&self) -> Option<&'static str> {
        self.0.stop.map(output::StopReason::name)
    }

    fn __repr__(&self) -> String {
        let (wall_ms, device) = (self.0.wall_milliseconds, &self.0.device);
        format!("<camlux.FrameStats {wall_ms:.1} ms on {device:?}>")
    }
}
