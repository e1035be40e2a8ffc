//! Injected failures: what a driver may return from any call, so that tests can check how camlux reacts.

use std::{
    path::{Path, PathBuf},
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
};

use super::lock;

/// The failure to inject. All indices start at 0 when the fault is requested.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// A call that can run out of memory does so: one that creates an object, binds, records, submits or waits, or an allocation. If
    /// `function` is named, only its calls are counted.
    OutOfMemory {
        function: Option<&'static str>,
        call: u64,
    },
    /// A submission ends with a device loss. Its passes after the given one never run.
    DeviceLost { submission: u64, pass: usize },
    /// The same in the first pass of this name.
    DeviceLostIn { pass: &'static str },
    /// The queue supports no timestamps.
    NoTimestamps,
}

/// Counts since the last requested fault.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FaultCount {
    /// Calls that can run out of memory, and allocations.
    pub calls: u64,
    pub submissions: u64,
    /// Bytes of compiled pipelines that the driver was given from a file.
    pub pipeline_bytes: usize,
}

#[derive(Debug, Default)]
pub(super) struct Faults {
    asked: Mutex<(Option<Fault>, FaultCount)>,
    poisons_memory: AtomicBool,
    pipeline_folder: Mutex<Option<PathBuf>>,
}

impl Faults {
    /// Requests a fault, or none, and restarts the counts.
    pub fn ask(&self, fault: Option<Fault>) {
        self.with(|state, count| (*state, *count) = (fault, FaultCount::default()));
    }

    pub fn count(&self) -> FaultCount {
        self.with(|_, count| *count)
    }

    /// Counts a call. Returns whether it must run out of memory.
    pub fn next_call_fails(&self, name: &'static str) -> bool {
        self.with(|fault, count| {
            count.calls += 1;
            match fault {
                Some(Fault::OutOfMemory { function, call })
                    if function.is_none_or(|function| function == name) =>
                {
                    let is_due = *call == 0;
                    // The fault occurs once.
                    *call = call.wrapping_sub(1);
                    is_due
                }
                _ => false,
            }
        })
    }

    /// Counts a submission. If the device is to be lost in it, returns the last pass that runs.
    pub fn next_submission_ends_in(&self) -> Option<usize> {
        self.with(|fault, count| {
            count.submissions += 1;
            match *fault {
                Some(Fault::DeviceLost { submission, pass })
                    if submission == count.submissions - 1 =>
                {
                    Some(pass)
                }
                _ => None,
            }
        })
    }

    /// Whether the device is to be lost in this pass.
    pub fn ends_in(&self, name: &str) -> bool {
        self.with(|fault, _| matches!(fault, Some(Fault::DeviceLostIn { pass }) if *pass == name))
    }

    pub fn has_no_timestamps(&self) -> bool {
        self.with(|fault, _| *fault == Some(Fault::NoTimestamps))
    }

    /// From here on, new buffers and images hold NaN instead of what the driver leaves there, which is usually 0.
    pub fn poison_memory(&self) {
        self.poisons_memory.store(true, Relaxed);
    }

    pub fn poisons_memory(&self) -> bool {
        self.poisons_memory.load(Relaxed)
    }

    pub fn keep_pipelines_in(&self, folder: &Path) {
        *lock(&self.pipeline_folder) = Some(folder.to_owned());
    }

    /// The folder that a test has named, and never the user's.
    pub fn pipeline_folder(&self, _of_user: impl FnOnce() -> Option<PathBuf>) -> Option<PathBuf> {
        lock(&self.pipeline_folder).clone()
    }

    pub fn note_pipelines(&self, bytes: usize) {
        self.with(|_, count| count.pipeline_bytes += bytes);
    }

    fn with<T>(&self, use_it: impl FnOnce(&mut Option<Fault>, &mut FaultCount) -> T) -> T {
        let mut state = lock(&self.asked);
        let (fault, count) = &mut *state;
        use_it(fault, count)
    }
}
