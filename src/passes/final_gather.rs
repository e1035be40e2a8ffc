//! Final gathering: the bounces at a list of receivers, with rays from the receivers and from the lights. [`FinalGather::take`] is
//! the sequence of its passes: emit rays, trace them, shade what they hit, and sum up.

use std::ops::Range;

use super::{
    Context,
    cost::WorkKind,
    gatherer::{GatheredFor, Gatherer, LightRaySets, Results, Samples},
    gbuffer::GBuffer,
    hits::HitScene,
    kernels::{extend_key, shade_key},
    light::DeviceLight,
    light_paths,
    light_rays::LightRays,
    packets::{Chunk, ChunkLimits, chunks},
    random::hash,
    ray_table::RayTable,
    receivers::{ListedReceivers, ReceiverRange},
    refinement::RefinementImages,
    sample_counts::PACKET_SAMPLES,
    trace::{Find, no_list},
    unoccluded,
    vpl_sampler::{Pilot, VplSampler},
};
use crate::{
    Error, LocalSpace, Result, lattice,
    parallel::for_each_at_once,
    plan::{PacketRays, Plan},
    vulkan::{
        Allocate, Buffer, BufferUse, CommandPool, Resource, TexelList, groups_in_rows,
        shaders::{
            self, FinalGatherParameters, Key, Packet, PilotSample, Receiver, Span, constants::LANES,
        },
    },
};

/// Rays, and the work that comes with them.
pub(super) const RAYS: WorkKind = WorkKind {
    pass: "final_gather",
    kernel: "final_gather",
    done_by: &["final_gather", "trace", "light_rays", "light_paths"],
    first: 5e5,
};

/// Most samples of a receiver.
pub(crate) const MAX_SAMPLES: u32 = 1 << 16;
/// Seed of the light rays for light without occlusion, different from those of images and estimates.
const UNOCCLUDED_SEED: u32 = 0x3000_0000;
/// Share of the loop iterations allowed by the driver that an invocation uses.
const SHARE_OF_LOOP_ITERATIONS: f64 = 0.9;
/// Packets that a workgroup of most passes processes: an invocation takes eight samples.
const PACKETS_OF_GROUP: u32 = 8;

/// The state of the pass.
pub(crate) struct FinalGather<'b> {
    pub context: &'b Context<'b>,
    scene: HitScene<'b>,
    lights: Vec<&'b DeviceLight>,
    light_list: TexelList,
    light_rays: LightRays,
    /// One for the image, one for error estimates.
    sampling: [LightSampling; 2],
    /// The light rays that were traced last.
    sent: Option<LightRaySets>,
    /// As [`light_paths::assumed_area`] computes it.
    assumed_area: f64,
    /// Density of the points of emissive surfaces, as a [`DeviceLight`] has it.
    emission_density: f64,
    /// Whether gathers of the image send rays to VPLs.
    sends_to_vpls: bool,
    /// What each ray to a VPL finds; only during a pilot.
    pilot_samples: Option<Buffer>,
    /// Those of more than one bounce.
    paths: Buffer,
    nothing: Buffer,
    lattice: &'b TexelList,
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
    // Each packet has two rays per sample at least.
    let packets = u64::from(plan.rays_at_once / PACKET_SAMPLES / 2);
    allocate.buffer(
        "packets",
        packets * size_of::<Packet>() as u64,
        BufferUse::Upload,
    )?;
    allocate.buffer(
        "spans",
        packets * size_of::<Span>() as u64,
        BufferUse::Upload,
    )?;
    allocate.buffer("longer paths", path_bytes(plan), BufferUse::Device)?;
    let numbers = plan
        .lights
        .iter()
        .map(|light| light.pattern_numbers.div_ceil(4) + 3 * light.emission_points);
    let texels = numbers.map(|numbers| 32 + u64::from(numbers)).sum();
    TexelList::declare(allocate, "lights", texels)
}

/// Bytes of the longer paths in memory at a time.
fn path_bytes(plan: &Plan) -> u64 {
    let of_lobes = [1, 2].map(|lobes| {
        let rays = PacketRays::new(plan, lobes);
        u64::from(plan.rays_at_once / rays.of_packet() * rays.paths())
    });
    of_lobes[0].max(of_lobes[1]) * size_of::<shaders::Path>() as u64
}

/// The points that samples are drawn from.
pub(crate) fn upload_lattice(commands: &CommandPool) -> Result<TexelList> {
    let points = lattice::sequence(MAX_SAMPLES).into_iter();
    let points = points.map(|[x, y]| [x, y, 0.0, 0.0]);
    TexelList::new(commands, "lattice", points.collect())
}

/// The texels of `shaders/shared/lights.wgsl`: the lights in the layout of a buffer, then their patterns and points.
fn list_of(lights: &[&DeviceLight], space: &LocalSpace) -> Result<Vec<[f32; 4]>> {
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
        patterns.extend(light.point_texels(space));
    }
    let texels = bytemuck::try_cast_slice::<_, [f32; 4]>(&parameters)
        .map_err(|_| Error::internal("lights are not whole texels"))?;
    Ok([texels, &patterns].concat())
}

impl<'b> FinalGather<'b> {
    pub fn new(
        context: &'b Context<'b>,
        scene: HitScene<'b>,
        lattice: &'b TexelList,
        lights: Vec<&'b DeviceLight>,
    ) -> Result<FinalGather<'b>> {
        let device = context.device;
        Ok(FinalGather {
            context,
            scene,
            light_list: TexelList::new(
                context.commands,
                "lights",
                list_of(&lights, context.space)?,
            )?,
            light_rays: LightRays::new(device, context.plan)?,
            sampling: [(); 2].map(|()| LightSampling::even(&lights)),
            sent: None,
            assumed_area: light_paths::assumed_area(context),
            emission_density: lights
                .iter()
                .map(|light| light.emission_density(context.space))
                .sum(),
            lights,
            sends_to_vpls: true,
            pilot_samples: None,
            paths: Buffer::new(
                device,
                "longer paths",
                path_bytes(context.plan),
                BufferUse::Device,
            )?,
            nothing: Buffer::new(device, "nothing", 0, BufferUse::Device)?,
            lattice,
        })
    }

    /// Traces rays from the lights for results from `first_result` on, unless the last rays were for the same samples.
    /// Returns the number of rays.
    fn send_light_rays(&mut self, wanted: LightRaySets, first_result: u32) -> Result<u64> {
        if self.sent == Some(wanted) {
            return Ok(0);
        }
        let sampling = &mut self.sampling[wanted.gathered_for as usize];
        let is_pilot = self.pilot_samples.is_some();
        if is_pilot {
            sampling.pilot_rays.push((first_result, wanted.seed));
        }
        let set_size = wanted.set_size(is_pilot);
        let table = match sampling.table.take() {
            Some(table) if table.is_for(set_size) => table,
            _ => {
                let Context { commands, plan, .. } = *self.context;
                let area = self.assumed_area;
                sampling
                    .sampler
                    .table(commands, set_size, plan.bounces(), area)?
            }
        };
        let count = self.light_rays.trace(
            self.context,
            self.scene,
            &self.lights,
            &self.light_list,
            sampling.table.insert(table),
            wanted,
        )?;
        self.sent = Some(wanted);
        Ok(count)
    }

    /// Packets of a receiver, and lights, that an invocation of the sum takes within the loop iterations that the driver allows.
    fn summed_at_once(&self, lobes: u32) -> (u32, u32) {
        let gathered = self.context.plan.gathered_lights();
        let lights = gathered.max(self.lights.len() as u32);
        let Some(most) = self.context.device.info().quirks.max_loop_iterations else {
            return (u32::MAX, lights);
        };
        let most = (SHARE_OF_LOOP_ITERATIONS * f64::from(most)) as u32;
        // Pairs of samples; and of a pilot, each sample.
        let of_light = lobes * (PACKET_SAMPLES / 2 + 1);
        let of_packet = (lights * of_light).saturating_add(2 * PACKET_SAMPLES);
        (
            (most / of_packet).max(1),
            (most / of_light).clamp(1, lights.max(1)),
        )
    }

    /// Takes the samples of a chunk of packets.
    fn take(&self, gather: &Gather, chunk: &Chunk, lights_at_once: u32) -> Result<()> {
        let (context, tree) = (self.context, self.scene.tree);
        let device = context.device;
        let packets = Buffer::upload(device, "packets", &chunk.packets)?;
        let spans = Buffer::upload(device, "spans", &chunk.spans)?;
        let packet_count = chunk.packets.len() as u32;
        let of_packets = groups_in_rows(packet_count.div_ceil(PACKETS_OF_GROUP));
        let of_lobes = groups_in_rows((gather.lobes * packet_count).div_ceil(PACKETS_OF_GROUP));
        let of_spans = groups_in_rows((chunk.spans.len() as u32).div_ceil(64));
        let parameters = FinalGatherParameters {
            packet_count,
            span_count: chunk.spans.len() as u32,
            first_to_light: gather.rays.first_to_light(packet_count),
            ..gather.parameters
        };
        let longer_paths = gather.rays.longer_paths(parameters, &gather.vpls);
        let dispatch = |key: Key, parameters: &FinalGatherParameters, groups| {
            let list = context.rays.borrow();
            let list = list.as_ref().ok_or_else(no_list)?;
            let mut resources = gather.resources.clone();
            resources.extend(list.resources());
            resources.extend([
                ("packets", Resource::Buffer(&packets)),
                ("spans", Resource::Buffer(&spans)),
                ("paths", Resource::Buffer(&self.paths)),
            ]);
            context.dispatch_groups(key, &resources, parameters, groups)
        };
        let plan = context.plan;
        let (phasors, receiver) = (plan.has_phasors(), gather.receiver);
        let directions = PACKET_SAMPLES * gather.lobes * packet_count;
        if packet_count > 0 {
            dispatch(Key::FinalGatherEmit { receiver }, &parameters, of_packets)?;
            let first_to_light = parameters.first_to_light;
            let mut to_light = first_to_light..packet_count * gather.rays.of_packet();
            match parameters.vpl_samples {
                0 => to_light.start += PACKET_SAMPLES * packet_count,
                _ => {
                    let key = Key::FinalGatherDraw { phasors, receiver };
                    dispatch(key, &parameters, of_packets)?;
                }
            }
            tree.trace(context, Find::Closest, 0..directions)?;
            for light_index in 0..parameters.light_end {
                let parameters = FinalGatherParameters {
                    light_index,
                    ..parameters
                };
                let is_emission = light_index == self.lights.len() as u32;
                let key = shade_key(plan, receiver, is_emission, false);
                dispatch(key, &parameters, of_lobes)?;
            }
            for (bounces, parameters) in (2..).zip(&longer_paths) {
                let paths = gather.lobes * packet_count * parameters.path_count;
                let groups = groups_in_rows(paths.div_ceil(64));
                dispatch(extend_key(plan, receiver, bounces), parameters, groups)?;
                let first = parameters.first_path;
                tree.trace(context, Find::Closest, first..first + paths)?;
                let lanes = parameters.path_count.min(LANES);
                let groups = groups_in_rows((gather.lobes * packet_count * lanes).div_ceil(64));
                for light_index in 0..parameters.light_end {
                    let parameters = FinalGatherParameters {
                        light_index,
                        ..*parameters
                    };
                    let key = shade_key(plan, receiver, false, true);
                    dispatch(key, &parameters, groups)?;
                }
            }
            tree.trace(context, Find::Any, to_light)?;
        }
        let sum = |parameters: &FinalGatherParameters, deep: bool| {
            let lights = parameters.light_end;
            // Without lights, there are VPLs.
            for light_index in (0..lights.max(1)).step_by(lights_at_once as usize) {
                let is_first = light_index == 0;
                let parameters = FinalGatherParameters {
                    light_index,
                    light_end: lights.min(light_index.saturating_add(lights_at_once)),
                    vpl_samples: if is_first { parameters.vpl_samples } else { 0 },
                    ..*parameters
                };
                let key = Key::FinalGatherSum {
                    phasors,
                    receiver,
                    deep,
                };
                dispatch(key, &parameters, of_spans)?;
            }
            Ok(())
        };
        sum(&parameters, false)?;
        for parameters in &longer_paths {
            sum(parameters, true)?;
        }
        Ok(())
    }
}

/// What all chunks of a gather share.
struct Gather<'g> {
    lobes: u32,
    rays: PacketRays,
    /// VPLs of a set for the longer paths, bounce by bounce.
    vpls: Vec<Range<u32>>,
    receiver: Receiver,
    resources: Vec<(&'static str, Resource<'g>)>,
    parameters: FinalGatherParameters,
}

impl Gatherer for FinalGather<'_> {
    fn pass(&self) -> &'static str {
        "final_gather"
    }

    fn is_noiseless(&self) -> bool {
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

    fn fill_unoccluded(
        &mut self,
        gbuffer: &GBuffer,
        images: &RefinementImages,
        proceed: &mut dyn FnMut() -> Result<()>,
    ) -> Result<bool> {
        let few = LightRaySets {
            seed: UNOCCLUDED_SEED ^ hash(self.context.seed),
            gathered_for: GatheredFor::Image,
            samples: 0,
            receivers: u32::MAX,
            set_count: 1,
        };
        self.send_light_rays(few, 0)?;
        let table = self.sampling[GatheredFor::Image as usize].table.as_ref();
        let vpl_count = table.map_or(0, |table| table.set_size);
        // The pass sums over all of them.
        if vpl_count == 0 || self.context.plan.gathers_last_bounce_alone() {
            return Ok(false);
        }
        let vpls = &self.light_rays.vpls;
        unoccluded::fill(self.context, gbuffer, images, vpls, vpl_count, proceed)?;
        Ok(true)
    }

    fn send_to_vpls(&mut self, sends: bool) {
        self.sends_to_vpls = sends;
    }

    /// Gathers with packets of samples of each technique.
    fn gather(
        &mut self,
        receivers: ListedReceivers,
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
        } = receivers.range;
        if count == 0 {
            return Ok(());
        }
        let is_estimate = light_rays.gathered_for == GatheredFor::Estimate;
        let sends_to_vpls = self.sends_to_vpls || is_estimate || self.pilot_samples.is_some();
        let wanted = LightRaySets {
            seed: light_rays.seed ^ own_seed,
            samples: if sends_to_vpls { light_rays.samples } else { 0 },
            ..light_rays
        };
        self.context.begin_work(RAYS)?;
        let mut light_rays_along = self.send_light_rays(wanted, results.first)?;
        let Some(table) = &self.sampling[light_rays.gathered_for as usize].table else {
            return Err(Error::internal("no rays were sent from the lights"));
        };
        let mut resources = receivers.gbuffer.resources();
        resources.extend(self.scene.resources());
        resources.extend(table.resources());
        resources.extend([
            ("lights", self.light_list.resource()),
            (
                "pilot_samples",
                Resource::Buffer(self.pilot_samples.as_ref().unwrap_or(&self.nothing)),
            ),
            ("vpls", Resource::Image(&self.light_rays.vpls)),
            ("lattice", self.lattice.resource()),
            ("receivers", Resource::Buffer(&receivers.list.pixels)),
            ("results", Resource::Buffer(results.buffer)),
        ]);
        resources.extend(self.context.modulation());
        let lobes = if is_glossy { 2 } else { 1 };
        let plan = self.context.plan;
        let rays = PacketRays::new(plan, lobes);
        let (bounces, is_alone) = (plan.bounces(), plan.gathers_last_bounce_alone());
        let vpls = match is_alone {
            true => table.vpls_of(bounces, true),
            // With the points of surfaces that emit.
            false => 0..table.set_size,
        };
        let gather = Gather {
            lobes,
            rays,
            // Beyond these VPLs, paths would have more bounces than there may be.
            vpls: (1..bounces)
                .rev()
                .map(|left| table.vpls_of(left, is_alone))
                .collect(),
            receiver: plan.receiver(is_glossy),
            resources,
            parameters: FinalGatherParameters {
                camera_position: self.context.camera_position(),
                set_size: table.set_size,
                set_count: light_rays.set_count,
                vpl_samples: if !vpls.is_empty() && sends_to_vpls {
                    PACKET_SAMPLES
                } else {
                    0
                },
                first_vpl: vpls.start,
                vpl_count: vpls.len() as u32,
                light_end: plan.gathered_lights(),
                is_pilot: self.pilot_samples.is_some().into(),
                result_offset: results.first.wrapping_sub(first),
                seed: seed ^ own_seed,
                reflected_density: table.reflected_density,
                emission_density: (table.point_share() * self.emission_density) as f32,
                ..FinalGatherParameters::default()
            },
        };
        // The list has room for rays to VPLs in any case.
        let rays_per_packet = match gather.parameters.vpl_samples {
            0 => rays.without_vpls(),
            _ => rays.of_packet(),
        };
        let (packets_of_span, lights_at_once) = self.summed_at_once(lobes);
        let ranges = counts.ranges(receivers.range)?;
        let mut chunks = chunks(&ranges, first, results);
        let most = self.context.plan.rays_at_once / rays.of_packet();
        loop {
            let room = self.context.room_for(RAYS);
            let in_budget = (room - light_rays_along as f64) / f64::from(rays_per_packet);
            let limits = ChunkLimits {
                packets: (in_budget as u32).min(most).max(1),
                packets_of_span,
            };
            let Some(chunk) = chunks.next(limits) else {
                return Ok(());
            };
            self.take(&gather, &chunk, lights_at_once)?;
            let rays = u64::from(rays_per_packet) * chunk.packets.len() as u64;
            let along = std::mem::take(&mut light_rays_along);
            self.context.add_work(RAYS, rays, along)?;
            proceed(chunk.done)?;
        }
    }
}
