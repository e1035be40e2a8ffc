//! Vulkan drivers and pools of threads do not survive `fork`: a forked process that uses them waits for ever. Each use is refused instead.

use std::sync::atomic::{AtomicU32, Ordering};

use pyo3::prelude::*;

use crate::errors::DeviceError;

/// The process that first used a driver or a pool; 0: none has.
static USED_IN: AtomicU32 = AtomicU32::new(0);

/// Begins such a use.
///
/// Raises DeviceError in a process that was forked from one that has used camlux.
pub fn begin() -> PyResult<()> {
    let here = std::process::id();
    let before = USED_IN.compare_exchange(0, here, Ordering::Relaxed, Ordering::Relaxed);
    match before {
        Err(before) if before != here => Err(DeviceError::new_err(format!(
            "process {here} was forked from process {before}, which has used camlux, and devices do not survive a fork; \
             start processes by spawn, such as multiprocessing.get_context(\"spawn\") or DataLoader(..., multiprocessing_context=\"spawn\"), \
             and make a Renderer in each"
        ))),
        _ => Ok(()),
    }
}

/// A value of the driver that only the process that made it uses and drops.
pub struct OfProcess<T>(Option<T>);

impl<T> OfProcess<T> {
    pub fn new(value: T) -> Self {
        OfProcess(Some(value))
    }

    pub fn get(&self) -> PyResult<&T> {
        begin()?;
        let gone = || DeviceError::new_err("the device is gone");
        self.0.as_ref().ok_or_else(gone)
    }
}

impl<T> Drop for OfProcess<T> {
    fn drop(&mut self) {
        // To drop it, the driver would wait for its threads, which a forked process does not have.
        if begin().is_err() {
            std::mem::forget(self.0.take());
        }
    }
}
