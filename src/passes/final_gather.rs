//! Final gather pass: the single bounce at a list of receivers, by rays from both ends.

use super::{
    Context,
    cost::Work,
    gatherer::{Gatherer, Results, Samples},
    gbuffer::GBuffer,
    hits::HitSurfaces,
    rays::RayTreeImages,
    receivers::{ReceiverRange, Receivers},
    vpl::VplLists,
    vpl_sampler::{ListedLight, VplSampler},
};
use crate::{
    Error, RayKernel, Result, lattice,
    plan::Plan,
    vulkan::{
        Allocate, Buffer, BufferUse, Device, MAX_GROUPS, Recorder, Resource, TexelList,
        shaders::{self, FinalGatherParameters, Module},
    },
};

/// Rays of the first submission, before the device's speed is known.
const FIRST_SUBMISSION_RAYS: f64 = 5e5;

/// Samples of a gather at most.
pub(crate) const MAX_SAMPLES: u64 = 1 << 14;
/// Texels of a tile of the RSM.
const TILE_TEXELS: u64 = 64;

/// What the pass works with.
pub(crate) struct FinalGather<'b> {
    pub context: &'b Context<'b>,
    pub gbuffer: &'b GBuffer,
    pub tree: &'b RayTreeImages,
    pub surfaces: &'b HitSurfaces,
    pub vpls: &'b VplLists,
    lights: TexelList,
    vpl_sampler: VplSampler,
    /// What each sample of a VPL contributes: of a pilot only.
    contributions: Option<Buffer>,
    nothing: Buffer,
    light_count: u32,
    kernel: RayKernel,
    lattice: Lattice,
}

struct Lattice {
    samples: u32,
    points: TexelList,
}

/// What the sampling of VPLs and directions takes, in lists that the pilot's replace.
pub(crate) fn declare(allocate: &impl Allocate, plan: &Plan, rsm_size: u32) -> Result<()> {
    let lights = plan.lights.len() as u64;
    let texels = u64::from(plan.max_faces()) * u64::from(rsm_size).pow(2);
    let tiles = lights * texels.div_ceil(TILE_TEXELS);
    for _ in 0..2 {
        TexelList::declare(allocate, "lattice", MAX_SAMPLES)?;
        TexelList::declare(
            allocate,
            "guide to the samples of VPLs",
            guide_cells()?.into(),
        )?;
        TexelList::declare(allocate, "samples of VPLs", tiles)?;
        TexelList::declare(allocate, "pmf of VPLs", tiles)?;
    }
    TexelList::declare(allocate, "lights", 32 * lights)
}

impl<'b> FinalGather<'b> {
    pub fn new(
        context: &'b Context<'b>,
        gbuffer: &'b GBuffer,
        (tree, surfaces): (&'b RayTreeImages, &'b HitSurfaces),
        vpls: &'b VplLists,
        lights: &[&ListedLight],
        kernel: RayKernel,
    ) -> Result<FinalGather<'b>> {
        let device = context.device;
        let parameters: Vec<shaders::Light> = lights.iter().map(|light| light.parameters).collect();
        // As they would lie in a buffer.
        let words = bytemuck::try_cast_slice::<_, [f32; 4]>(&parameters)
            .map_err(|_| Error::internal("lights are not whole texels"))?;
        Ok(FinalGather {
            context,
            gbuffer,
            tree,
            surfaces,
            vpls,
            lights: TexelList::new(device, "lights", words.to_vec())?,
            vpl_sampler: VplSampler::even(device, lights, guide_cells()?)?,
            contributions: None,
            nothing: Buffer::new(device, "nothing", 0, BufferUse::Device)?,
            light_count: lights.len() as u32,
            kernel,
            lattice: Lattice::new(device, 64)?,
        })
    }
}

impl Gatherer for FinalGather<'_> {
    fn pass(&self) -> &'static str {
        "final_gather"
    }

    fn is_exact(&self) -> bool {
        false
    }

    /// What VPLs contribute to the pilot is kept.
    fn begin_pilot(&mut self, results: u32, samples: u32) -> Result<()> {
        let bytes = u64::from(results) * u64::from(samples) * size_of::<f32>() as u64;
        let device = self.context.device;
        self.contributions = Some(Buffer::new(device, "pilot", bytes, BufferUse::Readback)?);
        Ok(())
    }

    /// From here on VPLs are sampled by what they have contributed to the pilot's results.
    fn learn(&mut self, results: u32, samples: u32) -> Result<bool> {
        if let Some(contributions) = self.contributions.take() {
            let contributions = contributions.mapped((results * samples) as usize)?;
            let device = self.context.device;
            self.vpl_sampler =
                self.vpl_sampler
                    .learned(device, contributions, samples, guide_cells()?)?;
        }
        Ok(true)
    }

    /// With so many samples of each technique.
    fn gather(
        &mut self,
        (receivers, range): (&Receivers, ReceiverRange),
        results: Results,
        Samples {
            count: samples,
            seed,
        }: Samples,
        proceed: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<()> {
        let ReceiverRange {
            is_glossy,
            first,
            count,
        } = range;
        if count == 0 {
            return Ok(());
        }
        if self.lattice.samples != samples {
            self.lattice = Lattice::new(self.context.device, samples)?;
        }
        let plan = self.context.plan;
        let pipeline = self.context.pipelines.compute(
            "final_gather",
            &[
                plan.brdf_word(),
                if is_glossy { "glossy" } else { "matte" },
                if plan.is_smooth { "smooth" } else { "flat" },
                if plan.is_textured { "textured" } else { "" },
                self.kernel.name(),
                self.tree.kernel_word(),
            ],
        )?;
        let lanes = self
            .context
            .device
            .info()
            .limits
            .subgroup_lanes
            .clamp(1, 64);
        let receivers_per_group = 64 / lanes;
        let samples_per_dispatch = lanes * pipeline.module.constant("RAYS")?;
        // To a light for each direction, and to a VPL.
        let lobes = if is_glossy { 2 } else { 1 };
        let rays_per_sample = u64::from(lobes * (1 + self.light_count) + 1);
        let mut resources = self.gbuffer.resources();
        resources.extend(self.tree.resources());
        resources.extend(self.surfaces.resources());
        resources.extend(self.vpl_sampler.resources());
        resources.extend([
            ("lights", self.lights.resource()),
            (
                "vpl_contributions",
                Resource::Buffer(self.contributions.as_ref().unwrap_or(&self.nothing)),
            ),
            ("vpls", Resource::Image(&self.vpls.matte)),
            ("lattice", self.lattice.points.resource()),
            ("receivers", Resource::Buffer(&receivers.pixels)),
            ("results", Resource::Buffer(results.buffer)),
        ]);

        let cost = self.context.cost;
        let mut done = 0;
        while done < count {
            let budget = cost
                .borrow()
                .budget(pipeline.module.name, FIRST_SUBMISSION_RAYS);
            let rays_per_receiver = u64::from(samples) * rays_per_sample;
            let fit = (budget / rays_per_receiver as f64) as u32;
            let receiver_count = fit
                .clamp(receivers_per_group, MAX_GROUPS * receivers_per_group)
                .min(count - done);
            let mut recorder = Recorder::new(self.context.device, 1)?;
            self.lights.record_copy(&mut recorder);
            self.vpl_sampler.record_copy(&mut recorder);
            self.lattice.points.record_copy(&mut recorder);
            recorder.pass("final_gather", |recorder| {
                for first_sample in (0..samples).step_by(samples_per_dispatch as usize) {
                    let parameters = FinalGatherParameters {
                        camera_position: self.context.camera_position(),
                        first_receiver: first + done,
                        receiver_count,
                        first_result: results.first + done,
                        first_sample,
                        sample_count: samples_per_dispatch.min(samples - first_sample),
                        samples,
                        light_count: self.light_count,
                        range_count: self.vpl_sampler.range_count(),
                        is_pilot: self.contributions.is_some().into(),
                        seed,
                        ..FinalGatherParameters::default()
                    };
                    let groups = [receiver_count.div_ceil(receivers_per_group), 1, 1];
                    // Dispatches add to the same results.
                    recorder.barrier();
                    recorder.dispatch(&pipeline, &resources, &parameters, groups)?;
                }
                Ok(())
            })?;
            let work = Work {
                pass: "final_gather",
                kernel: pipeline.module.name,
                amount: u64::from(receiver_count) * rays_per_receiver,
            };
            cost.borrow_mut().submit_work(recorder, work)?;
            done += receiver_count;
            proceed(f64::from(done) / f64::from(count))?;
        }
        Ok(())
    }
}

fn guide_cells() -> Result<u32> {
    let any = ["lambert", "matte", "flat", "single"];
    Module::find("final_gather", &any)?.constant("GUIDE_CELLS")
}

impl Lattice {
    fn new(device: &Device, samples: u32) -> Result<Lattice> {
        let points = lattice::rank1(samples);
        let texels = points.iter().map(|&[x, y]| [x, y, 0.0, 0.0]);
        Ok(Lattice {
            samples,
            points: TexelList::new(device, "lattice", texels.collect())?,
        })
    }
}
