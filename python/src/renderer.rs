//! Rendering.

use std::sync::{Mutex, PoisonError};

use camlux::RenderOptions;
use camlux::scene::IndirectLight;
use pyo3::prelude::*;

use crate::device::Device;
use crate::errors::{Watch, raised, warn};
use crate::frame::{Frame, Returned, layers_named};
use crate::scene::scene_from;

/// The progress of a render: 0 to 1, and the pass that runs next; 1 and "done" at the end.
#[pyclass(module = "camlux", frozen, get_all)]
pub struct Progress {
    fraction: f32,
    pass_name: &'static str,
}

/// Renders scenes. It keeps data on the device that the next frame may need: one renderer for all frames is fastest.
///
/// A renderer does one render at a time; other calls wait. Threads that render in parallel each need their own renderer; they can share one
/// device.
#[pyclass(module = "camlux", frozen)]
pub struct Renderer {
    renderer: Mutex<camlux::Renderer>,
    returned: Returned,
    device: Py<Device>,
}

#[pymethods]
impl Renderer {
    /// device: None opens the best one.
    #[new]
    #[pyo3(signature = (device=None))]
    fn new(py: Python, device: Option<Py<Device>>) -> PyResult<Renderer> {
        let device = match device {
            Some(device) => device,
            None => Py::new(py, Device::new(py, None, false)?)?,
        };
        Ok(Renderer {
            renderer: Mutex::new(camlux::Renderer::new(&device.get().0).map_err(raised)?),
            returned: Returned::default(),
            device,
        })
    }

    #[getter]
    fn device(&self, py: Python) -> Py<Device> {
        self.device.clone_ref(py)
    }

    /// Renders a frame, without the GIL. Control-C ends it.
    ///
    /// target_error: indirect light by final gathering to this relRMSE, whatever the scene requests. seed: another number gives other
    /// samples. frame_index: the number in a series; each has other sensor noise. layers: copies only these from the device, which is
    /// faster; None: all. progress: called from time to time with a Progress; if it returns False, Cancelled is raised.
    ///
    /// Raises SceneError for a scene that cannot be rendered, DeviceError for one that the device cannot hold. Shows a CamluxWarning for a
    /// frame that is probably a mistake, such as a black one.
    #[allow(clippy::too_many_arguments, reason = "Python's have names")]
    #[pyo3(signature = (scene, *, target_error=None, seed=0, frame_index=0, layers=None, progress=None))]
    fn render(
        &self,
        py: Python,
        scene: &Bound<'_, PyAny>,
        target_error: Option<f64>,
        seed: u32,
        frame_index: u32,
        layers: Option<Vec<String>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Frame> {
        let layers = layers.map(layers_named).transpose()?;
        let mut scene = scene_from(scene)?;
        if let Some(requested) = target_error {
            match &mut scene.indirect {
                Some(IndirectLight::FinalGather { target_error, .. }) => *target_error = requested,
                other => *other = Some(IndirectLight::final_gather(requested)),
            }
        }
        let mut watch = Watch::new(progress);
        let rendered = py.detach(|| {
            let mut renderer = self.renderer.lock().unwrap_or_else(PoisonError::into_inner);
            let returned = self.returned.lock().ok().and_then(|mut frame| frame.take());
            if let Some(frame) = returned {
                renderer.return_buffers(frame);
            }
            let mut ask = |progress: camlux::Progress| {
                watch.goes_on(|| {
                    (Progress {
                        fraction: progress.fraction,
                        pass_name: progress.pass,
                    },)
                })
            };
            let frame = renderer.render(
                &scene,
                &mut RenderOptions {
                    progress: Some(&mut ask),
                    seed,
                    frame_index,
                    layers: layers.as_deref(),
                    ..RenderOptions::default()
                },
            )?;
            let warnings = frame.warnings();
            Ok((frame, warnings))
        });
        let (frame, warnings) = watch.outcome(rendered)?;
        let frame = Frame::new(frame, &scene, Some(self.returned.clone()));
        warn(py, &warnings)?;
        Ok(frame)
    }
}
