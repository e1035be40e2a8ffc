//! What gathers indirect light at a list of receivers: one implementation for each estimator.

use super::{
    gbuffer::GBuffer,
    light_rays::MAX_RAYS,
    receivers::{ReceiverRange, Receivers},
    sample_counts::SampleCounts,
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{Allocate, Buffer, BufferUse, shaders::Module},
};

/// Receivers that share a set of rays from the lights, and their samples, at most.
const MAX_SHARING_RECEIVERS: u32 = 4096;
const MAX_SHARED_SAMPLES: u32 = 32 * MAX_RAYS;

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

    /// Until `learn`, what is gathered is a pilot of so many results, a packet of samples each: half for the image, half for estimates.
    fn begin_pilot(&mut self, _results: u32) -> Result<()> {
        Ok(())
    }

    /// Learns from the pilot how to sample. Returns the share of the samples that this changes.
    fn learn(&mut self, _results: u32) -> Result<f64> {
        Ok(0.0)
    }

    /// Gathers at receivers of a list, which are pixels of a G-buffer. `proceed` is called between submissions with the share of the work that is done; its
    /// error ends the gather.
    fn gather(
        &mut self,
        receivers: (&GBuffer, &Receivers, ReceiverRange),
        results: Results,
        samples: Option<Samples>,
        proceed: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<()>;
}

/// Where the results of a gather go: vectors as `shaders/refinement.wgsl` has them, for receivers from `first` on. Gathers with noise
/// leave sums over their samples.
#[derive(Clone, Copy)]
pub(crate) struct Results<'r> {
    pub buffer: &'r Buffer,
    pub first: u32,
    /// To what is there.
    pub adds: bool,
}

impl Results<'_> {
    /// Room for the results of so many receivers.
    pub fn room<A: Allocate>(allocate: &A, plan: &Plan, receiver_count: u32) -> Result<A::Buffer> {
        let vectors = Results::vectors(plan)?;
        let bytes = u64::from(receiver_count * vectors) * size_of::<[f32; 4]>() as u64;
        allocate.buffer("gathered light", bytes, BufferUse::Device)
    }

    /// Of each receiver.
    pub fn vectors(plan: &Plan) -> Result<u32> {
        let words = [plan.brdf_word(), "exact", plan.phasor_word()];
        Module::find("scatter", &words)?.constant("RESULT_VECTORS")
    }
}

/// The samples of a gather, where there is a choice.
#[derive(Clone, Copy)]
pub(crate) struct Samples<'s> {
    /// As the receivers are listed.
    pub counts: &'s SampleCounts,
    /// Another number: other samples. The same: a receiver goes on where it stopped.
    pub seed: u32,
    pub light_rays: LightRaySets,
}

/// The rays from the lights that receivers share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LightRaySets {
    /// Another number: other rays.
    pub seed: u32,
    pub gathered_for: GatheredFor,
    /// Of a receiver, about.
    pub samples: u32,
    /// Receivers with other numbers, modulo this, in their list have no samples in common.
    pub set_count: u32,
}

/// What a gather is for. Each samples the lights by densities of its own, learned from gathers of its own: what one has not found the
/// other may.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GatheredFor {
    Image,
    Estimate,
}

impl LightRaySets {
    /// Receivers that may share a set, of so many samples each: more, and the set's own noise would show.
    pub fn max_receivers(samples: u32) -> u32 {
        (MAX_SHARED_SAMPLES / samples.max(1)).clamp(1, MAX_SHARING_RECEIVERS)
    }
}
