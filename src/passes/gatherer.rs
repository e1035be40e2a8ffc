//! The interface for gathering indirect light at a list of receivers, with one implementation per estimator.

use super::{
    gbuffer::GBuffer, receivers::ListedReceivers, refinement::RefinementImages,
    sample_counts::SampleCounts, scatter,
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{Allocate, Buffer, BufferUse},
};

/// Most rays from the lights, of all sets together.
pub(super) const MAX_LIGHT_RAYS: u32 = 1 << 18;
/// Most sets of rays from the lights at a time.
pub(crate) const MOST_SETS: u32 = 16;
/// Upper limits of the receivers that share a set of rays from the lights, and of their samples together.
const MAX_SHARING_RECEIVERS: u32 = 4096;
const MAX_SHARED_SAMPLES: u32 = 32 * MAX_LIGHT_RAYS;

/// Rays from the lights per VPL sample of a receiver. With this many, the error that receivers share is small compared with
/// the error of each receiver alone.
const LIGHT_RAYS_PER_SAMPLE: u32 = 128;
/// The same for each set, if there are several sets.
const LIGHT_RAYS_PER_SAMPLE_OF_A_SET: u32 = 8;
/// Least number of rays in a set, so that the cells that matter get some; and in a set of the pilot, so that it distinguishes parts of cells.
const MIN_SET_SIZE: u32 = 1 << 11;
const PILOT_SET_SIZE: u32 = 1 << 15;
/// The same for few receivers, and the rays for each of them.
const MIN_SET_SIZE_OF_FEW: u32 = 1 << 8;
const PILOT_SET_SIZE_OF_FEW: u32 = 1 << 12;
const RAYS_PER_RECEIVER: u32 = 128;

/// Gathers indirect light.
pub(crate) trait Gatherer {
    /// The name of the gatherer's pass.
    fn pass(&self) -> &'static str;

    /// Whether gathers have no noise, so that the number of samples makes no difference.
    fn is_noiseless(&self) -> bool;

    /// Whether gathering few pixels can be faster than gathering all.
    fn may_interpolate(&self) -> bool {
        true
    }

    /// Begins a pilot of this many results, with one packet of samples each. It lasts until `learn`. Half of the results are for the image,
    /// half for estimates.
    fn begin_pilot(&mut self, _results: u32) -> Result<()> {
        Ok(())
    }

    /// Learns from the pilot how to sample. Returns the share of the samples that this changes.
    fn learn(&mut self, _results: u32) -> Result<f64> {
        Ok(0.0)
    }

    /// Fills the light of VPLs without occlusion. Returns whether there are any. `proceed` is called between submissions; its error ends this.
    fn fill_unoccluded(
        &mut self,
        _gbuffer: &GBuffer,
        _images: &RefinementImages,
        _proceed: &mut dyn FnMut() -> Result<()>,
    ) -> Result<bool> {
        Ok(false)
    }

    /// From here on, gathers of the image send rays to VPLs, or only along directions. Those of estimates always do both.
    fn send_to_vpls(&mut self, _sends: bool) {}

    /// Gathers at receivers. `proceed` is called between submissions with the share of the work that is done; its error ends the gather.
    fn gather(
        &mut self,
        receivers: ListedReceivers,
        results: Results,
        samples: Option<Samples>,
        proceed: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<()>;
}

/// Where the results of a gather go: vectors in the layout of `shaders/shared/refinement.wgsl`, for receivers from `first` on.
/// Gathers with noise store sums over their samples.
#[derive(Clone, Copy)]
pub(crate) struct Results<'r> {
    pub buffer: &'r Buffer,
    pub first: u32,
}

impl Results<'_> {
    /// Allocates room for the results of `receiver_count` receivers.
    pub fn room<A: Allocate>(allocate: &A, plan: &Plan, receiver_count: u32) -> Result<A::Buffer> {
        let vectors = Results::vectors(plan)?;
        let bytes = u64::from(receiver_count * vectors) * size_of::<[f32; 4]>() as u64;
        allocate.buffer("gathered light", bytes, BufferUse::Device)
    }

    /// Result vectors per receiver.
    pub fn vectors(plan: &Plan) -> Result<u32> {
        let scatter = scatter::key(plan, false, false);
        scatter.module().constant("RESULT_VECTORS")
    }
}

/// The samples of a gather, if the gatherer has noise.
#[derive(Clone, Copy)]
pub(crate) struct Samples<'s> {
    /// In the order in which the receivers are listed.
    pub counts: &'s SampleCounts,
    /// Another seed gives other samples. With the same seed, a receiver continues where it stopped.
    pub seed: u32,
    pub light_rays: LightRaySets,
}

/// The rays from the lights that receivers share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LightRaySets {
    /// Another seed gives other rays.
    pub seed: u32,
    pub gathered_for: GatheredFor,
    /// Approximate number of samples of a receiver.
    pub samples: u32,
    /// Most receivers, of all sets together.
    pub receivers: u32,
    /// Receivers whose indices in their list differ modulo this number have no samples in common.
    pub set_count: u32,
}

/// What a gather is for. Each purpose samples the lights by its own densities, learned from its own gathers:
/// what one has missed, the other may find.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GatheredFor {
    Image,
    Estimate,
}

impl LightRaySets {
    /// Rays of a set, about.
    pub fn set_size(&self, is_pilot: bool) -> u32 {
        let per_sample = match self.set_count {
            1 => LIGHT_RAYS_PER_SAMPLE,
            _ => LIGHT_RAYS_PER_SAMPLE_OF_A_SET,
        };
        let (few, enough) = match is_pilot {
            true => (PILOT_SET_SIZE_OF_FEW, PILOT_SET_SIZE),
            false => (MIN_SET_SIZE_OF_FEW, MIN_SET_SIZE),
        };
        let receivers = self.receivers.div_ceil(self.set_count);
        let at_least = receivers.saturating_mul(RAYS_PER_RECEIVER);
        let set_size = self.samples.saturating_mul(per_sample);
        set_size
            .max(at_least.clamp(few, enough))
            .min(MAX_LIGHT_RAYS / self.set_count)
    }

    /// Most receivers that may share a set, with `samples` samples each. With more, the set's own noise would show.
    pub fn max_receivers(samples: u32) -> u32 {
        (MAX_SHARED_SAMPLES / samples.max(1)).clamp(1, MAX_SHARING_RECEIVERS)
    }
}
