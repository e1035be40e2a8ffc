//! Replaces `faults.rs` without the feature `test-hooks`: no failure is injected.

#[derive(Debug, Default)]
pub(super) struct Faults {}

impl Faults {
    pub fn next_call_fails(&self, _name: &str) -> bool {
        false
    }

    pub fn next_submission_ends_in(&self) -> Option<usize> {
        None
    }

    pub fn has_no_timestamps(&self) -> bool {
        false
    }

    pub fn poisons_memory(&self) -> bool {
        false
    }

    pub fn ends_in(&self, _name: &str) -> bool {
        false
    }
}
