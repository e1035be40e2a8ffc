//! The images, lists and buffers with which an image is refined.

use crate::{
    Result,
    passes::{
        gatherer::Results, receivers::Receivers, refinement::RefinementImages,
        sample_counts::SampleCounts,
    },
    plan::{GridStep, Plan},
    vulkan::{Allocate, Device},
};

/// Most vectors of results that there is room for.
pub(super) const MAX_RESULT_VECTORS: u32 = 1 << 21;

/// The images, lists and buffers of the refinement.
pub(crate) struct RefinementResources<A: Allocate = Device> {
    pub(super) steps: Vec<GridStep>,
    pub images: RefinementImages<A>,
    pub(super) receivers: Receivers<A>,
    pub(super) results: A::Buffer,
    /// Number of receivers whose results fit.
    pub(super) max_results: u32,
    /// Only if gathers have noise.
    pub(super) counts: Option<SampleCounts<A>>,
}

impl<A: Allocate> RefinementResources<A> {
    pub fn new(
        allocate: &A,
        plan: &Plan,
        coarsest_stride: u32,
        is_noiseless: bool,
    ) -> Result<RefinementResources<A>> {
        let steps = GridStep::all(coarsest_stride);
        let counts = steps
            .iter()
            .map(|step| step.pixel_count(plan.resolution_px));
        let most = counts.clone().max().unwrap_or(1);
        // The coarsest grid needs no list of candidates.
        let most_candidates = counts.skip(1).max().unwrap_or(0);
        let max_results = most.min(MAX_RESULT_VECTORS / Results::vectors(plan)?);
        Ok(RefinementResources {
            images: RefinementImages::new(allocate, plan, !is_noiseless)?,
            receivers: Receivers::new(allocate, most, most_candidates)?,
            counts: (!is_noiseless)
                .then(|| SampleCounts::new(allocate, most))
                .transpose()?,
            results: Results::room(allocate, plan, max_results)?,
            max_results,
            steps,
        })
    }

    /// From here on, begins with another stride, no less than the one that there is room for.
    pub fn begin_with(&mut self, stride: u32) {
        self.steps = GridStep::all(stride);
    }
}
