//! Sets of light rays that receivers share.

/// The light rays that receivers of an attempt share, also in steps of few receivers.
#[derive(Default)]
pub(super) struct SharedLightRays {
    /// How many sets the attempt had before, and how many receivers share this one.
    set: u32,
    receivers: u32,
}

impl SharedLightRays {
    /// Begins another set with the next receivers.
    pub fn begin(&mut self) {
        self.receivers = u32::MAX;
    }

    /// The number of the set for so many more receivers, of which `most` may share one.
    pub fn set_for(&mut self, receivers: u32, most: u32) -> u32 {
        if self.receivers.saturating_add(receivers) > most {
            self.set += 1;
            self.receivers = 0;
        }
        self.receivers += receivers;
        self.set
    }
}
