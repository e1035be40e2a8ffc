//! Rendering.

use std::sync::{Mutex, PoisonError};

use camlux::output::{self, Layer};
use camlux::scene::{IndirectLight, LensLights, Material, Mesh, Shared};
use camlux::{RenderOptions, Scene};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::{count, layers, number, refuse};
use crate::device::Device;
use crate::errors::{Error, Watch, not_copied, raised, warn};
use crate::frame::Frame;
use crate::layers::Returned;
use crate::process::OfProcess;
use crate::scene::{cameras_from, scene_from};

/// The progress of a render: 0 to 1, and the pass that runs next; 1 and "done" at the end.
#[pyclass(module = "camlux", frozen, get_all)]
pub struct Progress {
    /// 0 to 1.
    fraction: f32,
    /// The pass that runs next.
    pass_name: &'static str,
}

#[pymethods]
impl Progress {
    fn __repr__(&self) -> String {
        let percent = 100.0 * self.fraction;
        format!("<camlux.Progress {percent:.1} %, {}>", self.pass_name)
    }
}

/// Renders scenes. It keeps data on the device that the next frame may need: one renderer for all frames is fastest.
///
/// A renderer does one render at a time; other calls wait. Threads that render in parallel each need their own renderer; they can share one
/// device.
#[pyclass(module = "camlux", frozen)]
pub struct Renderer {
    renderer: OfProcess<Mutex<camlux::Renderer>>,
    returned: Returned,
    lens_lights: Mutex<LensLights>,
    /// Materials and meshes of the last scene, whose warnings have been shown.
    warned: Mutex<(Vec<Material>, Vec<Shared<Mesh>>)>,
    device: Py<Device>,
}

impl Renderer {
    /// The warnings of a scene, unless its materials and meshes are those of the last one: they are searched triangle by triangle.
    fn warnings_of(&self, scene: &Scene) -> Vec<String> {
        let meshes: Vec<Shared<Mesh>> = scene.meshes.iter().map(|m| m.mesh.clone()).collect();
        let mut warned = self.warned.lock().unwrap_or_else(PoisonError::into_inner);
        let (materials_before, meshes_before) = &*warned;
        let is_known = *materials_before == scene.materials
            && meshes_before.len() == meshes.len()
            && meshes_before
                .iter()
                .zip(&meshes)
                .all(|(before, now)| before.ptr_eq(now));
        if is_known {
            return Vec::new();
        }
        *warned = (scene.materials.clone(), meshes);
        scene.warnings()
    }

    /// Renders without the GIL. An error has the place of the camera that failed.
    fn rendered(
        &self,
        py: Python,
        request: Request,
        render: impl FnOnce(
            &mut camlux::Renderer,
            &Scene,
            &mut RenderOptions,
        ) -> Result<Vec<output::Frame>, (Option<usize>, camlux::Error)>
        + Send,
    ) -> PyResult<Vec<Py<Frame>>> {
        let Request {
            scene,
            seed,
            frame_index,
            layers,
            keep_partial,
            mut watch,
        } = request;
        let renderer = self.renderer.get()?;
        let mut failed = None;
        let rendered = py.detach(|| {
            let mut renderer = renderer.lock().unwrap_or_else(PoisonError::into_inner);
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
            let mut options = RenderOptions {
                progress: Some(&mut ask),
                keep_partial,
                repeat_unchanged: true,
                seed,
                frame_index,
                layers: layers.as_deref(),
                ..RenderOptions::default()
            };
            let frames = render(&mut renderer, &scene, &mut options);
            let frames = frames.map_err(|(place, error)| {
                failed = place;
                error
            })?;
            let mut warnings: Vec<String> = Vec::new();
            for warning in frames.iter().flat_map(output::Frame::warnings) {
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
            }
            // Of several cameras, only one may have a light at its lens.
            if let [_] = frames[..] {
                let lens_lights = self.lens_lights.lock();
                let mut lens_lights = lens_lights.unwrap_or_else(PoisonError::into_inner);
                warnings.extend(lens_lights.warning(&scene));
            }
            warnings.extend(self.warnings_of(&scene));
            Ok((frames, warnings))
        });
        let within = failed.map_or_else(String::new, |place| format!("camera {place}: "));
        let (frames, warnings) = watch.outcome(py, &within, rendered)?;
        let frames = frames.into_iter();
        let frames =
            frames.map(|frame| Frame::create(py, frame, &scene, Some(self.returned.clone())));
        let frames = frames.collect::<PyResult<_>>()?;
        warn(py, &warnings)?;
        Ok(frames)
    }
}

/// What a render is called with.
struct Request {
    scene: Scene,
    seed: u32,
    frame_index: Option<u32>,
    layers: Option<Vec<Layer>>,
    keep_partial: bool,
    watch: Watch,
}

type Argument<'py> = Option<Bound<'py, PyAny>>;

impl Request {
    /// `arguments`: target_error, seed, frame_index and layers, as in Python.
    fn of(
        py: Python,
        scene: &Bound<'_, PyAny>,
        [target_error, seed, frame_index, layers]: [Argument; 4],
        progress: Argument,
        keep_partial: bool,
    ) -> PyResult<Request> {
        let layers = layers.map(|value| self::layers(&value)).transpose()?;
        let whole = |value: Argument, name| {
            let given = value.map(|value| count(&value, name));
            given.transpose()
        };
        let seed = whole(seed, "seed")?.unwrap_or_default();
        let frame_index = whole(frame_index, "frame_index")?;
        let target_error = target_error
            .map(|value| number(&value, "target_error", "a number, such as 0.02 for 2 %"));
        let mut scene = scene_from(scene)?;
        if let Some(requested) = target_error.transpose()? {
            match &mut scene.indirect {
                Some(IndirectLight::FinalGather(gather)) => gather.target_error = requested,
                other => *other = Some(IndirectLight::final_gather(requested)),
            }
        }
        Ok(Request {
            scene,
            seed,
            frame_index,
            layers,
            keep_partial,
            watch: Watch::new(py, progress)?,
        })
    }
}

#[pymethods]
impl Renderer {
    /// device: None opens the best one.
    #[new]
    #[pyo3(signature = (device=None, **others), text_signature = "(device=None)")]
    fn new(
        py: Python,
        device: Option<Py<Device>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Renderer> {
        refuse("Renderer", others)?;
        let device = match device {
            Some(device) => device,
            None => Py::new(py, Device::new(py, None, false, None)?)?,
        };
        let renderer = camlux::Renderer::new(device.get().get()?).map_err(raised)?;
        Ok(Renderer {
            renderer: OfProcess::new(Mutex::new(renderer)),
            returned: Returned::default(),
            lens_lights: Mutex::default(),
            warned: Mutex::default(),
            device,
        })
    }

    /// The device that it renders on.
    #[getter]
    fn device(&self, py: Python) -> Py<Device> {
        self.device.clone_ref(py)
    }

    /// Renders a frame, without the GIL. Control-C ends it.
    ///
    /// target_error: indirect light by final gathering to this relRMSE, whatever the scene requests. seed: another number gives other
    /// samples of indirect light and other sensor noise. frame_index: the number in a series; each has other sensor noise; None: the
    /// renderer counts, and Frame.frame_index tells the number. layers: copies only this or these from the device, which is faster; None:
    /// all. progress: called from time to time with a Progress; if it returns False, Cancelled is raised. True shows a bar, for which tqdm
    /// must be installed. keep_partial: a render that progress ends returns the best image that it has, with its estimated error; only with
    /// final gathering.
    ///
    /// Raises SceneError for a scene that cannot be rendered, DeviceError for one that the device cannot hold. Shows a CamluxWarning for a
    /// frame that is probably a mistake, such as a black one.
    #[allow(clippy::too_many_arguments, reason = "Python's have names")]
    #[pyo3(
        signature = (scene, *, target_error=None, seed=None, frame_index=None, layers=None, progress=None, keep_partial=false, **others),
        text_signature = "($self, scene, *, target_error=None, seed=0, frame_index=None, layers=None, progress=None, keep_partial=False)"
    )]
    fn render(
        &self,
        py: Python,
        scene: &Bound<'_, PyAny>,
        target_error: Option<Bound<'_, PyAny>>,
        seed: Option<Bound<'_, PyAny>>,
        frame_index: Option<Bound<'_, PyAny>>,
        layers: Option<Bound<'_, PyAny>>,
        progress: Option<Bound<'_, PyAny>>,
        keep_partial: bool,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Py<Frame>> {
        refuse("Renderer.render", others)?;
        let arguments = [target_error, seed, frame_index, layers];
        let request = Request::of(py, scene, arguments, progress, keep_partial)?;
        let mut frames = self.rendered(py, request, |renderer, scene, options| {
            let frame = renderer.render(scene, options);
            frame
                .map(|frame| vec![frame])
                .map_err(|error| (None, error))
        })?;
        frames
            .pop()
            .ok_or_else(|| Error::new_err("internal error: a render without a frame"))
    }

    /// Renders a scene from several cameras, each as if it were the scene's own, and returns their frames. On a GPU several frames render at a
    /// time, each in images of its own, which is faster than one after the other; all of them are in memory in the end, so give a long list
    /// in parts.
    ///
    /// cameras: a list of Camera. A light that is relative to the camera moves to each of them. The other arguments are those of render. All
    /// frames have the same frame_index, and each camera has its own sensor noise.
    ///
    /// Raises what render raises; the message names the first camera that failed.
    #[allow(clippy::too_many_arguments, reason = "Python's have names")]
    #[pyo3(
        signature = (scene, cameras, *, target_error=None, seed=None, frame_index=None, layers=None, progress=None, keep_partial=false, **others),
        text_signature = "($self, scene, cameras, *, target_error=None, seed=0, frame_index=None, layers=None, progress=None, keep_partial=False)"
    )]
    fn render_cameras(
        &self,
        py: Python,
        scene: &Bound<'_, PyAny>,
        cameras: &Bound<'_, PyAny>,
        target_error: Option<Bound<'_, PyAny>>,
        seed: Option<Bound<'_, PyAny>>,
        frame_index: Option<Bound<'_, PyAny>>,
        layers: Option<Bound<'_, PyAny>>,
        progress: Option<Bound<'_, PyAny>>,
        keep_partial: bool,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Vec<Py<Frame>>> {
        refuse("Renderer.render_cameras", others)?;
        let cameras = cameras_from(cameras)?;
        let arguments = [target_error, seed, frame_index, layers];
        let request = Request::of(py, scene, arguments, progress, keep_partial)?;
        self.rendered(py, request, |renderer, scene, options| {
            let frames = renderer.render_cameras(scene, &cameras, options);
            frames.map_err(|(place, error)| (Some(place), error))
        })
    }

    fn __reduce__(&self) -> PyResult<()> {
        let instead = "make one in each process, and one for each thread";
        Err(not_copied("Renderer", instead))
    }

    fn __repr__(&self, py: Python) -> PyResult<String> {
        let device = self.device.bind(py).get().get()?;
        Ok(format!("<camlux.Renderer on {:?}>", device.info().name))
    }
}
