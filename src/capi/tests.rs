//! Tests that need to look inside; the others call the interface, in `tests/capi_*.rs` and `tests/c`.

use std::cell::Cell;

thread_local! {
    static PANICS: Cell<bool> = const { Cell::new(false) };
}

/// What goes wrong in a test instead of a call's own work.
pub(super) fn panic_where_asked() {
    assert!(!PANICS.get(), "asked for by a test");
}
