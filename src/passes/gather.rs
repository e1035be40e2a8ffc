//! Gather pass: indirect radiance, every receiver from every VPL of a light.
//!
//! The work is cut into submissions of bounded duration, so that no watchdog fires and the caller can cancel. The cuts
//! do not show: dispatches always cover the same runs of VPLs, and receivers do not depend on each other.

use std::time::{Duration, Instant};

use super::{
    Context,
    gbuffer::GBuffer,
    receivers::Receivers,
    vpl::{VplLists, estimator_word},
};
use crate::{
    Result,
    plan::GatherKernel,
    scene::Estimator,
    vulkan::{
        Image, PassTimes, Recorder, Resource,
        shaders::{GatherParameters, ListLengths},
    },
};

/// VPLs of one dispatch: their sum is added to the image. Fixed, for the order of summation must not depend on speed.
/// Also small, for lavapipe leaves a shader's loops after 65 535 iterations in all and says nothing.
const DISPATCH_VPLS: u32 = 4096;
/// Workgroups of a dispatch that every Vulkan device takes.
const MAX_GROUPS: u32 = 65_535;
/// Pairs of the first submission, before the device's speed is known: a fraction of a second on one slow core.
const FIRST_SUBMISSION_PAIRS: f64 = (1u64 << 26) as f64;

/// What the pass works on.
pub(crate) struct Gather<'g> {
    pub context: &'g Context<'g>,
    pub estimator: Estimator,
    pub kernel: GatherKernel,
    pub gbuffer: &'g GBuffer,
    pub receivers: &'g Receivers,
    pub receiver_lengths: ListLengths,
    /// Sum of everything gathered so far.
    pub indirect_radiance: &'g Image,
    pub submission_target: Duration,
}

/// What it took.
#[derive(Default)]
pub(crate) struct GatherStats {
    pub times: PassTimes,
    pub submissions: u32,
    pub pairs: u64,
    /// Pairs per second of the last submission.
    pub speed: Option<f64>,
}

/// A run of receivers against a list of VPLs, by one permutation of the kernel.
struct Work<'g> {
    receiver_word: &'static str,
    vpl_word: &'static str,
    first_receiver: u32,
    receiver_count: u32,
    vpls: &'g Image,
    vpl_count: u32,
}

/// Adds the light of `vpls` to the indirect radiance. `proceed` is called between submissions with the share of this
/// light's pairs that is done; its error ends the pass.
pub(crate) fn accumulate(
    gather: &Gather,
    vpls: &VplLists,
    vpl_lengths: ListLengths,
    proceed: &mut dyn FnMut(f64) -> Result<()>,
) -> Result<GatherStats> {
    let mut stats = GatherStats::default();
    let receivers = gather.receiver_lengths;
    let mut works = Vec::new();
    for (receiver_word, first_receiver, receiver_count) in [
        ("lambert", 0, receivers.matte),
        ("phong", receivers.matte, receivers.glossy),
    ] {
        let lists = [
            ("matte", Some(&vpls.matte), vpl_lengths.matte),
            ("glossy", vpls.glossy.as_ref(), vpl_lengths.glossy),
        ];
        for (vpl_word, list, vpl_count) in lists {
            if let Some(vpls) = list
                && receiver_count > 0
                && vpl_count > 0
            {
                works.push(Work {
                    receiver_word,
                    vpl_word,
                    first_receiver,
                    receiver_count,
                    vpls,
                    vpl_count,
                });
            }
        }
    }
    let pairs = |work: &Work| u64::from(work.receiver_count) * u64::from(work.vpl_count);
    let total: u64 = works.iter().map(pairs).sum();
    let mut done = 0;
    for work in &works {
        // Kernels differ in speed by up to ten.
        stats.speed = None;
        gather.run(work, &mut stats, &mut |pairs_of_work| {
            proceed((done + pairs_of_work) as f64 / total as f64)
        })?;
        done += pairs(work);
    }
    stats.pairs += total;
    Ok(stats)
}

impl Gather<'_> {
    fn run(
        &self,
        work: &Work,
        stats: &mut GatherStats,
        proceed: &mut dyn FnMut(u64) -> Result<()>,
    ) -> Result<()> {
        let pipeline = self.context.pipelines.compute(
            "gather",
            &[
                self.kernel.name(),
                estimator_word(self.estimator),
                work.receiver_word,
                work.vpl_word,
            ],
        )?;
        let module = pipeline.module;
        let group_receivers = module.workgroup_size[0] * module.constant("RECEIVERS")?;
        let fetch_vpls = module.constant("FETCH_VPLS")?;
        let mut resources = self.gbuffer.resources();
        resources.extend([
            ("indirect_radiance", Resource::Image(self.indirect_radiance)),
            ("receivers", Resource::Buffer(&self.receivers.pixels)),
            ("vpls", Resource::Image(work.vpls)),
        ]);

        let mut first_receiver = 0;
        while first_receiver < work.receiver_count {
            // Receivers whose run of VPLs fills a submission; at least one workgroup of them. `as` saturates.
            let groups = self.budget(stats) / f64::from(DISPATCH_VPLS.min(work.vpl_count));
            let groups = (groups as u32 / group_receivers).clamp(1, MAX_GROUPS);
            let receiver_count = groups
                .saturating_mul(group_receivers)
                .min(work.receiver_count - first_receiver);
            let groups = [receiver_count.div_ceil(group_receivers), 1, 1];

            let mut first_vpl = 0;
            while first_vpl < work.vpl_count {
                let budget = self.budget(stats);
                let mut pairs = 0;
                let mut recorder = Recorder::new(self.context.device, 1)?;
                recorder.pass("gather", |recorder| {
                    while first_vpl < work.vpl_count && (pairs == 0 || (pairs as f64) < budget) {
                        let vpl_count = DISPATCH_VPLS.min(work.vpl_count - first_vpl);
                        let parameters = GatherParameters {
                            camera_position: self.context.camera_position(),
                            first_receiver: work.first_receiver + first_receiver,
                            receiver_count,
                            first_vpl,
                            vpl_count: vpl_count.next_multiple_of(fetch_vpls),
                            ..GatherParameters::default()
                        };
                        // Dispatches add to the same pixels.
                        recorder.barrier();
                        recorder.dispatch(&pipeline, &resources, &parameters, groups)?;
                        first_vpl += vpl_count;
                        pairs += u64::from(receiver_count) * u64::from(vpl_count);
                    }
                    Ok(())
                })?;
                let start = Instant::now();
                stats.times.extend(recorder.submit()?);
                stats.submissions += 1;
                stats.speed = Some(pairs as f64 / start.elapsed().as_secs_f64().max(1e-6));
                let earlier = u64::from(first_receiver) * u64::from(work.vpl_count);
                proceed(earlier + u64::from(receiver_count) * u64::from(first_vpl))?;
            }
            first_receiver += receiver_count;
        }
        Ok(())
    }

    /// Pairs that a submission should hold.
    fn budget(&self, stats: &GatherStats) -> f64 {
        stats.speed.map_or(FIRST_SUBMISSION_PAIRS, |speed| {
            speed * self.submission_target.as_secs_f64()
        })
    }
}
