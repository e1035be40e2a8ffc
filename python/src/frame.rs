//! Frames: their layers as arrays, and their statistics.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use camlux::output::{
    self, ExrCompression, ExrOptions, LayerData, OutputFile, PngView, write_exr_files, write_png,
};
use camlux::scene::{CameraBasis, Intrinsics};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::{check_extension, layers, refuse};
use crate::arrays::view;
use crate::errors::{ArgumentError, LayerError, not_copied, raised};

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

    pub fn frame(&self) -> PyResult<&output::Frame> {
        let gone = || ArgumentError::new_err("the frame is gone");
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

/// What to do instead of copying an image.
pub const SEND_ARRAYS: &str =
    "send its arrays, {name: array.copy() for name, array in frame.items()}, or save it";

/// What frames, images and data sets do alike: a function of `_layers.py`.
pub fn shared<'py>(image: &Bound<'py, PyAny>, function: &str) -> PyResult<Bound<'py, PyAny>> {
    let module = image.py().import("camlux._layers")?;
    module.call_method1(function, (image,))
}

/// The compression of a name.
pub fn compression_named(name: &str) -> PyResult<ExrCompression> {
    ExrCompression::from_name(name).ok_or_else(|| {
        let names = ExrCompression::ALL.map(ExrCompression::name).join(", ");
        ArgumentError::new_err(format!("compression is \"{name}\"; give one of: {names}"))
    })
}

#[pymethods]
impl Frame {
    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let frame = slf.get().frame()?;
        let found = frame.layers.iter().find(|(layer, _)| layer.name() == name);
        let Some((layer, data)) = found else {
            return Err(LayerError::new_err(format!(
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
        Ok(self.frame()?.layers.len())
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let names = self.keys()?.into_pyobject(py)?;
        Ok(names.try_iter()?.into_any())
    }

    /// The names of the layers.
    fn keys(&self) -> PyResult<Vec<&'static str>> {
        let layers = self.frame()?.layers.iter();
        Ok(layers.map(|(layer, _)| layer.name()).collect())
    }

    /// Names and arrays of the layers.
    fn items<'py>(slf: &Bound<'py, Self>) -> PyResult<Vec<(&'static str, Bound<'py, PyAny>)>> {
        let names = slf.get().keys()?.into_iter();
        let items = names.map(|name| Ok((name, Self::__getitem__(slf, name)?)));
        items.collect()
    }

    /// The arrays of the layers.
    fn values<'py>(slf: &Bound<'py, Self>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let items = Self::items(slf)?.into_iter();
        Ok(items.map(|(_, array)| array).collect())
    }

    /// The array of a layer, or the default if the frame has no such layer.
    #[pyo3(signature = (name, default=None, /))]
    fn get<'py>(
        slf: &Bound<'py, Self>,
        name: &str,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        match slf.get().__contains__(name)? {
            true => Self::__getitem__(slf, name).map(Some),
            false => Ok(default),
        }
    }

    /// The unit of each layer: W/sr/m^2, m, J, px, or 1 for a plain number.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let frame = self.frame()?;
        let units = PyDict::new(py);
        for (layer, _) in &frame.layers {
            units.set_item(layer.name(), layer.unit_by(frame.description.tof.as_ref()))?;
        }
        Ok(units)
    }

    /// Width, height.
    #[getter]
    fn resolution_px(&self) -> PyResult<(u32, u32)> {
        Ok(self.frame()?.resolution_px.into())
    }

    /// Its cost, and its estimated errors.
    #[getter]
    fn stats(&self) -> PyResult<FrameStats> {
        Ok(FrameStats(self.frame()?.stats.clone()))
    }

    /// The number in a series, on which the sensor's noise depends: the one that render was given, or the renderer's count.
    #[getter]
    fn frame_index(&self) -> PyResult<u32> {
        Ok(self.frame()?.description.key.index)
    }

    /// Identifies the scene, including its meshes and textures.
    #[getter]
    fn scene_hash(&self) -> PyResult<&str> {
        Ok(&self.frame()?.description.scene_hash)
    }

    /// Camera to world, 4 x 4, for column vectors; camera axes x right, y down, z forward.
    fn camera_to_world<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let camera = &self.frame()?.description.camera;
        let CameraBasis {
            right,
            down,
            forward,
        } = camera.basis();
        let columns = [right, down, forward, camera.position_m];
        let row = |axis: usize| columns.map(|column| column[axis]).to_vec();
        let rows = [row(0), row(1), row(2), vec![0.0, 0.0, 0.0, 1.0]];
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    /// Intrinsics, 3 x 3, pixels; the centre of the first pixel is at (0.5, 0.5).
    fn intrinsics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let Intrinsics { fx, fy, cx, cy } = self.frame()?.description.camera.intrinsics_px();
        let rows = [vec![fx, 0.0, cx], vec![0.0, fy, cy], vec![0.0, 0.0, 1.0]];
        Ok(PyArray2::from_vec2(py, &rows)?)
    }

    /// The surface points that the pixels show, with their colours: camlux.Points. It needs the layers P and radiance.
    fn points<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        shared(slf.as_any(), "points")
    }

    /// For notebooks: the radiance as a PNG file; None without that layer.
    fn _repr_png_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        shared(slf.as_any(), "png")
    }

    /// For notebooks: the picture, and a table of the layers and errors.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        shared(slf.as_any(), "html")
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(not_copied("Frame", SEND_ARRAYS))
    }

    /// Probable mistakes that only the finished frame shows, one sentence each.
    fn warnings(&self) -> PyResult<Vec<String>> {
        Ok(self.frame()?.warnings())
    }

    /// Writes an OpenEXR file, which appears complete or not at all.
    ///
    /// half: stores radiance, direct, indirect and N as 16-bit floats. layers: writes only these. compression: none, rle, zips, zip or piz.
    /// plain: writes a file for each layer, with the channels R, G, B or Y that OpenCV reads: x.depth.exr for x.exr.
    ///
    /// Raises FileError.
    #[pyo3(
        signature = (path, *, layers=None, half=false, compression="none", plain=false, **others),
        text_signature = "($self, path, *, layers=None, half=False, compression=\"none\", plain=False)"
    )]
    #[expect(clippy::too_many_arguments, reason = "Python's keywords")]
    fn save(
        &self,
        py: Python,
        path: PathBuf,
        layers: Option<Bound<'_, PyAny>>,
        half: bool,
        compression: &str,
        plain: bool,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        refuse("Frame.save", others)?;
        let frame = self.frame()?;
        check_extension(&path, "exr")?;
        let options = ExrOptions {
            half,
            layers: layers.map(|value| self::layers(&value)).transpose()?,
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
        let frame = self.frame()?;
        check_extension(&path, "png")?;
        if frame.values(output::Layer::Radiance).is_none() {
            return Err(LayerError::new_err(format!(
                "{}: a preview shows the layer \"radiance\", and the frame has only {}; render it with layers=\"radiance\"",
                path.display(),
                self.keys()?.join(", ")
            )));
        }
        let view = PngView::for_frame(frame);
        let written = py.detach(|| write_png(OutputFile::create(path)?, frame, view));
        Ok(written.map_err(raised)?.white_radiance)
    }

    fn __repr__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        shared(slf.as_any(), "text")
    }
}

/// The cost of a frame, and its estimated error.
#[pyclass(module = "camlux", frozen)]
pub struct FrameStats(output::FrameStats);

#[pymethods]
impl FrameStats {
    /// Name of the device.
    #[getter]
    fn device(&self) -> &str {
        &self.0.device
    }

    /// Name and version of its driver.
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

    /// Time of the least image with an estimate, milliseconds: final gathering makes it whatever max_ms and max_rays are.
    #[getter]
    fn least_ms(&self) -> Option<f64> {
        self.0.least_milliseconds
    }

    /// Number of rays of that image.
    #[getter]
    fn least_rays(&self) -> Option<u64> {
        self.0.least_rays
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
