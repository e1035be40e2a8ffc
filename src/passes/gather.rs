//! Gather pass: indirect radiance, receivers from every VPL of some lights.
//!
//! The work is cut into submissions of bounded duration, so that no watchdog fires and the caller can cancel. The cuts
//! do not show: dispatches always cover the same runs of VPLs, and receivers do not depend on each other.

use std::time::{Duration, Instant};

use super::{
    Context,
    compact::Run,
    gbuffer::GBuffer,
    vpl::{VplLists, sum_word},
};
use crate::{
    Result,
    plan::GatherKernel,
    scene::VplSum,
    vulkan::{
        Buffer, Image, MAX_GROUPS, PassTimes, Recorder, Resource,
        shaders::{GatherParameters, ListLengths},
    },
};

/// VPLs of one dispatch: their sum is added to the image. Fixed, for the order of summation must not depend on speed.
/// Also small, for lavapipe leaves a shader's loops after 65 535 iterations in all and says nothing.
const DISPATCH_VPLS: u32 = 4096;
/// Pairs of the first submission, before the device's speed is known: a fraction of a second on one slow core.
const FIRST_SUBMISSION_PAIRS: f64 = (1u64 << 26) as f64;

/// What the pass works with.
pub(crate) struct Gather<'g> {
    pub context: &'g Context<'g>,
    pub sum: VplSum,
    pub kernel: GatherKernel,
    pub gbuffer: &'g GBuffer,
    pub vpls: &'g VplLists,
    pub submission_target: Duration,
    pub stats: GatherStats,
}

/// A light's VPLs, in lists that begin alike.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ListedVpls {
    pub first: u32,
    pub lengths: ListLengths,
}

impl ListedVpls {
    pub fn count(&self) -> u32 {
        self.lengths.matte + self.lengths.glossy
    }
}

/// Where the sums go.
#[derive(Clone, Copy)]
pub(crate) enum Sums<'g> {
    /// Radiance, added to an image.
    Image(&'g Image),
    /// Two vectors a receiver, from `first_result` on: the sum, and the sum weighted by the Phong lobe.
    List {
        results: &'g Buffer,
        first_result: u32,
    },
}

/// What it took.
#[derive(Default)]
pub(crate) struct GatherStats {
    pub times: PassTimes,
    pub submissions: u32,
    pub pairs: u64,
    /// Pairs per second of each permutation's last submission: they differ by up to ten.
    speeds: [Option<f64>; 4],
}

/// A run of receivers against a list of VPLs, by one permutation of the kernel.
struct Work<'g> {
    run: Run,
    is_glossy_list: bool,
    vpls: &'g Image,
    first_vpl: u32,
    vpl_count: u32,
    /// No earlier work has results for these receivers.
    is_first: bool,
}

impl Work<'_> {
    fn pairs(&self) -> u64 {
        u64::from(self.run.count) * u64::from(self.vpl_count)
    }

    /// Its permutation's place among the speeds.
    fn kind(&self) -> usize {
        2 * usize::from(self.run.is_glossy) + usize::from(self.is_glossy_list)
    }
}

impl<'g> Gather<'g> {
    /// Sums the VPLs of lights at receivers, which are runs of a list of pixels. `proceed` is called between submissions with the
    /// share of the pairs that is done; its error ends the pass.
    pub fn accumulate(
        &mut self,
        lights: &[ListedVpls],
        (pixels, runs): (&Buffer, &[Run]),
        sums: Sums,
        proceed: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<()> {
        let works: Vec<Work> = runs
            .iter()
            .flat_map(|&run| self.works(run, lights))
            .collect();
        let total: u64 = works.iter().map(Work::pairs).sum();
        let mut done = 0;
        for work in &works {
            self.run(work, pixels, sums, &mut |pairs_of_work| {
                proceed((done + pairs_of_work) as f64 / total as f64)
            })?;
            done += work.pairs();
        }
        self.stats.pairs += total;
        Ok(())
    }

    fn works(&self, run: Run, lights: &[ListedVpls]) -> Vec<Work<'g>> {
        let mut works = Vec::new();
        for light in lights {
            let lists = [
                (false, Some(&self.vpls.matte), light.lengths.matte),
                (true, self.vpls.glossy.as_ref(), light.lengths.glossy),
            ];
            for (is_glossy_list, list, vpl_count) in lists {
                if let Some(vpls) = list
                    && run.count > 0
                    && vpl_count > 0
                {
                    works.push(Work {
                        run,
                        is_glossy_list,
                        vpls,
                        first_vpl: light.first,
                        vpl_count,
                        is_first: works.is_empty(),
                    });
                }
            }
        }
        works
    }

    fn run(
        &mut self,
        work: &Work,
        pixels: &Buffer,
        sums: Sums,
        proceed: &mut dyn FnMut(u64) -> Result<()>,
    ) -> Result<()> {
        let pipeline = self.context.pipelines.compute(
            "gather",
            &[
                self.kernel.name(),
                sum_word(self.sum),
                if work.run.is_glossy {
                    "phong"
                } else {
                    "lambert"
                },
                if work.is_glossy_list {
                    "glossy"
                } else {
                    "matte"
                },
                match sums {
                    Sums::Image(_) => "",
                    Sums::List { .. } => "list",
                },
            ],
        )?;
        let module = pipeline.module;
        let group_receivers = module.workgroup_size[0] * module.constant("RECEIVERS")?;
        let fetch_vpls = module.constant("FETCH_VPLS")?;
        let mut resources = self.gbuffer.resources();
        resources.extend([
            ("receivers", Resource::Buffer(pixels)),
            ("vpls", Resource::Image(work.vpls)),
        ]);
        let first_result = match sums {
            Sums::Image(image) => {
                resources.push(("indirect_radiance", Resource::Image(image)));
                0
            }
            Sums::List {
                results,
                first_result,
            } => {
                resources.push(("bounced", Resource::Buffer(results)));
                first_result
            }
        };

        let mut done = 0;
        while done < work.run.count {
            // Receivers whose run of VPLs fills a submission; at least one workgroup of them. `as` saturates.
            let groups = self.budget(work) / f64::from(DISPATCH_VPLS.min(work.vpl_count));
            let groups = (groups as u32 / group_receivers).clamp(1, MAX_GROUPS);
            let receiver_count = groups
                .saturating_mul(group_receivers)
                .min(work.run.count - done);
            let groups = [receiver_count.div_ceil(group_receivers), 1, 1];

            let mut summed = 0;
            while summed < work.vpl_count {
                let budget = self.budget(work);
                let mut pairs = 0;
                let mut recorder = Recorder::new(self.context.device, 1)?;
                recorder.pass("gather", |recorder| {
                    while summed < work.vpl_count && (pairs == 0 || (pairs as f64) < budget) {
                        let vpl_count = DISPATCH_VPLS.min(work.vpl_count - summed);
                        let parameters = GatherParameters {
                            camera_position: self.context.camera_position(),
                            first_receiver: work.run.first + done,
                            receiver_count,
                            first_vpl: work.first_vpl + summed,
                            vpl_count: vpl_count.next_multiple_of(fetch_vpls),
                            first_result: first_result + done,
                            is_first: (work.is_first && summed == 0).into(),
                            ..GatherParameters::default()
                        };
                        // Dispatches add to the same pixels.
                        recorder.barrier();
                        recorder.dispatch(&pipeline, &resources, &parameters, groups)?;
                        summed += vpl_count;
                        pairs += u64::from(receiver_count) * u64::from(vpl_count);
                    }
                    Ok(())
                })?;
                let start = Instant::now();
                self.stats.times.extend(recorder.submit()?);
                self.stats.submissions += 1;
                let speed = pairs as f64 / start.elapsed().as_secs_f64().max(1e-6);
                self.stats.speeds[work.kind()] = Some(speed);
                let earlier = u64::from(done) * u64::from(work.vpl_count);
                proceed(earlier + u64::from(receiver_count) * u64::from(summed))?;
            }
            done += receiver_count;
        }
        Ok(())
    }

    /// Pairs that a submission should hold.
    fn budget(&self, work: &Work) -> f64 {
        let speed = self.stats.speeds[work.kind()];
        speed.map_or(FIRST_SUBMISSION_PAIRS, |speed| {
            speed * self.submission_target.as_secs_f64()
        })
    }
}
