//! How a call ends: statuses, the thread's message, and the frame around every function.

use std::{
    cell::{Cell, RefCell},
    ffi::{CStr, CString, c_char},
    panic::{self, AssertUnwindSafe},
    sync::Once,
};

use super::log::{self, CAMLUX_LOG_ERROR, CAMLUX_LOG_INFO};
use crate::Error;

/// How a call ended: CAMLUX_OK, CAMLUX_CANCELLED (above 0), or one of the errors (below 0).
///
/// A call that ends in an error has changed nothing: no scene, no handle, nothing that its arguments point to.
pub type camlux_status = i32;

/// Done.
pub const CAMLUX_OK: i32 = 0;
/// The render was stopped by camlux_renderer_cancel or by its progress callback. There is no frame.
pub const CAMLUX_CANCELLED: i32 = 1;
/// A handle is NULL, was released, is of another kind, or was never one.
pub const CAMLUX_ERROR_INVALID_HANDLE: i32 = -1;
/// An argument is NULL, out of its range, misaligned, not finite, no UTF-8, or a struct of a wrong size.
pub const CAMLUX_ERROR_INVALID_ARGUMENT: i32 = -2;
/// A part of a scene, or a file that it is read from, is not usable.
pub const CAMLUX_ERROR_SCENE: i32 = -3;
/// The scene asks for more than the device has.
pub const CAMLUX_ERROR_DEVICE_LIMIT: i32 = -4;
/// There is no Vulkan driver, or no device that camlux can use.
pub const CAMLUX_ERROR_NO_DEVICE: i32 = -5;
/// A Vulkan call failed.
pub const CAMLUX_ERROR_VULKAN: i32 = -6;
/// Memory of the device or of the host ran out.
pub const CAMLUX_ERROR_OUT_OF_MEMORY: i32 = -7;
/// A file could not be written. Nothing is left under its name, or what was there before.
pub const CAMLUX_ERROR_OUTPUT: i32 = -8;
/// What the call needs is in use: a renderer renders one frame at a time.
pub const CAMLUX_ERROR_BUSY: i32 = -9;
/// camlux contradicts itself: please report it with the message. The handles stay usable.
pub const CAMLUX_ERROR_INTERNAL: i32 = -10;
/// The driver gave the device up; the message says in which pass. Release what came from the device, and create it anew.
pub const CAMLUX_ERROR_DEVICE_LOST: i32 = -11;

/// A call that fails.
pub(super) struct Failure {
    pub status: camlux_status,
    pub message: String,
}

pub(super) type Outcome<T = ()> = Result<T, Failure>;

impl Failure {
    pub fn argument(message: impl Into<String>) -> Failure {
        Failure {
            status: CAMLUX_ERROR_INVALID_ARGUMENT,
            message: message.into(),
        }
    }

    pub fn memory(what: &str, count: usize) -> Failure {
        Failure {
            status: CAMLUX_ERROR_OUT_OF_MEMORY,
            message: format!("there is no memory for {count} {what}; give fewer"),
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Failure {
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
        Failure {
            status,
            message: error.to_string(),
        }
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
    /// Whether this thread is inside a call, and what its panic said.
    static IN_CALL: Cell<bool> = const { Cell::new(false) };
    static PANIC: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// The message of this thread's latest call that did not end with CAMLUX_OK: what is wrong, where, and how to mend it, in
/// UTF-8. An empty string before the first; never NULL.
///
/// \return a string of the library, valid until this thread's next call that does not end with CAMLUX_OK.
/// \threads any; each thread has its own.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_last_error() -> *const c_char {
    const NONE: &CStr = c"";
    // A thread that is being torn down has no message any more.
    let message = LAST_ERROR.try_with(|message| message.borrow().as_ptr());
    message.unwrap_or(NONE.as_ptr())
}

/// What a status stands for, such as "invalid handle"; "unknown status" for a number that is none.
///
/// \return a string of the library, valid for ever.
/// \threads any.
#[unsafe(no_mangle)]
pub extern "C" fn camlux_status_text(status: camlux_status) -> *const c_char {
    let text = match status {
        CAMLUX_OK => c"ok",
        CAMLUX_CANCELLED => c"cancelled",
        CAMLUX_ERROR_INVALID_HANDLE => c"invalid handle",
        CAMLUX_ERROR_INVALID_ARGUMENT => c"invalid argument",
        CAMLUX_ERROR_SCENE => c"unusable scene",
        CAMLUX_ERROR_DEVICE_LIMIT => c"over a limit of the device",
        CAMLUX_ERROR_NO_DEVICE => c"no usable device",
        CAMLUX_ERROR_VULKAN => c"Vulkan call failed",
        CAMLUX_ERROR_OUT_OF_MEMORY => c"out of memory",
        CAMLUX_ERROR_OUTPUT => c"file cannot be written",
        CAMLUX_ERROR_BUSY => c"in use",
        CAMLUX_ERROR_INTERNAL => c"internal error",
        _ => c"unknown status",
    };
    text.as_ptr()
}

/// The frame around every call.
pub(super) fn entry(call: &str, body: impl FnOnce() -> Outcome) -> camlux_status {
    keep_panics_quiet();
    // Calls come from inside of calls, in callbacks.
    let was_in_call = IN_CALL.replace(true);
    let ended = panic::catch_unwind(AssertUnwindSafe(|| {
        #[cfg(test)]
        super::tests::panic_where_asked();
        body()
    }));
    IN_CALL.set(was_in_call);
    match ended {
        Ok(Ok(())) => CAMLUX_OK,
        Ok(Err(failure)) => end_with(call, failure),
        Err(payload) => {
            // A payload's own drop may panic, out here where nothing catches it.
            std::mem::forget(payload);
            let said = PANIC.take().unwrap_or_else(|| "a panic".into());
            let problem = Error::Internal { problem: said };
            end_with(call, problem.into())
        }
    }
}

fn end_with(call: &str, failure: Failure) -> camlux_status {
    let message = format!("{call}: {}", failure.message);
    let level = match failure.status {
        CAMLUX_CANCELLED => CAMLUX_LOG_INFO,
        _ => CAMLUX_LOG_ERROR,
    };
    log::write(level, || message.clone());
    let _ = LAST_ERROR.try_with(|last| last.replace(c_string(&message)));
    failure.status
}

/// Text for C; what follows a NUL, which only a host's own name can hold, is cut off.
pub(super) fn c_string(text: &str) -> CString {
    let until_nul = text.split('\0').next().unwrap_or_default();
    CString::new(until_nul).unwrap_or_default()
}

/// The library prints nothing: a panic inside a call goes into its message. Others go where they went before.
fn keep_panics_quiet() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if IN_CALL.try_with(Cell::get) != Ok(true) {
                return others(info);
            }
            let payload = info.payload();
            let said = payload.downcast_ref::<&str>().copied();
            let said = said.or(payload.downcast_ref::<String>().map(String::as_str));
            let said = said.unwrap_or("a panic");
            let place = info.location().map(|place| format!(" at {place}"));
            let text = format!("{said}{}", place.unwrap_or_default());
            let _ = PANIC.try_with(|panic| panic.replace(Some(text)));
        }));
    });
}
