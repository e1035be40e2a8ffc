//! Final gather pass: gathers the single bounce at a list of receivers, with rays from the receivers and from the lights.

use super::{
    Context,
    cost::Work,
    gatherer::{Gatherer, LightRaySets, Results, Samples},
    gbuffer::GBuffer,
    hits::HitSurfaces,
    light::DeviceLight,
    light_rays::{LightRays, MAX_RAYS},
    random::hash,
    rays::RayTriangles,
    receivers::{ReceiverRange, Receivers},
    sample_counts::PACKET_SAMPLES,
    vpl_sampler::{Pilot, RayTable, VplSampler},
};
use crate::{
    Error, RayKernel, Result, lattice,
    output::for_each_at_once,
    plan::Plan,
    vulkan::{
        Allocate, Buffer, BufferUse, MAX_GROUPS, Resource, TexelList,
        shaders::{self, FinalGatherParameters, PilotSample},
    },
};

/// Rays of the first submission, before the device's speed is known.
const FIRST_SUBMISSION_RAYS: f64 = 5e5;

/// Most samples of a receiver.
pub(crate) const MAX_SAMPLES: u32 = 1 << 16;
/// Rays from the lights per VPL sample of a receiver. With this many, the error that receivers share is small compared with
/// the error of each receiver alone.
const LIGHT_RAYS_PER_SAMPLE: u32 = 128;
/// The same for each set, if there are several sets.
const LIGHT_RAYS_PER_SAMPLE_OF_A_SET: u32 = 8;
/// Least number of rays in a set, so that the cells that matter get some.
const MIN_SET_SIZE: u32 = 1 << 11;
/// Least number of rays in a set of the pilot, so that it distinguishes parts of cells.
const PILOT_SET_SIZE: u32 = 1 << 15;
/// Share of the loop iterations allowed by the driver that a dispatch uses. The iterations of a ray are an estimate;
/// a ray beyond the limit would miss what it hits.
const SHARE_OF_LOOP_ITERATIONS: f64 = 0.9;
/// Approximate upper limit of the iterations of a packet of samples, without tracing.
const PACKET_ITERATIONS: f64 = 800.0;

/// The state of the pass.
pub(crate) struct FinalGather<'b> {
    pub context: &'b Context<'b>,
    pub tree: &'b RayTriangles,
    pub surfaces: &'b HitSurfaces,
    lights: Vec<&'b DeviceLight>,
    light_list: TexelList,
    light_rays: LightRays,
    /// One for the image, one for error estimates.
    sampling: [LightSampling; 2],
    /// The light rays that were traced last.
    sent: Option<LightRaySets>,
    /// What each ray to a VPL finds; only during a pilot.
    pilot_samples: Option<Buffer>,
    nothing: Buffer,
    kernel: RayKernel,
    lattice: TexelList,
}

/// How the lights are sampled.
struct LightSampling {
    sampler: VplSampler,
    /// The last table that the sampler made.
    table: Option<RayTable>,
    /// The light rays of the pilot: the first result that each set is for, and its seed.
    pilot_rays: Vec<(u32, u32)>,
}

impl LightSampling {
    fn even(lights: &[&DeviceLight]) -> LightSampling {
        LightSampling {
            sampler: VplSampler::even(lights),
            table: None,
            pilot_rays: Vec::new(),
        }
    }
}

/// Declares the lists for sampling VPLs and directions. Later lists replace earlier ones.
pub(crate) fn declare(allocate: &impl Allocate, plan: &Plan, emission_size: u32) -> Result<()> {
    let lights = plan.lights.len() as u64;
    let tiles = lights * u64::from(plan.max_faces() * emission_size.pow(2));
    TexelList::declare(allocate, "lattice", MAX_SAMPLES.into())?;
    for _ in 0..2 {
        RayTable::declare(allocate, tiles)?;
    }
    LightRays::new(allocate, plan)?;
    let numbers = plan
        .lights
        .iter()
        .map(|light| u64::from(light.pattern_numbers));
    let texels = numbers.map(|numbers| 32 + numbers.div_ceil(4)).sum();
    TexelList::declare(allocate, "lights", texels)
}

/// The texels of `shaders/lights.wgsl`: the lights in the layout of a buffer, then their patterns.
fn list_of(lights: &[&DeviceLight]) -> Result<Vec<[f32; 4]>> {
    let mut parameters: Vec<shaders::Light> = lights.iter().map(|l| l.parameters).collect();
    let texels_per_light = size_of::<shaders::Light>() / size_of::<[f32; 4]>();
    let first = texels_per_light * parameters.len();
    let mut patterns = Vec::new();
    for (light, parameters) in lights.iter().zip(&mut parameters) {
        parameters.first_pattern = (first + patterns.len()) as u32;
        patterns.extend(light.pattern.chunks(4).map(|numbers| {
            let mut texel = [0.0; 4];
            texel[..numbers.len()].copy_from_slice(numbers);
            texel
        }));
    }
    let texels = bytemuck::try_cast_slice::<_, [f32; 4]>(&parameters)
        .map_err(|_| Error::internal("lights are not whole texels"))?;
    Ok([texels, &patterns].concat())
}

impl<'b> FinalGather<'b> {
    pub fn new(
        context: &'b Context<'b>,
        (tree, surfaces): (&'b RayTriangles, &'b HitSurfaces),
        lights: Vec<&'b DeviceLight>,
        kernel: RayKernel,
    ) -> Result<FinalGather<'b>> {
        let device = context.device;
        let points = lattice::sequence(MAX_SAMPLES).into_iter();
        let points = points.map(|[x, y]| [x, y, 0.0, 0.0]);
        Ok(FinalGather {
            context,
            tree,
            surfaces,
            light_list: TexelList::new(context.commands, "lights", list_of(&lights)?)?,
            light_rays: LightRays::new(device, context.plan)?,
            sampling: [(); 2].map(|()| LightSampling::even(&lights)),
            sent: None,
            lights,
            pilot_samples: None,
            nothing: Buffer::new(device, "nothing", 0, BufferUse::Device)?,
            kernel,
            lattice: TexelList::new(context.commands, "lattice", points.collect())?,
        })
    }

    /// Traces rays from the lights for results from `first_result` on, unless the last rays were for the same samples.
    /// Returns the number of rays.
    fn send_light_rays(&mut self, wanted: LightRaySets, first_result: u32) -> Result<u64> {
        if self.sent == Some(wanted) {
            return Ok(0);
        }
        let sampling = &mut self.sampling[wanted.gathered_for as usize];
        let per_sample = match wanted.set_count {
            1 => LIGHT_RAYS_PER_SAMPLE,
            _ => LIGHT_RAYS_PER_SAMPLE_OF_A_SET,
        };
        let at_least = if self.pilot_samples.is_some() {
            sampling.pilot_rays.push((first_result, wanted.seed));
            PILOT_SET_SIZE
        } else {
            MIN_SET_SIZE
        };
        let set_size = wanted.samples.saturating_mul(per_sample).max(at_least);
        let set_size = set_size.min(MAX_RAYS / wanted.set_count);
        let table = match sampling.table.take() {
            Some(table) if table.is_for(set_size) => table,
            _ => sampling.sampler.table(self.context.commands, set_size)?,
        };
        let count = self.light_rays.trace(
            self.context,
            (self.tree, self.surfaces),
            (&self.lights, &self.light_list),
            sampling.table.insert(table),
            (wanted.set_count, wanted.seed),
            self.kernel,
        )?;
        self.sent = Some(wanted);
        Ok(count)
    }

    /// How many packets of a receiver and how many lights a dispatch takes, within the loop iterations that the driver allows.
    fn at_once(&self, lobes: u32) -> (usize, usize) {
        let all_lights = self.lights.len().max(1);
        let all_packets = (MAX_SAMPLES / PACKET_SAMPLES) as usize;
        let Some(most) = self.context.device.info().quirks.max_loop_iterations else {
            return (all_packets, all_lights);
        };
        let most = SHARE_OF_LOOP_ITERATIONS * f64::from(most);
        let of_trace = self.tree.loop_iterations(self.kernel);
        let lobes = f64::from(lobes);
        let of_rest = PACKET_ITERATIONS + of_trace * (1.0 + lobes);
        let of_light = lobes * of_trace;
        let lights = ((most - of_rest) / of_light.max(1.0)).clamp(1.0, all_lights as f64);
        let packets = most / (of_rest + lights.floor() * of_light);
        (packets.max(1.0) as usize, lights as usize)
    }
}

impl Gatherer for FinalGather<'_> {
    fn pass(&self) -> &'static str {
        "final_gather"
    }

    fn is_exact(&self) -> bool {
        false
    }

    /// From here on, keeps what rays to VPLs find.
    fn begin_pilot(&mut self, results: u32) -> Result<()> {
        let bytes = u64::from(results * PACKET_SAMPLES) * size_of::<PilotSample>() as u64;
        let device = self.context.device;
        self.pilot_samples = Some(Buffer::new(device, "pilot", bytes, BufferUse::Readback)?);
        Ok(())
    }

    /// From here on, samples VPLs by what they contributed to the pilot's results.
    fn learn(&mut self, results: u32) -> Result<f64> {
        self.sent = None;
        let plan = self.context.plan.indirect;
        let norm = plan.map(|plan| plan.refinement.error_norm);
        let samples = self.pilot_samples.take();
        let samples: &[PilotSample] = match &samples {
            Some(samples) => samples.mapped((results * PACKET_SAMPLES) as usize)?,
            None => &[],
        };
        let half = samples.len() / 2;
        let lights = &self.lights;
        let mut moved = [0.0_f64; 2];
        // The two samplings share nothing, and the device waits for both.
        let samplings = self.sampling.iter_mut().zip(&mut moved).enumerate();
        for_each_at_once(samplings, |(index, (sampling, moved))| {
            let rays = std::mem::take(&mut sampling.pilot_rays);
            let Some(table) = sampling.table.take().filter(|_| half > 0) else {
                return;
            };
            let pilot = Pilot {
                samples: &samples[index * half..][..half],
                first_result: (index * half) as u32 / PACKET_SAMPLES,
                rays: &rays,
            };
            *moved = sampling
                .sampler
                .learn(lights, &table, &pilot, norm.unwrap_or_default());
        });
        Ok(moved[0].max(moved[1]))
    }

    /// Gathers with packets of samples of each technique.
    fn gather(
        &mut self,
        (gbuffer, receivers, range): (&GBuffer, &Receivers, ReceiverRange),
        results: Results,
        samples: Option<Samples>,
        proceed: &mut dyn FnMut(f64) -> Result<()>,
    ) -> Result<()> {
        let no_samples = || Error::internal("final gathering has no samples");
        let Samples {
            counts,
            seed,
            light_rays,
        } = samples.ok_or_else(no_samples)?;
        let own_seed = hash(self.context.seed);
        let ReceiverRange {
            is_glossy,
            first,
            count,
        } = range;
        if count == 0 {
            return Ok(());
        }
        let wanted = LightRaySets {
            seed: light_rays.seed ^ own_seed,
            ..light_rays
        };
        let mut light_rays_along = self.send_light_rays(wanted, results.first)?;
        let Some(table) = &self.sampling[light_rays.gathered_for as usize].table else {
            return Err(Error::internal("no rays were sent from the lights"));
        };
        let plan = self.context.plan;
        let [shading, textured] = plan.shading_words();
        let pipeline = self.context.pipelines.compute(
            "final_gather",
            &[
                plan.brdf_word(),
                if is_glossy { "glossy" } else { "matte" },
                shading,
                textured,
                plan.phasor_word(),
                self.kernel.name(),
                self.tree.kernel_word(),
            ],
        )?;
        let receivers_per_group = pipeline.module.constant("RECEIVERS")?;
        // Per lobe, each direction needs a ray to each light. One more ray leads to a VPL.
        let lobes = if is_glossy { 2 } else { 1 };
        let light_count = self.lights.len() as u32;
        let (packets_at_once, lights_at_once) = self.at_once(lobes);
        // Each further group of lights follows the directions again.
        let direction_rays = light_count.div_ceil(lights_at_once as u32);
        let rays_per_sample = u64::from(lobes * (direction_rays + light_count) + 1);
        let mut resources = gbuffer.resources();
        resources.extend(self.tree.resources());
        resources.extend(self.surfaces.resources());
        resources.extend(table.resources());
        resources.extend([
            ("lights", self.light_list.resource()),
            (
                "pilot_samples",
                Resource::Buffer(self.pilot_samples.as_ref().unwrap_or(&self.nothing)),
            ),
            ("vpls", Resource::Image(&self.light_rays.vpls)),
            ("lattice", self.lattice.resource()),
            ("receivers", Resource::Buffer(&receivers.pixels)),
            ("sample_ranges", Resource::Buffer(&counts.ranges)),
            ("results", Resource::Buffer(results.buffer)),
        ]);
        resources.extend(self.context.modulation());

        let packets = counts.packets(range)?;
        let cost = self.context.cost;
        let mut done = 0;
        while done < count {
            let budget = cost
                .borrow()
                .budget(pipeline.module.name, FIRST_SUBMISSION_RAYS);
            // Adds whole workgroups until the submission is full.
            let (mut receiver_count, mut rays, mut most_packets) = (0, 0, 0);
            let groups = packets[done as usize..].chunks(receivers_per_group as usize);
            for group in groups.take(MAX_GROUPS as usize) {
                if rays > 0 && (rays + light_rays_along) as f64 >= budget {
                    break;
                }
                receiver_count += group.len() as u32;
                most_packets = group.iter().copied().fold(most_packets, u32::max);
                let packets: u64 = group.iter().copied().map(u64::from).sum();
                rays += packets * u64::from(PACKET_SAMPLES) * rays_per_sample;
            }
            self.context.record(|recorder| {
                recorder.pass("final_gather", |recorder| {
                    let groups = [receiver_count.div_ceil(receivers_per_group), 1, 1];
                    let first_packets = (0..most_packets.max(1)).step_by(packets_at_once);
                    for skipped_packets in first_packets {
                        for first_light in (0..light_count.max(1)).step_by(lights_at_once) {
                            let is_first = skipped_packets == 0 && first_light == 0;
                            let parameters = FinalGatherParameters {
                                camera_position: self.context.camera_position(),
                                first_receiver: first + done,
                                receiver_count,
                                first_result: results.first + done,
                                adds: (results.adds || !is_first).into(),
                                skipped_packets,
                                packet_count: packets_at_once as u32,
                                first_light,
                                light_count: (light_count - first_light).min(lights_at_once as u32),
                                set_size: table.set_size,
                                set_count: light_rays.set_count,
                                is_pilot: self.pilot_samples.is_some().into(),
                                seed: seed ^ own_seed,
                                ..FinalGatherParameters::default()
                            };
                            if !is_first {
                                recorder.barrier();
                            }
                            recorder.dispatch(&pipeline, &resources, &parameters, groups)?;
                        }
                    }
                    Ok(())
                })
            })?;
            self.context.finish_work(Work {
                pass: "final_gather",
                kernel: pipeline.module.name,
                amount: rays,
                along: std::mem::take(&mut light_rays_along),
            })?;
            done += receiver_count;
            proceed(f64::from(done) / f64::from(count))?;
        }
        Ok(())
    }
}
