//! How a call ends: statuses, the thread's message, and the guard around every function.

use std::{
    any::Any,
    cell::RefCell,
    ffi::{CStr, CString, c_char},
    panic::{self, AssertUnwindSafe},
};

use super::*;
use crate::Error;

/// How a call ended: CAMLUX_OK, CAMLUX_CANCELLED (above 0), or one of the errors (below 0).
///
/// A call that ends in an error has changed nothing: no scene, no handle, and nothing that its arguments point to.
pub type camlux_status = i32;

/// The call succeeded.
pub const CAMLUX_OK: i32 = 0;
/// The render was stopped by its cancel token or by its progress callback. There is no frame.
pub const CAMLUX_CANCELLED: i32 = 1;
/// A handle is NULL, was released, is of another kind, or was never one.
pub const CAMLUX_ERROR_INVALID_HANDLE: i32 = -1;
/// The arguments have a wrong form: a pointer that is NULL or misaligned, a struct of a wrong size, a number that is not one of the
/// constants, a text that is not UTF-8, memory that is too small, an index or a layer that does not exist.
pub const CAMLUX_ERROR_INVALID_ARGUMENT: i32 = -2;
/// The values are wrong for a scene: not finite, out of range, members of a part that do not go together or name another part that
/// does not exist, a file that cannot be read.
pub const CAMLUX_ERROR_SCENE: i32 = -3;
/// The scene needs more than the device has.
pub const CAMLUX_ERROR_DEVICE_LIMIT: i32 = -4;
/// There is no Vulkan driver, or no device that camlux can use.
pub const CAMLUX_ERROR_NO_DEVICE: i32 = -5;
/// A Vulkan call failed.
pub const CAMLUX_ERROR_VULKAN: i32 = -6;
/// Memory of the device or of the host ran out.
pub const CAMLUX_ERROR_OUT_OF_MEMORY: i32 = -7;
/// A file could not be written. A file of that name that existed before is unchanged; otherwise there is none.
pub const CAMLUX_ERROR_OUTPUT: i32 = -8;
/// What the call needs is in use: a renderer renders one frame at a time.
pub const CAMLUX_ERROR_BUSY: i32 = -9;
/// A bug in camlux: please report it with the message. The handles stay usable.
pub const CAMLUX_ERROR_INTERNAL: i32 = -10;
/// The driver reported a device loss; the message says in which pass. Release what came from the device, and create it again.
pub const CAMLUX_ERROR_DEVICE_LOST: i32 = -11;

const TEXTS: [(camlux_status, &CStr); 13] = [
    (CAMLUX_OK, c"ok"),
    (CAMLUX_CANCELLED, c"cancelled"),
    (CAMLUX_ERROR_INVALID_HANDLE, c"invalid handle"),
    (CAMLUX_ERROR_INVALID_ARGUMENT, c"invalid argument"),
    (CAMLUX_ERROR_SCENE, c"unusable scene"),
    (CAMLUX_ERROR_DEVICE_LIMIT, c"over a limit of the device"),
    (CAMLUX_ERROR_NO_DEVICE, c"no usable device"),
    (CAMLUX_ERROR_VULKAN, c"Vulkan call failed"),
    (CAMLUX_ERROR_OUT_OF_MEMORY, c"out of memory"),
    (CAMLUX_ERROR_OUTPUT, c"file cannot be written"),
    (CAMLUX_ERROR_BUSY, c"in use"),
    (CAMLUX_ERROR_INTERNAL, c"internal error"),
    (CAMLUX_ERROR_DEVICE_LOST, c"device lost"),
];

/// A call that fails.
pub(super) struct Failure {
    pub status: camlux_status,
    pub message: String,
}

pub(super) type Outcome<T = ()> = Result<T, Failure>;

impl Failure {
    pub fn new(status: camlux_status, message: impl Into<String>) -> Failure {
        Failure {
            status,
            message: message.into(),
        }
    }

    pub fn argument(message: impl Into<String>) -> Failure {
        Failure::new(CAMLUX_ERROR_INVALID_ARGUMENT, message)
    }

    /// Adds which of several items failed to the message.
    pub fn within(self, which: &str) -> Failure {
        Failure::new(self.status, format!("{which}: {}", self.message))
    }
}

impl From<Error> for Failure {
    /// In the words of C.
    fn from(error: Error) -> Failure {
        let failure = Failure::as_it_is(error);
        Failure {
            message: words::in_c(&failure.message),
            ..failure
        }
    }
}

impl Failure {
    /// In the words of the library, for the content of a file.
    pub fn as_it_is(error: Error) -> Failure {
        let status = match error {
            Error::Scene { .. } | Error::Input { .. } => CAMLUX_ERROR_SCENE,
            Error::DeviceLimit { .. } => CAMLUX_ERROR_DEVICE_LIMIT,
            Error::NoDevice { .. } => CAMLUX_ERROR_NO_DEVICE,
            Error::Vulkan { .. } => CAMLUX_ERROR_VULKAN,
            Error::DeviceLost { .. } => CAMLUX_ERROR_DEVICE_LOST,
            Error::Memory { .. } => CAMLUX_ERROR_OUT_OF_MEMORY,
            Error::Output { .. } => CAMLUX_ERROR_OUTPUT,
            Error::Internal { .. } => CAMLUX_ERROR_INTERNAL,
            Error::Cancelled => CAMLUX_CANCELLED,
        };
        Failure::new(status, error.to_string())
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

#[cfg(feature = "test-hooks")]
thread_local! {
    static BEFORE_EACH_CALL: std::cell::Cell<fn()> = const { std::cell::Cell::new(|| ()) };
}

/// Sets a hook that runs, and may panic, at the start of each of this thread's calls.
#[cfg(feature = "test-hooks")]
#[doc(hidden)]
pub fn before_each_call(hook: fn()) {
    BEFORE_EACH_CALL.set(hook);
}

/// The message of this thread's latest call that did not end with CAMLUX_OK: what is wrong, where, and how to fix it, in
/// UTF-8. An empty string before the first such call; never NULL.
///
/// \return a string of the library, valid until this thread's next call that does not end with CAMLUX_OK.
/// \threads any; each thread has its own.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_last_error() -> *const c_char {
    const NONE: &CStr = c"";
    // A thread that is ending has no message any more.
    let message = LAST_ERROR.try_with(|message| message.borrow().as_ptr());
    message.unwrap_or(NONE.as_ptr())
}

/// A short text for a status, such as "invalid handle"; "unknown status" for other numbers.
///
/// \return a static string of the library, always valid.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_status_text(status: camlux_status) -> *const c_char {
    let found = TEXTS.iter().find(|(known, _)| *known == status);
    found.map_or(c"unknown status", |(_, text)| text).as_ptr()
}

/// Runs a call of the interface and turns its failure or panic into the status and the message.
pub(super) fn ffi_guard(call: &str, body: impl FnOnce() -> Outcome) -> camlux_status {
    let ended = panic::catch_unwind(AssertUnwindSafe(|| {
        #[cfg(feature = "test-hooks")]
        BEFORE_EACH_CALL.get()();
        body()
    }));
    match ended {
        Ok(Ok(())) => CAMLUX_OK,
        Ok(Err(failure)) => end_with(call, failure),
        Err(payload) => end_with(call, failure_of(payload)),
    }
}

/// Turns the payload of a panic into a failure.
pub(super) fn failure_of(payload: Box<dyn Any + Send>) -> Failure {
    let text = payload.downcast_ref::<&str>().copied();
    let text = text.or(payload.downcast_ref::<String>().map(String::as_str));
    let problem = Error::internal(text.unwrap_or("a panic"));
    // A payload's own drop may panic, and nothing would catch it here.
    std::mem::forget(payload);
    problem.into()
}

fn end_with(call: &str, failure: Failure) -> camlux_status {
    let message = format!("{call}: {}", failure.message);
    let level = match failure.status {
        // Not an error: the host requested it, or can try again.
        CAMLUX_CANCELLED | CAMLUX_ERROR_BUSY => CAMLUX_LOG_INFO,
        _ => CAMLUX_LOG_ERROR,
    };
    log::write(level, || message.clone());
    let _ = LAST_ERROR.try_with(|last| last.replace(c_string(&message)));
    failure.status
}

/// Text for C, cut off at the first NUL. Only a name given by the host can contain one.
pub(super) fn c_string(text: &str) -> CString {
    let until_nul = text.split('\0').next().unwrap_or_default();
    CString::new(until_nul).unwrap_or_default()
}
