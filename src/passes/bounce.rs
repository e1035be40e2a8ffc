//! Bounce pass: the single bounce at a list of receivers, by rays from both ends.

use std::time::{Duration, Instant};

use super::{
    Context,
    gbuffer::GBuffer,
    hits::HitSurfaces,
    rays::{RayTreeImages, TexelList},
    refine::{Refinement, Run},
    vpl::VplLists,
    vpl_sampler::{ListedLight, VplSampler},
};
use crate::{
    Error, RayKernel, Result, lattice,
    vulkan::{
        Buffer, BufferUse, Device, PassTimes, Recorder, Resource,
        shaders::{self, BounceParameters, Module, bytes_of, values_in},
    },
};

/// Workgroups of a dispatch that every Vulkan device takes.
const MAX_GROUPS: u32 = 65_535;
/// Rays of the first submission, before the device's speed is known.
const FIRST_SUBMISSION_RAYS: f64 = 5e5;

/// What the pass works with.
pub(crate) struct Bounce<'b> {
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
    /// Whether the lists have been copied to their images.
    is_copied: Copied,
    submission_target: Duration,
    rays_per_second: Option<f64>,
    pub stats: BounceStats,
}

struct Lattice {
    samples: u32,
    points: TexelList,
}

/// Whether lists have been copied to their images.
#[derive(Default)]
struct Copied {
    lights: bool,
    vpl_sampler: bool,
    lattice: bool,
}

/// What it took.
#[derive(Default)]
pub(crate) struct BounceStats {
    pub times: PassTimes,
    pub submissions: u32,
    pub rays: u64,
}

impl<'b> Bounce<'b> {
    pub fn new(
        context: &'b Context<'b>,
        gbuffer: &'b GBuffer,
        (tree, surfaces): (&'b RayTreeImages, &'b HitSurfaces),
        vpls: &'b VplLists,
        lights: &[&ListedLight],
        kernel: RayKernel,
        submission_target: Duration,
    ) -> Result<Bounce<'b>> {
        let device = context.device;
        let parameters: Vec<shaders::Light> = lights.iter().map(|light| light.parameters).collect();
        // As they would lie in a buffer.
        let words = values_in::<[f32; 4]>(bytes_of(&parameters));
        let words = words.ok_or_else(|| Error::internal("lights are not whole texels"))?;
        Ok(Bounce {
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
            is_copied: Copied::default(),
            submission_target,
            rays_per_second: None,
            stats: BounceStats::default(),
        })
    }

    /// Until [`Bounce::learn`], what VPLs contribute is kept, for up to so many results.
    pub fn begin_pilot(&mut self, results: u32, samples: u32) -> Result<()> {
        let bytes = u64::from(results) * u64::from(samples) * size_of::<f32>() as u64;
        let device = self.context.device;
        self.contributions = Some(Buffer::new(device, "pilot", bytes, BufferUse::Readback)?);
        Ok(())
    }

    /// From here on VPLs are sampled by what they have contributed to the pilot's results.
    pub fn learn(&mut self, results: u32, samples: u32) -> Result<()> {
        if let Some(contributions) = self.contributions.take() {
            let contributions = contributions.mapped((results * samples) as usize)?;
            let device = self.context.device;
            self.vpl_sampler =
                self.vpl_sampler
                    .learned(device, contributions, samples, guide_cells()?)?;
            self.is_copied.vpl_sampler = false;
        }
        Ok(())
    }

    /// Gathers at the receivers of a run, with so many `samples` of each technique. The results go to `first_result` and on: two vectors
    /// a receiver, irradiance by the bounce and the same weighted by the Phong lobe.
    pub fn gather(
        &mut self,
        refinement: &Refinement,
        run: Run,
        (results, first_result): (&Buffer, u32),
        samples: u32,
        seed: u32,
        proceed: &mut dyn FnMut() -> Result<()>,
    ) -> Result<()> {
        let Run {
            is_glossy,
            first,
            count,
        } = run;
        if count == 0 {
            return Ok(());
        }
        if self.lattice.samples != samples {
            self.lattice = Lattice::new(self.context.device, samples)?;
            self.is_copied.lattice = false;
        }
        let plan = self.context.plan;
        let pipeline = self.context.pipelines.compute(
            "bounce",
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
            ("receivers", Resource::Buffer(&refinement.receivers)),
            ("bounced", Resource::Buffer(results)),
        ]);

        let mut done = 0;
        while done < count {
            let budget = self.rays_per_second.map_or(FIRST_SUBMISSION_RAYS, |speed| {
                speed * self.submission_target.as_secs_f64()
            });
            let rays_per_receiver = u64::from(samples) * rays_per_sample;
            let fit = (budget / rays_per_receiver as f64) as u32;
            let receiver_count = fit
                .clamp(receivers_per_group, MAX_GROUPS * receivers_per_group)
                .min(count - done);
            let mut recorder = Recorder::new(self.context.device, 1)?;
            if !std::mem::replace(&mut self.is_copied.lights, true) {
                self.lights.record_copy(&mut recorder);
            }
            if !std::mem::replace(&mut self.is_copied.vpl_sampler, true) {
                self.vpl_sampler.record_copy(&mut recorder);
            }
            if !std::mem::replace(&mut self.is_copied.lattice, true) {
                self.lattice.points.record_copy(&mut recorder);
            }
            recorder.pass("bounce", |recorder| {
                for first_sample in (0..samples).step_by(samples_per_dispatch as usize) {
                    let parameters = BounceParameters {
                        camera_position: self.context.camera_position(),
                        first_receiver: first + done,
                        receiver_count,
                        first_result: first_result + done,
                        first_sample,
                        sample_count: samples_per_dispatch.min(samples - first_sample),
                        samples,
                        light_count: self.light_count,
                        range_count: self.vpl_sampler.range_count(),
                        is_pilot: self.contributions.is_some().into(),
                        seed,
                        ..BounceParameters::default()
                    };
                    let groups = [receiver_count.div_ceil(receivers_per_group), 1, 1];
                    // Dispatches add to the same results.
                    recorder.barrier();
                    recorder.dispatch(&pipeline, &resources, &parameters, groups)?;
                }
                Ok(())
            })?;
            let start = Instant::now();
            self.stats.times.extend(recorder.submit()?);
            self.stats.submissions += 1;
            let rays = u64::from(receiver_count) * rays_per_receiver;
            self.stats.rays += rays;
            self.rays_per_second = Some(rays as f64 / start.elapsed().as_secs_f64().max(1e-6));
            done += receiver_count;
            proceed()?;
        }
        Ok(())
    }
}

fn guide_cells() -> Result<u32> {
    let any = ["lambert", "matte", "flat", "single"];
    Module::find("bounce", &any)?.constant("GUIDE_CELLS")
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
