//! Jobs: renders that go on while the host does something else.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError, mpsc},
    thread::{self, JoinHandle},
};

use super::*;

/// A render on a thread of its own.
pub(super) struct JobObject {
    /// Cancelled with the job's last handle.
    abandoned: Arc<CancelToken>,
    state: Mutex<State>,
}

enum State {
    /// Or done, and nobody has asked yet.
    Running(JoinHandle<Outcome<FrameObject>>),
    Failed(camlux_status, String),
    /// The frame has been handed out.
    Taken,
}

/// Begins to render a frame of a scene as it is at the time of the call, on a thread of its own, and returns. It is what
/// camlux_renderer_render renders, which is CAMLUX_ERROR_BUSY on this renderer until the job is done: for more at once, make more renderers.
///
/// The progress callback, and the log's messages of this render, come on the job's thread; what the options point to must be there until
/// the job is done.
///
/// \param options NULL: those of CAMLUX_RENDER_OPTIONS_INIT.
/// \param job receives the handle, with one reference: give it back by camlux_job_release.
/// \errors CAMLUX_ERROR_BUSY where the renderer is rendering; CAMLUX_ERROR_OUT_OF_MEMORY where no thread can be started;
/// CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT. How the render itself ends, camlux_job_wait says.
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
        // SAFETY: the caller's word.
        let options = unsafe { args::read_optional(options) }?.unwrap_or_default();
        let submit = || {
            // SAFETY: the caller's word.
            let request = unsafe { Request::read(options) }?;
            // Before the snapshot, which takes time.
            drop(renderer.lock()?);
            JobObject::start(renderer, Snapshot::of(scene), request)
        };
        // SAFETY: the caller's word.
        unsafe { handle::return_handle(job, "job", submit) }
    })
}

/// Whether a job is done, so that camlux_job_wait will not wait.
///
/// \param is_done receives 1, or 0 while the job renders.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any; it never waits.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_job_poll(job: *mut camlux_job, is_done: *mut i32) -> camlux_status {
    ffi_guard("camlux_job_poll", || {
        let job = handle::get(job)?;
        // SAFETY: the caller's word.
        unsafe { args::write_result(is_done, "is_done", || Ok(job.is_done().into())) }
    })
}

/// Waits until a job is done, and hands its frame out, once.
///
/// \param frame receives the handle, with one reference: give it back by camlux_frame_release.
/// \errors those of camlux_renderer_render, as the render has ended, each time; CAMLUX_ERROR_INVALID_ARGUMENT where the frame has been handed
/// out; CAMLUX_ERROR_BUSY on the job's own thread, in a callback.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_job_wait(
    job: *mut camlux_job,
    frame: *mut *mut camlux_frame,
) -> camlux_status {
    ffi_guard("camlux_job_wait", || {
        let job = handle::get(job)?;
        // SAFETY: the caller's word.
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
        let (began, begins) = mpsc::channel();
        let render = move || {
            // From here on the renderer is this job's.
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
            let problem = format!("no thread can be started for the job ({error})");
            Failure::new(CAMLUX_ERROR_OUT_OF_MEMORY, problem)
        })?;
        let ended = || Failure::from(crate::Error::internal("a job ended before it began"));
        begins.recv().map_err(|_| ended())??;
        Ok(JobObject {
            abandoned,
            state: Mutex::new(State::Running(thread)),
        })
    }

    fn is_done(&self) -> bool {
        match self.state.try_lock() {
            Ok(state) => state.is_done(),
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner().is_done(),
            // Another thread waits for it.
            Err(TryLockError::WouldBlock) => false,
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait(&self) -> Outcome<FrameObject> {
        let mut state = self.state();
        if let State::Running(thread) = &*state
            && thread.thread().id() == thread::current().id()
        {
            let problem = "a job cannot wait for itself; wait on another thread";
            return Err(Failure::new(CAMLUX_ERROR_BUSY, problem));
        }
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
                "the job's frame has been handed out; keep it",
            )),
        }
    }
}

impl State {
    fn is_done(&self) -> bool {
        match self {
            State::Running(thread) => thread.is_finished(),
            State::Failed(..) | State::Taken => true,
        }
    }
}

impl Drop for JobObject {
    /// The render ends first: a program that has released all can unload the library.
    fn drop(&mut self) {
        self.abandoned.cancel();
        let state = self.state.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let State::Running(thread) = std::mem::replace(state, State::Taken)
            && thread.thread().id() != thread::current().id()
        {
            // How it has ended nobody asks any more.
            let _ = thread.join();
        }
    }
}
