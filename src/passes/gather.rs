//! Gather pass: the sum over the VPLs of all lights.
//!
//! The work is cut into submissions of bounded duration. The cuts do not change the result: dispatches always cover the same
//! ranges of VPLs, and receivers do not depend on each other.

use super::{
    Context,
    cost::WorkKind,
    gatherer::{Gatherer, Results, Samples},
    light::DeviceLight,
    receivers::ListedReceivers,
    vpl::VplLists,
};
use crate::{
    Result,
    plan::GatherKernel,
    scene::VplSum,
    vulkan::{
        Image, MAX_GROUPS, Resource,
        shaders::{GatherParameters, Key, ListLengths, Lobes},
    },
};

/// VPLs of one dispatch, whose sum is added to the result. The number is fixed, because the order of summation must not depend
/// on speed. It is small, because lavapipe silently leaves a shader's loops after 65 535 iterations in all.
const DISPATCH_VPLS: u32 = 4096;
/// Pairs of the first submission, before the device's speed is known: a fraction of a second on one slow core.
const FIRST_SUBMISSION_PAIRS: f64 = (1u64 << 26) as f64;
/// Least pixels of an image that may be interpolated: the sample for the error estimate must be only a small part of it.
const MIN_INTERPOLATED_PIXELS: u32 = 1 << 15;
/// Least VPLs of a sum that may be interpolated, because it takes longer than interpolation. On lavapipe, predicting, listing and
/// resolving all pixels costs about as much as 400 VPLs.
const MIN_INTERPOLATED_VPLS: u32 = 1024;

/// The state of the pass.
pub(crate) struct Gather<'g> {
    pub context: &'g Context<'g>,
    pub sum: VplSum,
    pub kernel: GatherKernel,
    pub vpls: &'g VplLists,
    /// Each light with its VPLs.
    pub lights: Vec<(&'g DeviceLight, ListedVpls)>,
}

/// A light's VPLs: a matte and a glossy list, which begin at the same place.
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

/// A list of VPLs of one light.
struct VplList<'g> {
    image: &'g Image,
    light: &'g DeviceLight,
    is_glossy: bool,
    first: u32,
    count: u32,
}

impl<'g> Gather<'g> {
    fn lists(&self) -> Vec<VplList<'g>> {
        let vpls = self.vpls;
        let of_light = |&(light, listed): &(&'g DeviceLight, ListedVpls)| {
            let list = |image, is_glossy, count| VplList {
                image,
                light,
                is_glossy,
                first: listed.first,
                count,
            };
            let matte = list(&vpls.matte, false, listed.lengths.matte);
            let glossy = vpls.glossy.as_ref();
            let glossy = glossy.map(|image| list(image, true, listed.lengths.glossy));
            [Some(matte), glossy].into_iter().flatten()
        };
        let lists = self.lights.iter().flat_map(of_light);
        lists.filter(|list| list.count > 0).collect()
    }

    /// Adds the VPLs of a list to the results of some receivers.
    fn add(
        &self,
        list: &VplList,
        receivers: ListedReceivers,
        results: Results,
        is_first: bool,
        proceed: &mut dyn FnMut(u64) -> Result<()>,
    ) -> Result<()> {
        let range = receivers.range;
        let plan = self.context.plan;
        let pipeline = self.context.pipelines.compute(Key::Gather {
            distribution: self.kernel.into(),
            specular: range.is_glossy,
            lobes: if list.is_glossy {
                Lobes::Glossy
            } else {
                Lobes::Matte
            },
            frequencies: plan.frequencies(),
            sum: self.sum.into(),
            microfacet: plan.has_microfacets,
        })?;
        let module = pipeline.module;
        let group_receivers = module.workgroup_size[0] * module.constant("RECEIVERS")?;
        let mut resources = receivers.gbuffer.resources();
        resources.extend([
            ("receivers", Resource::Buffer(&receivers.list.pixels)),
            ("vpls", Resource::Image(list.image)),
            ("results", Resource::Buffer(results.buffer)),
            ("light", Resource::Buffer(&list.light.uniform)),
        ]);
        resources.extend(self.context.modulation());
        let work = WorkKind {
            pass: "gather",
            kernel: module.name,
            done_by: &["gather"],
            first: FIRST_SUBMISSION_PAIRS,
        };
        self.context.begin_work(work)?;

        let mut done = 0;
        while done < range.count {
            // As many receivers as fill a submission with their range of VPLs, but at least one workgroup. `as` saturates.
            let groups = self.context.room_for(work) / f64::from(DISPATCH_VPLS.min(list.count));
            let groups = (groups as u32 / group_receivers).clamp(1, MAX_GROUPS);
            let receiver_count = groups
                .saturating_mul(group_receivers)
                .min(range.count - done);
            let groups = [receiver_count.div_ceil(group_receivers), 1, 1];

            let mut summed = 0;
            while summed < list.count {
                let room = self.context.room_for(work);
                let mut pairs = 0;
                self.context.pass("gather", |recorder| {
                    while summed < list.count && (pairs == 0 || (pairs as f64) < room) {
                        let vpl_count = DISPATCH_VPLS.min(list.count - summed);
                        let parameters = GatherParameters {
                            camera_position: self.context.camera_position(),
                            first_receiver: range.first + done,
                            receiver_count,
                            first_vpl: list.first + summed,
                            vpl_count,
                            first_result: results.first + done,
                            is_first: (is_first && summed == 0).into(),
                            ..GatherParameters::default()
                        };
                        // Successive dispatches add to the same results.
                        recorder.barrier();
                        recorder.dispatch(&pipeline, &resources, &parameters, groups)?;
                        summed += vpl_count;
                        pairs += u64::from(receiver_count) * u64::from(vpl_count);
                    }
                    Ok(())
                })?;
                self.context.add_work(work, pairs, 0)?;
                if pairs == 0 {
                    // The device is lost, and the submission says so.
                    self.context.finish()?;
                }
                proceed(pairs)?;
            }
            done += receiver_count;
        }
        Ok(())
    }
}

impl Gatherer for Gather<'_> {
    fn pass(&self) -> &'static str {
        "gather"
    }

    fn is_noiseless(&self) -> bool {
        true
    }

    /// The sample must be small compared with the image, and the sum must take longer than the passes that interpolate.
    fn may_interpolate(&self) -> bool {
        let [width, height] = self.context.plan.resolution_px;
        let vpl_count: u32 = self.lights.iter().map(|(_, listed)| listed.count()).sum();
        width * height >= MIN_INTERPOLATED_PIXELS && vpl_count >= MIN_INTERPOLATED_VPLS
    }

    fn gather(
        &mut self,
        receivers: ListedReceivers,
        results: Results,
        _: Option<Samples>,
        proceed: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<()> {
        let lists = self.lists();
        let vpl_count: u64 = lists.iter().map(|list| u64::from(list.count)).sum();
        let total = vpl_count * u64::from(receivers.range.count);
        let mut done = 0;
        for (index, list) in lists.iter().enumerate() {
            let is_first = index == 0;
            self.add(list, receivers, results, is_first, &mut |pairs| {
                done += pairs;
                proceed(done as f64 / total as f64)
            })?;
        }
        Ok(())
    }
}
