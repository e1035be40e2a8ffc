//! Renderers.

use std::{
    sync::{Arc, Mutex, MutexGuard, OnceLock, TryLockError},
    time::Instant,
};

use super::*;
use crate::{Progress, Renderer, output::Frame, scene::Camera};

/// A renderer, and the device that it keeps open.
pub(super) struct RendererObject {
    /// Declared before the device, so that it is dropped first.
    renderer: Mutex<Renderer>,
    device: Arc<DeviceObject>,
}

/// Creates a renderer on a device. It keeps the device open, and keeps on it what the next frame can reuse.
///
/// \param renderer receives the handle, with one reference; release it with camlux_renderer_release.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_VULKAN.
/// \threads any. One renderer renders one frame at a time; make more to render several at once.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_renderer_create(
    device: *mut camlux_device,
    renderer: *mut *mut camlux_renderer,
) -> camlux_status {
    ffi_guard("camlux_renderer_create", || {
        let device = handle::get(device)?;
        let make = || {
            Ok(RendererObject {
                renderer: Mutex::new(Renderer::new(&device.device)?),
                device: device.clone(),
            })
        };
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(renderer, "renderer", make) }
    })
}

/// Renders a frame of a scene as it is at the time of the call. Changes that other threads make meanwhile apply to the next frame.
///
/// The first frame compiles pipelines and copies the scene to the device, unless camlux_renderer_prepare has done it. Later frames of the same scene recompute only what has
/// changed: see camlux_scene_set_pose and camlux_frame_get_pass. If neither the scene nor the seed has, the last frame comes back, with another
/// index and other sensor noise, and without passes; one that max_ms has cut short is drawn again.
///
/// \param options NULL: those of CAMLUX_RENDER_OPTIONS_INIT.
/// \param frame receives the handle, with one reference; release it with camlux_frame_release.
/// \errors CAMLUX_CANCELLED; CAMLUX_ERROR_SCENE for a scene that cannot be rendered;
/// CAMLUX_ERROR_DEVICE_LIMIT; CAMLUX_ERROR_BUSY if the renderer is rendering; CAMLUX_ERROR_OUT_OF_MEMORY;
/// CAMLUX_ERROR_VULKAN; CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; it returns when the frame is done.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_renderer_render(
    renderer: *mut camlux_renderer,
    scene: *mut camlux_scene,
    options: *const camlux_render_options,
    frame: *mut *mut camlux_frame,
) -> camlux_status {
    ffi_guard("camlux_renderer_render", || {
        let renderer = handle::get(renderer)?;
        let scene = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let options = unsafe { args::read_optional(options) }?.unwrap_or_default();
        let render = || {
            // SAFETY: the caller guarantees it.
            let request = unsafe { Request::read(options) }?;
            let lock = renderer.lock()?;
            renderer.render_one(lock, Snapshot::of(scene), &request)
        };
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(frame, "frame", render) }
    })
}

/// Renders a scene from several cameras, each as if camlux_scene_set_camera had set it. What rays hit is computed once. All frames have the
/// same index, and each camera has its own noise. A light that is relative to the camera moves to each of them.
///
/// On a GPU up to four frames render at a time, each in images of its own, which the renderer keeps. One after the other (on a CPU driver, with
/// on_device, and where the memory holds only one) they also share what the lights see.
///
/// \param cameras the first of `count`, each initialised with CAMLUX_CAMERA_INIT. A camera with another image size needs new images.
/// \param stride_bytes from one camera to the next: sizeof(camlux_camera), or the size of a struct whose first member is a camera.
/// \param options NULL: those of CAMLUX_RENDER_OPTIONS_INIT.
/// \param frames receives `count` handles, with one reference each; release them with camlux_frame_release. If one camera fails, there are none.
/// \errors those of camlux_renderer_render; the message says which camera failed.
/// \threads any; it returns when the frames are done.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_renderer_render_cameras(
    renderer: *mut camlux_renderer,
    scene: *mut camlux_scene,
    cameras: *const camlux_camera,
    count: usize,
    stride_bytes: usize,
    options: *const camlux_render_options,
    frames: *mut *mut camlux_frame,
) -> camlux_status {
    ffi_guard("camlux_renderer_render_cameras", || {
        let renderer = handle::get(renderer)?;
        let scene = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let options = unsafe { args::read_optional(options) }?.unwrap_or_default();
        let checked = |camera| {
            let camera = camera_from_c(camera)?;
            camera.validate()?;
            Ok(camera)
        };
        // SAFETY: the caller guarantees it.
        let cameras = unsafe { args::read_many(cameras, count, stride_bytes, checked) }?;
        let render = || {
            // SAFETY: the caller guarantees it.
            let request = unsafe { Request::read(options) }?;
            if !request.targets.is_empty() {
                let problem = "targets hold the layers of one camera only; render camera by camera, or copy layers with camlux_frame_copy";
                return Err(Failure::argument(problem));
            }
            let lock = renderer.lock()?;
            renderer.render(lock, Snapshot::of(scene), &request, &cameras)
        };
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handles(frames, "frames", count, render) }
    })
}

/// Compiles what frames of a scene need and copies the scene to the device, so that the first frame takes no longer than the others. It
/// renders a small image of the scene, which nobody sees. Another estimator, another kind of light, a first texture or a first cut-out may
/// need more. So may another size of the image, if the lens is distorted.
///
/// \param milliseconds receives the time that it took; may be NULL. preparation_ms of camlux_frame_stats tells what is left for a frame.
/// \errors those of camlux_renderer_render, except CAMLUX_CANCELLED.
/// \threads any; it returns when all is on the device.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_renderer_prepare(
    renderer: *mut camlux_renderer,
    scene: *mut camlux_scene,
    milliseconds: *mut f64,
) -> camlux_status {
    ffi_guard("camlux_renderer_prepare", || {
        let renderer = handle::get(renderer)?;
        let scene = handle::get(scene)?;
        let prepare = || {
            let lock = renderer.lock()?;
            renderer.prepare(lock, &scene.snapshot())
        };
        if milliseconds.is_null() {
            return prepare().map(drop);
        }
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(milliseconds, "milliseconds", prepare) }
    })
}

/// Predicts the GPU time of a frame of a scene from the renderer's last frame. That frame must have had the same number of triangles
/// and lights and the same estimator. The prediction is good to a factor of 2 for up to four times the pixels and half the error.
///
/// \param milliseconds receives the time; 0 if there was no last frame, or it does not allow a prediction for this scene.
/// \errors CAMLUX_ERROR_BUSY if the renderer is rendering; CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_renderer_foretell_ms(
    renderer: *mut camlux_renderer,
    scene: *mut camlux_scene,
    milliseconds: *mut f64,
) -> camlux_status {
    ffi_guard("camlux_renderer_foretell_ms", || {
        let renderer = handle::get(renderer)?;
        let scene = handle::get(scene)?;
        let foretell = || {
            let foretold = renderer.lock()?.foretell_ms(&scene.snapshot());
            Ok(foretold.unwrap_or(0.0))
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(milliseconds, "milliseconds", foretell) }
    })
}

impl RendererObject {
    pub fn lock(&self) -> Outcome<MutexGuard<'_, Renderer>> {
        match self.renderer.try_lock() {
            Ok(renderer) => Ok(renderer),
            // A frame that failed, even by a panic, has given up its state on the device.
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => {
                let problem =
                    "the renderer is rendering; wait for it, or make a renderer for each thread";
                Err(Failure::new(CAMLUX_ERROR_BUSY, problem))
            }
        }
    }

    fn prepare(
        &self,
        mut renderer: MutexGuard<'_, Renderer>,
        scene: &crate::Scene,
    ) -> Outcome<f64> {
        let prepared = renderer.prepare(scene);
        drop(renderer);
        self.device.log_validation();
        Ok(prepared?)
    }

    /// Renders the scene from its own camera.
    pub fn render_one(
        &self,
        renderer: MutexGuard<'_, Renderer>,
        snapshot: Snapshot,
        request: &Request,
    ) -> Outcome<FrameObject> {
        let camera = snapshot.now.camera;
        let mut frames = self.render(renderer, snapshot, request, &[camera])?;
        let none = || crate::Error::internal("a camera without a frame").into();
        frames.pop().ok_or_else(none)
    }

    /// Renders the scene from each of some cameras. Releases the lock before it logs the frames: a log callback may
    /// render with this renderer.
    fn render(
        &self,
        mut renderer: MutexGuard<'_, Renderer>,
        mut snapshot: Snapshot,
        request: &Request,
        cameras: &[Camera],
    ) -> Outcome<Vec<FrameObject>> {
        if request.is_cancelled() {
            return Err(crate::Error::Cancelled.into());
        }
        for (place, target) in request.targets.iter().enumerate() {
            let fits = target.check(snapshot.now.camera.resolution_px);
            fits.map_err(|failure| failure.within(&format!("target {place}")))?;
        }
        let rendered = match cameras {
            [camera] => {
                snapshot.now.camera = *camera;
                let frame = draw(&mut renderer, &snapshot.now, request);
                frame.map(|frame| vec![frame]).map_err(Failure::from)
            }
            _ => {
                let frames = draw_all(&mut renderer, &snapshot.now, request, cameras);
                frames.map_err(|(place, error)| {
                    Failure::from(error).within(&format!("camera {place}"))
                })
            }
        };
        drop(renderer);
        self.device.log_validation();
        let rendered = rendered?;
        snapshot.scene.log_warnings(&snapshot.now);
        // Of several cameras, only one may have a light at its lens.
        if cameras.len() == 1 {
            snapshot.scene.watch_lens(&snapshot.now);
        }
        let frames = rendered.into_iter().zip(cameras).map(|(rendered, camera)| {
            log_frame(&snapshot.scene, &rendered, camera);
            FrameObject::new(rendered, snapshot.milliseconds)
        });
        Ok(frames.collect())
    }
}

/// Renders one frame.
fn draw(
    renderer: &mut Renderer,
    scene: &crate::Scene,
    request: &Request,
) -> crate::Result<Rendered> {
    let mut report = |progress| request.report(progress);
    let mut options = request.render_options(&mut report);
    if request.stays_on_device {
        let frame = renderer.render_on_device(scene, &mut options)?;
        return Ok(Rendered::OnDevice(frame, OnceLock::new()));
    }
    let frame = renderer.render(scene, &mut options)?;
    match request.targets[..] {
        [] => Ok(Rendered::ToHost(frame)),
        _ => to_targets(renderer, frame, &request.targets),
    }
}

/// Renders a frame from each of some cameras. An error has the place of the camera.
fn draw_all(
    renderer: &mut Renderer,
    scene: &crate::Scene,
    request: &Request,
    cameras: &[Camera],
) -> std::result::Result<Vec<Rendered>, (usize, crate::Error)> {
    if !request.stays_on_device {
        let mut report = |progress| request.report(progress);
        let mut options = request.render_options(&mut report);
        let frames = renderer.render_cameras(scene, cameras, &mut options)?;
        return Ok(frames.into_iter().map(Rendered::ToHost).collect());
    }
    let mut frame_index = None;
    let drawn = cameras.iter().enumerate().map(|(place, &camera)| {
        let mut report = |mut progress: Progress| {
            progress.fraction = (place as f32 + progress.fraction) / cameras.len() as f32;
            request.report(progress)
        };
        let mut options = request.render_options(&mut report);
        options.frame_index = frame_index.or(options.frame_index);
        options.camera_index = place as u32;
        let scene = crate::Scene {
            camera,
            ..scene.clone()
        };
        let frame = renderer.render_on_device(&scene, &mut options);
        let frame = frame.map_err(|error| (place, error))?;
        // All cameras see the same frame.
        frame_index = Some(frame.description().key.index);
        Ok(Rendered::OnDevice(frame, OnceLock::new()))
    });
    drawn.collect()
}

/// Copies layers to the host's memory, and returns their buffers to the renderer for the next frame.
fn to_targets(
    renderer: &mut Renderer,
    frame: Frame,
    targets: &[Target],
) -> crate::Result<Rendered> {
    for target in targets {
        let mut layers = frame.layers.iter();
        let data = layers.find_map(|(layer, data)| (*layer == target.layer).then_some(data));
        let data = data.ok_or_else(|| crate::Error::internal("a frame without a wanted layer"))?;
        // SAFETY: the host guarantees that its memory is valid until the render has ended.
        let filled = unsafe { target.fill(data, frame.resolution_px) };
        filled.map_err(|failure| crate::Error::internal(failure.message))?;
    }
    let warnings = frame.warnings();
    let without_layers = Frame {
        resolution_px: frame.resolution_px,
        layers: Vec::new(),
        stats: frame.stats.clone(),
        description: frame.description.clone(),
    };
    renderer.return_buffers(frame);
    Ok(Rendered::ToTargets(without_layers, warnings))
}

/// A scene as it was at the time of a call.
pub(super) struct Snapshot {
    scene: Arc<SceneObject>,
    now: crate::Scene,
    /// Time that the snapshot took.
    milliseconds: f64,
}

impl Snapshot {
    pub fn of(scene: Arc<SceneObject>) -> Snapshot {
        let start = Instant::now();
        let now = scene.snapshot();
        Snapshot {
            scene,
            now,
            milliseconds: start.elapsed().as_secs_f64() * 1e3,
        }
    }
}

fn log_frame(scene: &SceneObject, rendered: &Rendered, camera: &Camera) {
    let warnings = match rendered {
        Rendered::ToHost(frame) => frame.warnings(),
        Rendered::ToTargets(_, warnings) => warnings.clone(),
        Rendered::OnDevice(frame, _) => frame.warnings(),
    };
    for warning in warnings {
        scene.warn(&warning);
    }
    let (stats, [width, height]) = (rendered.stats(), camera.resolution_px);
    log::write(CAMLUX_LOG_INFO, || {
        format!(
            "rendered {width} x {height} px in {:.3} ms, {} VPLs, {} rays, {} submissions",
            stats.wall_milliseconds, stats.vpl_count, stats.ray_count, stats.submissions
        )
    });
    for pass in &stats.passes {
        log::write(CAMLUX_LOG_DEBUG, || {
            format!("pass {} {:.3} ms", pass.name, pass.milliseconds)
        });
    }
}
