//! What gathers indirect light at a list of receivers: one implementation for each estimator.

use super::receivers::{ReceiverRange, Receivers};
use crate::{
    Result,
    vulkan::{Allocate, Buffer, BufferUse},
};

/// Gathers indirect light.
pub(crate) trait Gatherer {
    /// The name of its pass.
    fn pass(&self) -> &'static str;

    /// Whether the number of samples makes no difference: gathers have no noise.
    fn is_exact(&self) -> bool;

    /// Whether gathering few pixels can be faster than gathering all.
    fn may_interpolate(&self) -> bool {
        true
    }

    /// Until `learn`, what is gathered is a pilot of so many results.
    fn begin_pilot(&mut self, _results: u32, _samples: u32) -> Result<()> {
        Ok(())
    }

    /// Learns from the pilot how to sample. Returns the share of the samples that this changes.
    fn learn(&mut self, _results: u32, _samples: u32) -> Result<f64> {
        Ok(0.0)
    }

    /// Gathers at receivers of a list. `proceed` is called between submissions with the share of the work that is done; its
    /// error ends the gather.
    fn gather(
        &mut self,
        receivers: (&Receivers, ReceiverRange),
        results: Results,
        samples: Samples,
        proceed: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<()>;
}

/// Where the results of a gather go: two vectors a receiver, diffuse and specular, from `first` on.
#[derive(Clone, Copy)]
pub(crate) struct Results<'r> {
    pub buffer: &'r Buffer,
    pub first: u32,
}

impl Results<'_> {
    /// Room for the results of so many receivers.
    pub fn room<A: Allocate>(allocate: &A, receiver_count: u32) -> Result<A::Buffer> {
        let bytes = u64::from(receiver_count) * 2 * size_of::<[f32; 4]>() as u64;
        allocate.buffer("gathered light", bytes, BufferUse::Device)
    }
}

/// The samples of a gather, where there is a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Samples {
    pub count: u32,
    /// Another number: other samples.
    pub seed: u32,
    /// Receivers with other numbers, modulo this, in their list have no samples in common.
    pub set_count: u32,
}
