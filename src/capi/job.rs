//! Jobs: renders that run while the host does something else.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc},
    thread::{self, JoinHandle, ThreadId},
    time::Duration,
};

use super::*;

/// A render on its own thread.
pub(super) struct JobObject {
    /// Cancelled with the job's last handle.
    abandoned: Arc<CancelToken>,
    end: Arc<End>,
    thread: ThreadId,
    state: Mutex<State>,
}

/// Whether the render has ended.
#[derive(Default)]
struct End {
    is_reached: Mutex<bool>,
    reached: Condvar,
}

enum State {
    /// Running, or done but not yet waited for.
    Running(JoinHandle<Outcome<FrameObject>>),
    Failed(camlux_status, String),
    /// The frame was returned.
    Taken,
}

/// Starts to render a frame on its own thread, and returns. The scene is rendered as it is at the time of the call, as by
/// camlux_renderer_render. Until the job is done, other renders on this renderer return CAMLUX_ERROR_BUSY; make more renderers to render
/// more frames at once.
///
/// The progress callback and the log callback of this render run on the job's thread. What the options point to must stay valid until
/// the job is done.
///
/// \param options NULL: those of CAMLUX_RENDER_OPTIONS_INIT.
/// \param job receives the handle, with one reference; release it with camlux_job_release.
/// \errors CAMLUX_ERROR_BUSY if the renderer is rendering; CAMLUX_ERROR_OUT_OF_MEMORY if no thread can be started;
/// CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT. camlux_job_wait returns the status of the render itself.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_renderer_submit(
    renderer: *mut camlux_renderer,
    scene: *mut camlux_scene,
    options: *const camlux_render_options,
    job: *mut *mut camlux_job,
) -> camlux_status {
    ffi_guard("camlux_renderer_submit", || {
        let renderer = handle::get(renderer)?;
        let scene = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let options = unsafe { args::read_optional(options) }?.unwrap_or_default();
        let submit = || {
            // SAFETY: the caller guarantees it.
            let request = unsafe { Request::read(options) }?;
            // Checked before the snapshot, which takes time.
            drop(renderer.lock()?);
            JobObject::start(renderer, Snapshot::of(scene), request)
        };
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(job, "job", submit) }
    })
}

/// Tells whether a job is done. camlux_job_wait then returns without waiting.
///
/// \param is_done receives 1, or 0 while the job is rendering.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; it never waits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_job_poll(job: *mut camlux_job, is_done: *mut i32) -> camlux_status {
    ffi_guard("camlux_job_poll", || {
        let job = handle::get(job)?;
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(is_done, "is_done", || Ok(job.is_done().into())) }
    })
}

/// Waits until a job is done, but no longer than a given time.
///
/// \param milliseconds the longest time to wait, 0 or more; +infinity: until the job is done.
/// \param is_done receives 1, or 0 if the job is still rendering after that time.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_BUSY on the job's own thread, in a callback.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_job_wait_for(
    job: *mut camlux_job,
    milliseconds: f64,
    is_done: *mut i32,
) -> camlux_status {
    ffi_guard("camlux_job_wait_for", || {
        let job = handle::get(job)?;
        let wait = || {
            if milliseconds.is_nan() || milliseconds < 0.0 {
                let problem = format!("milliseconds is {milliseconds}; give 0 or more");
                return Err(Failure::argument(problem));
            }
            job.refuse_own_thread()?;
            // Whatever is longer than the largest duration never ends.
            let limit = Duration::try_from_secs_f64(milliseconds / 1e3).unwrap_or(Duration::MAX);
            Ok(job.end.wait(limit).into())
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(is_done, "is_done", wait) }
    })
}

/// Waits until a job is done, and returns its frame. The frame can be taken only once.
///
/// \param frame receives the handle, with one reference; release it with camlux_frame_release.
/// \errors those of camlux_renderer_render: how the render ended, at every call; CAMLUX_ERROR_INVALID_ARGUMENT if the frame was already
/// taken; CAMLUX_ERROR_BUSY on the job's own thread, in a callback.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_job_wait(
    job: *mut camlux_job,
    frame: *mut *mut camlux_frame,
) -> camlux_status {
    ffi_guard("camlux_job_wait", || {
        let job = handle::get(job)?;
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(frame, "frame", || job.wait()) }
    })
}

impl JobObject {
    fn start(
        renderer: Arc<RendererObject>,
        snapshot: Snapshot,
        request: Request,
    ) -> Outcome<JobObject> {
        let abandoned = request.abandoned.clone();
        let end = Arc::<End>::default();
        let (began, begins) = mpsc::channel();
        let reached = EndOnDrop(end.clone());
        let render = move || {
            let _reached = reached;
            // From here on this job holds the renderer.
            let lock = match renderer.lock() {
                Ok(lock) => lock,
                Err(failure) => {
                    let _ = began.send(Err(failure));
                    return Err(Failure::from(crate::Error::Cancelled));
                }
            };
            let _ = began.send(Ok(()));
            let render = AssertUnwindSafe(|| renderer.render_one(lock, snapshot, &request));
            catch_unwind(render).unwrap_or_else(|panic| Err(failure_of(panic)))
        };
        let thread = thread::Builder::new().name("camlux job".into());
        let thread = thread.spawn(render).map_err(|error| {
            let problem = format!("no thread can be started for the job ({error}); wait for other jobs, then try again");
            Failure::new(CAMLUX_ERROR_OUT_OF_MEMORY, problem)
        })?;
        let ended = || Failure::from(crate::Error::internal("a job ended before it began"));
        begins.recv().map_err(|_| ended())??;
        Ok(JobObject {
            abandoned,
            end,
            thread: thread.thread().id(),
            state: Mutex::new(State::Running(thread)),
        })
    }

    fn is_done(&self) -> bool {
        self.end.wait(Duration::ZERO)
    }

    fn refuse_own_thread(&self) -> Outcome {
        if self.thread != thread::current().id() {
            return Ok(());
        }
        let problem = "a job cannot wait for itself; wait on another thread";
        Err(Failure::new(CAMLUX_ERROR_BUSY, problem))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait(&self) -> Outcome<FrameObject> {
        self.refuse_own_thread()?;
        let mut state = self.state();
        match std::mem::replace(&mut *state, State::Taken) {
            State::Running(thread) => {
                let ended = thread.join();
                let ended = ended.unwrap_or_else(|panic| Err(failure_of(panic)));
                if let Err(Failure { status, message }) = &ended {
                    *state = State::Failed(*status, message.clone());
                }
                ended
            }
            State::Failed(status, message) => {
                *state = State::Failed(status, message.clone());
                Err(Failure::new(status, message))
            }
            State::Taken => Err(Failure::argument(
                "the job has already returned its frame; keep the frame of the first camlux_job_wait",
            )),
        }
    }
}

impl End {
    /// Waits for the end, at most for a time. Returns whether it is reached.
    fn wait(&self, limit: Duration) -> bool {
        let is_reached = self
            .is_reached
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let is_going_on = |is_reached: &mut bool| !*is_reached;
        let waited = self
            .reached
            .wait_timeout_while(is_reached, limit, is_going_on);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

/// Announces the end of a render, however it ends.
struct EndOnDrop(Arc<End>);

impl Drop for EndOnDrop {
    fn drop(&mut self) {
        let is_reached = self.0.is_reached.lock();
        *is_reached.unwrap_or_else(PoisonError::into_inner) = true;
        self.0.reached.notify_all();
    }
}

impl Drop for JobObject {
    /// Waits for the render to end: a program that has released everything can then unload the library.
    fn drop(&mut self) {
        self.abandoned.cancel();
        let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let State::Running(thread) = std::mem::replace(state, State::Taken)
            && self.thread != thread::current().id()
        {
            // Nobody needs the result any more.
            let _ = thread.join();
        }
    }
}
