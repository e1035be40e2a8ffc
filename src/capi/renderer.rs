//! Renderers.

use std::{
    ffi::{c_char, c_void},
    ops::ControlFlow,
    sync::{
        Arc, Mutex, MutexGuard, OnceLock, TryLockError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use super::*;
use crate::{
    Progress, RenderOptions, Renderer,
    output::{Frame, Layer},
    scene::Camera,
};

/// Receives how far a render is: 0 to 1 by estimated work, the pass that runs next (a string that is valid during the call),
/// and the pointer of the options.
///
/// \return 0 to go on; anything else ends the render with CAMLUX_CANCELLED.
///
/// It is called on the thread that renders, about twice a second and between passes. It may call camlux, but a render with the
/// same renderer is CAMLUX_ERROR_BUSY. It must return: no exception, no longjmp.
pub type camlux_progress_callback =
    Option<unsafe extern "C" fn(fraction: f64, pass: *const c_char, user: *mut c_void) -> i32>;

/// How to render, apart from what. Begin with CAMLUX_RENDER_OPTIONS_INIT: no callback, half a second.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_render_options {
    /// sizeof(camlux_render_options)
    pub struct_size: u32,
    /// GPU time that one submission should take, milliseconds above 0: as long takes what is between two reports of progress,
    /// and a cancel.
    pub submission_target_ms: u32,
    /// NULL: none.
    pub progress: camlux_progress_callback,
    /// Handed to the callback; camlux never looks at what it points to.
    pub progress_user: *mut c_void,
    /// 1: the images stay on the device, for camlux_frame_get_vulkan_image; they come to the host when a layer is asked for.
    /// 0: they go to the host.
    pub on_device: i32,
    /// Which frame of a sequence this is: each has its own noise (camlux_tof_noise). Nothing else depends on it.
    pub frame_index: u32,
    /// NULL: none. The render ends with CAMLUX_CANCELLED once this is cancelled, before its first pass where it was already.
    pub cancel_token: *mut camlux_cancel_token,
    /// Where layers go, the first of target_count; NULL: none. Only these layers come from the device, and the frame has none of its own. For
    /// one camera, and not with on_device.
    pub targets: *const camlux_target,
    /// How many targets there are.
    pub target_count: usize,
}

c_struct!(camlux_render_options, 40, submission_target_ms: 500);

/// A renderer, and the device that it keeps open.
pub(super) struct RendererObject {
    /// Before the device, so that it is dropped first.
    renderer: Mutex<Renderer>,
    device: Arc<DeviceObject>,
}

/// Whether it was cancelled, which it stays.
#[derive(Default)]
pub(super) struct CancelToken(AtomicBool);

/// Makes a renderer on a device. It keeps the device open, and on it what the next frame may need again.
///
/// \param renderer receives the handle, with one reference: give it back by camlux_renderer_release.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_VULKAN.
/// \threads any. One renderer renders one frame at a time; for more at once, make more.
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
        // SAFETY: the caller's word.
        unsafe { handle::return_handle(renderer, "renderer", make) }
    })
}

/// Renders a frame of a scene as it is at the time of the call: what other threads change in it meanwhile is for the next frame.
///
/// The first frame compiles pipelines and copies the scene to the device. Later ones of the same scene make anew only what has
/// changed: see camlux_scene_set_pose and camlux_frame_get_pass.
///
/// \param options NULL: those of CAMLUX_RENDER_OPTIONS_INIT.
/// \param frame receives the handle, with one reference: give it back by camlux_frame_release.
/// \errors CAMLUX_CANCELLED; CAMLUX_ERROR_SCENE for a scene that cannot be rendered, such as one without light;
/// CAMLUX_ERROR_DEVICE_LIMIT; CAMLUX_ERROR_BUSY where the renderer is rendering; CAMLUX_ERROR_OUT_OF_MEMORY;
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
        // SAFETY: the caller's word.
        let options = unsafe { args::read_optional(options) }?.unwrap_or_default();
        let render = || {
            // SAFETY: the caller's word.
            let request = unsafe { Request::read(options) }?;
            let lock = renderer.lock()?;
            renderer.render_one(lock, Snapshot::of(scene), &request)
        };
        // SAFETY: the caller's word.
        unsafe { handle::return_handle(frame, "frame", render) }
    })
}

/// Renders a scene as several cameras see it, each as camlux_scene_set_camera would set it: what the lights see, and all that rays meet, is
/// made once.
///
/// \param cameras the first of `count`, each begun with CAMLUX_CAMERA_INIT; for those of another size, images are made anew.
/// \param stride_bytes from one camera to the next: sizeof(camlux_camera), or the size of what a camera is the first member of.
/// \param options NULL: those of CAMLUX_RENDER_OPTIONS_INIT.
/// \param frames receive `count` handles, with one reference each: give them back by camlux_frame_release. Where one camera fails there is none.
/// \errors those of camlux_renderer_render; the message tells which camera it is.
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
        // SAFETY: the caller's word.
        let options = unsafe { args::read_optional(options) }?.unwrap_or_default();
        let checked = |camera| {
            let camera = camera_from_c(camera)?;
            camera.validate()?;
            Ok(camera)
        };
        // SAFETY: the caller's word.
        let cameras = unsafe { args::read_many(cameras, count, stride_bytes, checked) }?;
        let render = || {
            // SAFETY: the caller's word.
            let request = unsafe { Request::read(options) }?;
            if !request.targets.is_empty() {
                let problem = "targets are given, which are of one camera; render camera by camera, or copy layers by camlux_frame_copy";
                return Err(Failure::argument(problem));
            }
            let lock = renderer.lock()?;
            renderer.render(lock, Snapshot::of(scene), &request, &cameras)
        };
        // SAFETY: the caller's word.
        unsafe { handle::return_handles(frames, "frames", count, render) }
    })
}

/// Foretells the GPU time that a frame of a scene will take, from the last frame of the renderer, if it was of as many triangles
/// and lights and by the same estimator. It is good to a factor of 2 for up to four times the pixels and half the error.
///
/// \param milliseconds receives it; 0 where the last frame tells nothing of this scene, or there was none.
/// \errors CAMLUX_ERROR_BUSY where the renderer is rendering; CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
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
        // SAFETY: the caller's word.
        unsafe { args::write_result(milliseconds, "milliseconds", foretell) }
    })
}

/// Makes a token by which another thread ends renders: set it in camlux_render_options.
///
/// \param token receives the handle, with one reference: give it back by camlux_cancel_token_release.
/// \errors CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. Any number of renders may have the same token.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_cancel_token_create(
    token: *mut *mut camlux_cancel_token,
) -> camlux_status {
    ffi_guard("camlux_cancel_token_create", || {
        // SAFETY: the caller's word.
        unsafe { handle::return_handle(token, "token", || Ok(CancelToken::default())) }
    })
}

/// Ends all renders with this token by CAMLUX_CANCELLED: those that are under way after one submission at the latest (see
/// camlux_render_options), those that begin later at once. It does not wait for them. A token stays cancelled.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any: meant for another thread than the one that renders, or a signal handler's helper thread.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_cancel_token_cancel(token: *mut camlux_cancel_token) -> camlux_status {
    ffi_guard("camlux_cancel_token_cancel", || {
        handle::get(token)?.cancel();
        Ok(())
    })
}

impl RendererObject {
    pub fn lock(&self) -> Outcome<MutexGuard<'_, Renderer>> {
        match self.renderer.try_lock() {
            Ok(renderer) => Ok(renderer),
            // What a frame that failed had on the device is given up, by a panic as well.
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => {
                let problem =
                    "the renderer is rendering; wait for it, or make a renderer for each thread";
                Err(Failure::new(CAMLUX_ERROR_BUSY, problem))
            }
        }
    }

    /// The scene as its own camera sees it.
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

    /// The scene as each of some cameras sees it. The lock is given back before the log hears of the frames: a callback of the log may
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
        let mut rendered = args::room_for(cameras.len(), "frames")?;
        let ended = cameras.iter().enumerate().try_for_each(|(done, camera)| {
            snapshot.now.set_camera(*camera);
            let share = [done, cameras.len()];
            rendered.push(draw(&mut renderer, &snapshot.now, request, share)?);
            Ok(())
        });
        drop(renderer);
        self.device.log_validation();
        ended.map_err(|error: crate::Error| match cameras.len() {
            1 => Failure::from(error),
            _ => Failure::from(error).within(&format!("camera {}", rendered.len())),
        })?;
        snapshot.scene.log_warnings(&snapshot.now);
        let frames = rendered.into_iter().zip(cameras).map(|(rendered, camera)| {
            log_frame(&rendered, camera);
            FrameObject::new(rendered, snapshot.milliseconds)
        });
        Ok(frames.collect())
    }
}

/// Renders one frame of several: so many are done, of so many.
fn draw(
    renderer: &mut Renderer,
    scene: &crate::Scene,
    request: &Request,
    [done, all]: [usize; 2],
) -> crate::Result<Rendered> {
    let options = &request.options;
    let mut report = |mut progress: Progress| {
        progress.fraction = (done as f32 + progress.fraction) / all as f32;
        if is_enough(progress, options) || request.is_cancelled() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let layers: Vec<Layer> = request.targets.iter().map(|target| target.layer).collect();
    let mut render_options = RenderOptions {
        progress: Some(&mut report),
        layers: (!layers.is_empty()).then_some(&layers[..]),
        submission_target: Duration::from_millis(options.submission_target_ms.into()),
        frame_index: options.frame_index,
        ..RenderOptions::default()
    };
    if request.stays_on_device {
        let frame = renderer.render_on_device(scene, &mut render_options)?;
        Ok(Rendered::OnDevice(frame, OnceLock::new()))
    } else {
        let frame = renderer.render(scene, &mut render_options)?;
        match layers[..] {
            [] => Ok(Rendered::ToHost(frame)),
            _ => to_targets(renderer, frame, &request.targets),
        }
    }
}

/// Takes layers to the host's memory, and their buffers back for the next frame.
fn to_targets(
    renderer: &mut Renderer,
    frame: Frame,
    targets: &[Target],
) -> crate::Result<Rendered> {
    for target in targets {
        let mut layers = frame.layers.iter();
        let data = layers.find_map(|(layer, data)| (*layer == target.layer).then_some(data));
        let data = data.ok_or_else(|| crate::Error::internal("a frame without a wanted layer"))?;
        // SAFETY: the host's word: it keeps its memory until the render has ended.
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

/// How a frame is to be rendered.
pub(super) struct Request {
    options: camlux_render_options,
    stays_on_device: bool,
    targets: Vec<Target>,
    token: Arc<CancelToken>,
    /// Nobody waits for the frame any more.
    pub abandoned: Arc<CancelToken>,
}

// SAFETY: the pointers are the host's, which lets them be used on the thread of its job: see camlux_renderer_submit.
unsafe impl Send for Request {}

impl Request {
    /// # Safety
    /// The targets are as many as the options say.
    pub unsafe fn read(options: camlux_render_options) -> Outcome<Request> {
        if options.submission_target_ms == 0 {
            let problem = "submission_target_ms is 0; give milliseconds, such as 500";
            return Err(Failure::argument(problem));
        }
        let stays_on_device = args::flag("on_device", options.on_device)?;
        let targets = match options.target_count {
            0 => Vec::new(),
            count => {
                // SAFETY: the caller's word, also for the others, which are as large as the first.
                unsafe {
                    let stride_bytes = args::read(options.targets)?.struct_size as usize;
                    args::read_many(options.targets, count, stride_bytes, Target::from_c)?
                }
            }
        };
        if stays_on_device && !targets.is_empty() {
            let problem = "targets are given for a frame that stays on the device; set one of targets and on_device";
            return Err(Failure::argument(problem));
        }
        let token = if options.cancel_token.is_null() {
            Arc::default()
        } else {
            handle::get(options.cancel_token)?
        };
        Ok(Request {
            options,
            stays_on_device,
            targets,
            token,
            abandoned: Arc::default(),
        })
    }

    fn is_cancelled(&self) -> bool {
        self.token.is_cancelled() || self.abandoned.is_cancelled()
    }
}

/// A scene as it was.
pub(super) struct Snapshot {
    scene: Arc<SceneObject>,
    now: crate::Scene,
    /// What it took.
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

impl CancelToken {
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Tells the host how far the render is; whether it wants no more.
fn is_enough(progress: Progress, options: &camlux_render_options) -> bool {
    let Some(callback) = options.progress else {
        return false;
    };
    let pass = c_string(progress.pass);
    let fraction = f64::from(progress.fraction);
    // SAFETY: the host's function, of that type; the text outlives the call.
    unsafe { callback(fraction, pass.as_ptr(), options.progress_user) != 0 }
}

fn log_frame(rendered: &Rendered, camera: &Camera) {
    let warnings = match rendered {
        Rendered::ToHost(frame) => frame.warnings(),
        Rendered::ToTargets(_, warnings) => warnings.clone(),
        Rendered::OnDevice(frame, _) => frame.warnings(),
    };
    for warning in warnings {
        log::write(CAMLUX_LOG_WARNING, || warning);
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
