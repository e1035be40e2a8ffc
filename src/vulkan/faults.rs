//! Failures on purpose: what a driver may answer to any call, so that tests can see what becomes of it.

use std::sync::{
    Mutex,
    atomic::{AtomicBool, Ordering::Relaxed},
};

use super::lock;

/// What is to go wrong. All places are counted from 0, from when it was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// A call that can run out of memory does: one that makes something, binds, records, submits or waits, or an allocation.
    /// Only calls of `function` are counted, where one is named.
    OutOfMemory {
        function: Option<&'static str>,
        call: u64,
    },
    /// A submission ends with the loss of the device, and what it holds behind one of its passes never ran.
    DeviceLost { submission: u64, pass: usize },
    /// The same in the first pass of a name.
    DeviceLostIn { pass: &'static str },
    /// The queue takes no timestamps.
    NoTimestamps,
}

/// What there was since a fault was last asked for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FaultCount {
    /// Calls that can run out of memory, and allocations.
    pub calls: u64,
    pub submissions: u64,
}

#[derive(Debug, Default)]
pub(super) struct Faults {
    asked: Mutex<(Option<Fault>, FaultCount)>,
    poisons_memory: AtomicBool,
}

impl Faults {
    /// Asks for a fault, or for none, and counts from here on.
    pub fn ask(&self, fault: Option<Fault>) {
        self.with(|state, count| (*state, *count) = (fault, FaultCount::default()));
    }

    pub fn count(&self) -> FaultCount {
        self.with(|_, count| *count)
    }

    /// Counts a call. Whether it is to run out of memory.
    pub fn next_call_fails(&self, name: &'static str) -> bool {
        self.with(|fault, count| {
            count.calls += 1;
            match fault {
                Some(Fault::OutOfMemory { function, call })
                    if function.is_none_or(|function| function == name) =>
                {
                    let is_due = *call == 0;
                    // Once it has come, it is over.
                    *call = call.wrapping_sub(1);
                    is_due
                }
                _ => false,
            }
        })
    }

    /// Counts a submission. The last of its passes that runs, where the device is to be lost in it.
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

    /// From here on new buffers and images hold NaN in place of what a driver leaves there, which most often is 0.
    pub fn poison_memory(&self) {
        self.poisons_memory.store(true, Relaxed);
    }

    pub fn poisons_memory(&self) -> bool {
        self.poisons_memory.load(Relaxed)
    }

    fn with<T>(&self, use_it: impl FnOnce(&mut Option<Fault>, &mut FaultCount) -> T) -> T {
        let mut state = lock(&self.asked);
        let (fault, count) = &mut *state;
        use_it(fault, count)
    }
}
