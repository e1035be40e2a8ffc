//! Frames: their layers as arrays, and their statistics.

use std::path::PathBuf;

use camlux::output::{
    self, ExrCompression, ExrOptions, OutputFile, PassTime, PngView, write_exr_files, write_png,
};
use camlux::scene::Intrinsics;
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::{check_extension, layers, refuse};
use crate::errors::{ArgumentError, LayerError, UnsupportedError, raised};
use crate::layers::{Layers, Returned};

/// Times by their names, ms.
fn by_name<'py>(times: &[PassTime], py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for time in times {
        dict.set_item(time.name, time.milliseconds)?;
    }
    Ok(dict)
}

/// A rendered frame, or a reference: a mapping from the names of its layers to arrays.
///
/// frame["radiance"] is (height, width, 3), float32, W/sr/m². A layer of one value per pixel, such as frame["depth"], is (height, width).
/// Ids are uint32. Arrays read the memory of the frame and keep it alive. They are read-only: copy them to change them.
#[pyclass(module = "camlux", frozen, extends = Layers)]
pub struct Frame {
    /// Names for the ids of `id.instance`, from 1.
    #[pyo3(get)]
    mesh_names: Vec<String>,
    /// Names for the ids of `id.material`, from 1.
    #[pyo3(get)]
    material_names: Vec<String>,
}

impl Frame {
    /// `returned`: where it leaves its buffers in the end.
    pub fn create(
        py: Python,
        frame: output::Frame,
        scene: &camlux::Scene,
        returned: Option<Returned>,
    ) -> PyResult<Py<Frame>> {
        let names = Frame {
            mesh_names: scene.meshes.iter().map(|mesh| mesh.name.clone()).collect(),
            material_names: scene.materials.iter().map(|m| m.name.clone()).collect(),
        };
        Py::new(py, (names, Layers::of_frame(frame, returned)))
    }
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
    /// Its cost, and its estimated errors.
    #[getter]
    fn stats(slf: &Bound<'_, Self>) -> PyResult<FrameStats> {
        Ok(FrameStats(slf.as_super().get().frame()?.stats.clone()))
    }

    /// The number in a series, on which the sensor's noise depends: the one that render was given, or the renderer's count.
    #[getter]
    fn frame_index(slf: &Bound<'_, Self>) -> PyResult<u32> {
        Ok(slf.as_super().get().frame()?.description.key.index)
    }

    /// Identifies the scene, including its meshes and textures.
    #[getter]
    fn scene_hash(slf: &Bound<'_, Self>) -> PyResult<String> {
        Ok(slf.as_super().get().frame()?.description.scene_hash.clone())
    }

    /// Camera to world, 4 x 4, for column vectors; camera axes x right, y down, z forward.
    fn camera_to_world<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let to_world = slf.as_super().get().frame()?.description.camera.to_world();
        let rows: [[f64; 4]; 4] = to_world.transpose().to_cols_array_2d();
        Ok(PyArray2::from_owned_array(
            slf.py(),
            numpy::ndarray::arr2(&rows),
        ))
    }

    /// Intrinsics, 3 x 3, pixels; the centre of the first pixel is at (0.5, 0.5).
    ///
    /// Raises UnsupportedError for an orthographic camera, which has none.
    fn intrinsics<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let camera = &slf.as_super().get().frame()?.description.camera;
        if camera.is_orthographic() {
            return Err(UnsupportedError::new_err(
                "an orthographic camera has no intrinsics: its pixels are height_m / height_px apart; use the layer P or P_camera",
            ));
        }
        let Intrinsics {
            fx,
            fy,
            cx,
            cy,
            skew,
        } = camera.intrinsics_px();
        let rows = [vec![fx, skew, cx], vec![0.0, fy, cy], vec![0.0, 0.0, 1.0]];
        Ok(PyArray2::from_vec2(slf.py(), &rows)?)
    }

    /// Probable mistakes that only the finished frame shows, one sentence each.
    fn warnings(slf: &Bound<'_, Self>) -> PyResult<Vec<String>> {
        Ok(slf.as_super().get().frame()?.warnings())
    }

    /// Writes an OpenEXR file, which appears complete or not at all.
    ///
    /// half: stores radiance, direct, indirect and N as 16-bit floats. layers: writes only these. compression: none, rle, zips, zip or piz.
    /// plain: writes a file for each layer, with the channels R, G, B or Y that OpenCV reads: x.depth.exr for x.exr. multipart: writes
    /// one file with a part for each layer, with its name, and channels without it: R of the part direct; not together with plain.
    ///
    /// Raises FileError.
    #[allow(clippy::too_many_arguments, reason = "Python's have names")]
    #[pyo3(
        signature = (path, *, layers=None, half=false, compression="none", plain=false, multipart=false, **others),
        text_signature = "($self, path, *, layers=None, half=False, compression=\"none\", plain=False, multipart=False)"
    )]
    fn save(
        slf: &Bound<'_, Self>,
        path: PathBuf,
        layers: Option<Bound<'_, PyAny>>,
        half: bool,
        compression: &str,
        plain: bool,
        multipart: bool,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        refuse("Frame.save", others)?;
        let frame = slf.as_super().get().frame()?;
        check_extension(&path, "exr")?;
        let options = ExrOptions {
            half,
            layers: layers.map(|value| self::layers(&value)).transpose()?,
            compression: compression_named(compression)?,
            plain,
            multipart,
            ..ExrOptions::default()
        };
        let written = slf.py().detach(|| write_exr_files(&path, frame, &options));
        written.map_err(raised)?;
        Ok(())
    }

    /// Writes a preview of the light: direct, indirect and total side by side if there is indirect light. Returns the radiance that is
    /// shown as white, W/sr/m².
    ///
    /// Raises FileError.
    fn save_png(slf: &Bound<'_, Self>, path: PathBuf) -> PyResult<f32> {
        let frame = slf.as_super().get().frame()?;
        check_extension(&path, "png")?;
        if frame.values(output::Layer::Radiance).is_none() {
            return Err(LayerError::new_err(format!(
                "{}: a preview shows the layer \"radiance\", and the frame has only {}; render it with layers=\"radiance\"",
                path.display(),
                slf.as_super().get().names()?.join(", ")
            )));
        }
        let view = PngView::for_frame(frame);
        let written = slf
            .py()
            .detach(|| write_png(OutputFile::create(path)?, frame, view));
        Ok(written.map_err(raised)?.white_radiance)
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
        by_name(&self.0.passes, py)
    }

    /// What the host did meanwhile, by step, without waiting for the device and without compiling, ms.
    #[getter]
    fn host_ms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        by_name(&self.0.host_steps, py)
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

    /// Estimated range error that the error of the bounce causes, rms over pixels, of the worst frequency, mm; None unless a
    /// target_range_error_mm was requested.
    #[getter]
    fn estimated_range_error_mm(&self) -> Option<f64> {
        self.0.estimated_range_error_mm
    }

    /// Upper bound of that error with a confidence of 95 %.
    #[getter]
    fn estimated_range_error_upper_mm(&self) -> Option<f64> {
        self.0.estimated_range_error_upper_mm
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

    /// Why final gathering stopped: target-met, budget-spent, samples-exhausted or cancelled.
    #[getter]
    fn stop(&self) -> Option<&'static str> {
        self.0.stop.map(output::StopReason::name)
    }

    fn __repr__(&self) -> String {
        let (wall_ms, device) = (self.0.wall_milliseconds, &self.0.device);
        format!("<camlux.FrameStats {wall_ms:.1} ms on {device:?}>")
    }
}
