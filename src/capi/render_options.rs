//! Options of a render: progress, cancellation, where layers go.

use std::{
    ffi::{c_char, c_void},
    ops::ControlFlow,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use super::*;
use crate::{Progress, RenderOptions, output::Layer};

/// Receives the progress of a render: the fraction from 0 to 1 by estimated work, the name of the pass that runs next (valid during the
/// call; "done" at the end, when the fraction is 1), and the user pointer of the options.
///
/// \return 0 to continue; any other value ends the render with CAMLUX_CANCELLED.
///
/// It is called on the thread that renders, about twice a second and between passes. It may call camlux, but a render with the
/// same renderer returns CAMLUX_ERROR_BUSY. It must return: no exception, no longjmp.
pub type camlux_progress_callback =
    Option<unsafe extern "C" fn(fraction: f64, pass: *const c_char, user: *mut c_void) -> i32>;

/// For frame_index: the renderer counts its frames.
pub const CAMLUX_NEXT_FRAME: u32 = u32::MAX;

/// How to render a scene. Initialise with CAMLUX_RENDER_OPTIONS_INIT: no callback, submissions of half a second,
/// frames that the renderer counts.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_render_options {
    /// Set by CAMLUX_RENDER_OPTIONS_INIT.
    pub struct_size: u32,
    /// Target GPU time of one submission, milliseconds above 0. It is also the time between two reports of progress, and the time that a
    /// cancel takes.
    pub submission_target_ms: u32,
    /// Progress callback; NULL: none.
    pub progress: camlux_progress_callback,
    /// Passed to the callback; camlux does not read what it points to.
    pub progress_user: *mut c_void,
    /// 1: the images stay on the device, for camlux_frame_get_vulkan_image; they are copied to the host when a layer is requested.
    /// 0: they are copied to the host.
    pub on_device: i32,
    /// Index of the frame in a sequence. Each frame has its own noise (camlux_tof_noise). Nothing else depends on it. CAMLUX_NEXT_FRAME: the
    /// renderer counts its frames from 0, and goes on after the largest index that it was given; camlux_frame_get_stats tells the index.
    /// Frames with the same index, camera and seed have the same noise.
    pub frame_index: u32,
    /// NULL: none. Cancelling this token ends the render with CAMLUX_CANCELLED. If it is cancelled already, no pass runs.
    pub cancel_token: *mut camlux_cancel_token,
    /// Where layers go: the first of target_count targets; NULL: none. Only these layers are copied from the device, and the frame itself has no
    /// layers. For one camera only, and not with on_device.
    pub targets: *const camlux_target,
    /// Number of targets.
    pub target_count: usize,
    /// Seed of the random numbers. Another seed gives other samples of indirect light, with another error, and other noise
    /// (camlux_tof_noise).
    pub seed: u32,
    /// 1: a render that is cancelled once it runs returns the best image that it has, with its estimated error, instead of CAMLUX_CANCELLED;
    /// where it has none yet, one of few rays. Direct light is complete in any case. Only with CAMLUX_ESTIMATOR_FINAL_GATHER. 0: there is
    /// no frame.
    pub keep_partial: i32,
    /// Layers of the frame: the first of layer_count numbers, such as CAMLUX_LAYER_RADIANCE; NULL, with layer_count 0: all layers of the scene,
    /// except those that are there on request only. Not with on_device or targets.
    pub layers: *const i32,
    /// Number of these layers.
    pub layer_count: usize,
}

c_struct!(
    camlux_render_options, 40,
    submission_target_ms: 500,
    frame_index: CAMLUX_NEXT_FRAME,
);

/// Whether the token was cancelled. It never changes back.
#[derive(Default)]
pub(super) struct CancelToken(AtomicBool);

/// Creates a token with which another thread can cancel renders: set it in camlux_render_options.
///
/// \param token receives the handle, with one reference; release it with camlux_cancel_token_release.
/// \errors CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. Any number of renders may use the same token.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_cancel_token_create(
    token: *mut *mut camlux_cancel_token,
) -> camlux_status {
    ffi_guard("camlux_cancel_token_create", || {
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(token, "token", || Ok(CancelToken::default())) }
    })
}

/// Ends all renders with this token with CAMLUX_CANCELLED. Running renders end after one submission at the latest (see
/// camlux_render_options), later renders at once. The call does not wait for them. A token stays cancelled.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE.
/// \threads any; use it on another thread than the one that renders, or on the helper thread of a signal handler.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_cancel_token_cancel(token: *mut camlux_cancel_token) -> camlux_status {
    ffi_guard("camlux_cancel_token_cancel", || {
        handle::get(token)?.cancel();
        Ok(())
    })
}

/// The checked options of a render.
pub(super) struct Request {
    pub options: camlux_render_options,
    pub stays_on_device: bool,
    pub keeps_partial: bool,
    pub targets: Vec<Target>,
    /// Empty: those that a frame has by default.
    layers: Vec<Layer>,
    token: Arc<CancelToken>,
    /// Cancelled when nobody waits for the frame any more.
    pub abandoned: Arc<CancelToken>,
}

// SAFETY: the pointers are the host's, which allows their use on the thread of its job: see camlux_renderer_submit.
unsafe impl Send for Request {}

impl Request {
    /// # Safety
    /// There are `target_count` targets and `layer_count` layers.
    pub unsafe fn read(options: camlux_render_options) -> Outcome<Request> {
        if options.submission_target_ms == 0 {
            let problem = "submission_target_ms is 0; give milliseconds, such as 500";
            return Err(Failure::argument(problem));
        }
        let keeps_partial = args::flag("keep_partial", options.keep_partial)?;
        let stays_on_device = args::flag("on_device", options.on_device)?;
        let targets = match options.target_count {
            0 => Vec::new(),
            count => {
                // SAFETY: the caller guarantees it; all targets have the size of the first.
                unsafe {
                    let stride_bytes = args::struct_bytes(options.targets)?;
                    args::read_many(options.targets, count, stride_bytes, Target::from_c)?
                }
            }
        };
        if stays_on_device && !targets.is_empty() {
            let problem = "targets and on_device are both set; set only one of them";
            return Err(Failure::argument(problem));
        }
        if options.layer_count > 0 && (stays_on_device || !targets.is_empty()) {
            let problem = "layers is set, and targets or on_device, too; set only one of them";
            return Err(Failure::argument(problem));
        }
        // SAFETY: the caller guarantees it.
        let numbers = unsafe { layer_numbers(options.layers, options.layer_count) }?;
        let named = numbers.into_iter().map(layer_of);
        let of_targets = targets.iter().map(|target| Ok(target.layer));
        let layers = named.chain(of_targets).collect::<Outcome<_>>()?;
        let token = if options.cancel_token.is_null() {
            Arc::default()
        } else {
            handle::get(options.cancel_token)?
        };
        Ok(Request {
            options,
            stays_on_device,
            keeps_partial,
            targets,
            layers,
            token,
            abandoned: Arc::default(),
        })
    }

    /// The options as the library has them.
    pub fn render_options<'r>(
        &'r self,
        report: &'r mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> RenderOptions<'r> {
        let options = &self.options;
        RenderOptions {
            progress: Some(report),
            keep_partial: self.keeps_partial,
            repeat_unchanged: true,
            submission_target: Duration::from_millis(options.submission_target_ms.into()),
            seed: options.seed,
            layers: (!self.layers.is_empty()).then_some(&self.layers[..]),
            frame_index: (options.frame_index != CAMLUX_NEXT_FRAME).then_some(options.frame_index),
            ..RenderOptions::default()
        }
    }

    /// Reports the progress to the host. Breaks if the host cancels the render.
    pub fn report(&self, progress: Progress) -> ControlFlow<()> {
        match is_enough(progress, &self.options) || self.is_cancelled() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    pub fn is_cancelled(&self) -> bool {
        self.token.is_cancelled() || self.abandoned.is_cancelled()
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

/// Returns whether the host cancels the render.
fn is_enough(progress: Progress, options: &camlux_render_options) -> bool {
    let Some(callback) = options.progress else {
        return false;
    };
    let pass = c_string(progress.pass);
    let fraction = f64::from(progress.fraction);
    // SAFETY: the host's function, of that type; the text outlives the call.
    unsafe { callback(fraction, pass.as_ptr(), options.progress_user) != 0 }
}
