//! The log, which the host receives by a callback.

use std::{
    cell::Cell,
    ffi::{c_char, c_void},
    sync::{PoisonError, RwLock},
};

use super::*;

/// No messages.
pub const CAMLUX_LOG_OFF: i32 = 0;
/// Calls that failed, except those that were cancelled or found something in use.
pub const CAMLUX_LOG_ERROR: i32 = 1;
/// Also scenes that can be rendered but probably have a mistake, and messages of the validation layer.
pub const CAMLUX_LOG_WARNING: i32 = 2;
/// Also devices that are opened, frames that are rendered, with their times, renders that are cancelled, and calls that found
/// something in use.
pub const CAMLUX_LOG_INFO: i32 = 3;
/// Also the times of every pass.
pub const CAMLUX_LOG_DEBUG: i32 = 4;

/// Receives a message: its level (CAMLUX_LOG_ERROR to CAMLUX_LOG_DEBUG), its text in UTF-8, which is valid during the call
/// only, and the user pointer of camlux_set_log.
///
/// It is called on the thread whose call caused the message, and from several threads at once if several make calls. It may call
/// camlux, except camlux_set_log; these calls log no messages. It must return: no exception, no longjmp.
pub type camlux_log_callback =
    Option<unsafe extern "C" fn(level: i32, message: *const c_char, user: *mut c_void)>;

struct Sink {
    level: i32,
    callback: unsafe extern "C" fn(i32, *const c_char, *mut c_void),
    user: *mut c_void,
}

// SAFETY: the manual says that the callback is called, with its pointer, from any thread.
unsafe impl Send for Sink {}
// SAFETY: as above.
unsafe impl Sync for Sink {}

static SINK: RwLock<Option<Sink>> = RwLock::new(None);

thread_local! {
    static IN_CALLBACK: Cell<bool> = const { Cell::new(false) };
}

/// Sends the messages of this process, up to a level, to a callback. The library itself never prints.
///
/// When the call returns, the previous callback is not running and will not be called again. You can then free what its
/// user pointer points to.
///
/// \param level CAMLUX_LOG_OFF to CAMLUX_LOG_DEBUG.
/// \param callback NULL for none.
/// \param user passed to the callback; camlux does not read what it points to.
/// \errors CAMLUX_ERROR_INVALID_ARGUMENT for another level; CAMLUX_ERROR_BUSY inside a log callback.
/// \threads any; it waits for callbacks that are running.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_set_log(
    level: i32,
    callback: camlux_log_callback,
    user: *mut c_void,
) -> camlux_status {
    ffi_guard("camlux_set_log", || {
        if !(CAMLUX_LOG_OFF..=CAMLUX_LOG_DEBUG).contains(&level) {
            return Err(Failure::argument(format!(
                "level is {level}; give CAMLUX_LOG_OFF (0) to CAMLUX_LOG_DEBUG (4)"
            )));
        }
        if IN_CALLBACK.get() {
            let problem = "it was called inside a log callback; call it elsewhere";
            return Err(Failure::new(CAMLUX_ERROR_BUSY, problem));
        }
        let sink = callback
            .filter(|_| level > CAMLUX_LOG_OFF)
            .map(|callback| Sink {
                level,
                callback,
                user,
            });
        *SINK.write().unwrap_or_else(PoisonError::into_inner) = sink;
        Ok(())
    })
}

/// Whether the host receives messages of a level.
pub(super) fn is_wanted(level: i32) -> bool {
    if IN_CALLBACK.get() {
        return false;
    }
    let sink = SINK.read().unwrap_or_else(PoisonError::into_inner);
    sink.as_ref().is_some_and(|sink| level <= sink.level)
}

/// Passes a message to the host, if it receives messages of this level.
pub(super) fn write(level: i32, message: impl FnOnce() -> String) {
    // The lock is held while the callback runs: a message from inside it would deadlock.
    if IN_CALLBACK.try_with(Cell::get) != Ok(false) {
        return;
    }
    let sink = SINK.read().unwrap_or_else(PoisonError::into_inner);
    let Some(sink) = sink.as_ref().filter(|sink| level <= sink.level) else {
        return;
    };
    let message = c_string(&message());
    IN_CALLBACK.set(true);
    // SAFETY: set by `camlux_set_log`, which waits for this lock before it replaces the callback; the text outlives the call.
    unsafe { (sink.callback)(level, message.as_ptr(), sink.user) };
    IN_CALLBACK.set(false);
}
