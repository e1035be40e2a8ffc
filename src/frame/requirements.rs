//! What a frame needs of a device. Those who allocate it declare it, and it is checked before any work starts.

use super::{
    images::{FrameImages, FrameImagesKey},
    indirect::{AntialiasedBounceResources, RefinementResources},
    readback::buffer_bytes,
};
use crate::{
    Result,
    geometry::GeometrySize,
    output::{FrameParts, Layer},
    passes::{
        final_gather, hits, light, materials, primary_rays, rays, rsm::Rsm, shadow::ShadowMap,
        surface, textures, trace::RayList, vpl::VplLists,
    },
    plan::Plan,
    scene::{Scene, Shadow},
    vulkan::{
        Allocate, BufferUse, DeviceInfo, DeviceKind, GrowsWith, Requirements,
        shaders::most_storage_images,
    },
};

/// Most triangles that a pixel can tell apart: whole numbers that are exact in f32.
const MAX_TRIANGLES: u64 = 1 << 24;
/// Most triangles, of all instances, that a ray can tell apart.
const MAX_PLACED_TRIANGLES: u64 = 1 << 28;
/// The maps of all lights are kept if they take no more than the device's memory divided by this.
const MAPS_SHARE_OF_MEMORY: u64 = 8;
/// Approximate memory of the samples of pixels for the error estimate, and of those of a pilot, for any scene.
const SAMPLE_BYTES: u64 = 640 << 10;
const PILOT_BYTES: u64 = 1792 << 10;
const WORD_BYTES: u64 = 4;
/// More frames at a time do not help a GPU.
const MOST_FRAMES_IN_FLIGHT: u64 = 4;

impl Plan {
    /// Plans a frame of a valid scene.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) for an invalid scene,
    /// [`Error::DeviceLimit`](crate::Error::DeviceLimit) if the device cannot hold what the scene needs.
    pub fn new(scene: &Scene, device: &DeviceInfo) -> Result<Plan> {
        let mut plan = Plan::for_scene(scene, device)?;
        let unlimited = Requirements::without_limits(plan.image_block_rows);
        maps(&plan, &unlimited)?;
        let lights = scene.lights.len().max(1) as u32;
        if unlimited.total().saturating_mul(lights.into())
            <= device.limits.memory_bytes / MAPS_SHARE_OF_MEMORY
        {
            plan.map_sets = lights;
        }

        let requirements = Requirements::new(device);
        declare(&plan, scene, &requirements)?;
        requirements.check_memory(plan.layer_bytes_of(device))?;
        Ok(plan)
    }

    /// Bytes of the frame's layers in the memory of the device, if it is also the host's.
    fn layer_bytes_of(&self, device: &DeviceInfo) -> u64 {
        match device.kind {
            DeviceKind::Cpu | DeviceKind::Integrated => self.layer_bytes(),
            _ => 0,
        }
    }

    /// Upper bound of the device memory that a frame of the scene holds at any time, bytes. It does not include what the driver adds
    /// to images. It is close to what is held (`tests/hard/device_memory.rs`).
    pub fn device_memory_bytes(&self, scene: &Scene) -> u64 {
        let unlimited = Requirements::without_limits(self.image_block_rows);
        // Without limits nothing is refused.
        let declared = declare(self, scene, &unlimited);
        declared.map_or(u64::MAX, |()| unlimited.total())
    }

    /// How many such frames to render at a time, each with a renderer of its own: on a GPU as many as its memory holds, up to four. The GPU
    /// works on one of them while the host decides what the others need next. A CPU driver uses the host's threads, so it is one there.
    ///
    /// Renderers of a device share what is the same in their scenes. `keeps_surfaces`: all frames have the same meshes at the same places,
    /// with the same materials and textures.
    pub fn frames_in_flight(
        &self,
        scene: &Scene,
        device: &DeviceInfo,
        keeps_surfaces: bool,
    ) -> usize {
        if device.kind == DeviceKind::Cpu {
            return 1;
        }
        let requirements = Requirements::without_limits(self.image_block_rows);
        if declare(self, scene, &requirements).is_err() {
            return 1;
        }
        let shared = match keeps_surfaces {
            true => requirements.bytes(GrowsWith::Scene),
            false => 0,
        };
        let whole = requirements.total() + self.layer_bytes_of(device);
        let own = whole.saturating_sub(shared).max(1);
        let room = device.limits.memory_bytes.saturating_sub(shared);
        (room / own).clamp(1, MOST_FRAMES_IN_FLIGHT) as usize
    }

    /// Bytes of the frame's layers, which are stored in the host's memory, without those on request.
    pub fn layer_bytes(&self) -> u64 {
        let parts = FrameParts {
            has_sensor: self.joule_per_irradiance.is_some(),
            counted: self.counted_electrons,
            has_indirect: self.indirect.is_some(),
            bounces: self.bounces(),
            has_emission: self.is_emissive,
            has_samples: self.pixel_sampling.is_some(),
            has_stderr: self.has_stderr_layer(),
            tof: self.tof.map(|tof| [tof.frequency_count, tof.phase_count]),
        };
        let layers = Layer::all().filter(|l| !l.is_on_request() && l.is_made_with(parts));
        let words: usize = layers.map(|layer| layer.channel_names().len()).sum();
        self.pixel_count() * words as u64 * WORD_BYTES
    }

    fn pixel_count(&self) -> u64 {
        self.resolution_px.map(u64::from).iter().product()
    }
}

/// Declares everything that a frame holds when it holds most.
fn declare(plan: &Plan, scene: &Scene, requirements: &Requirements) -> Result<()> {
    let images = requirements.of(GrowsWith::Resolution);
    FrameImages::new(&images, plan, FrameImagesKey::new(plan, false, false))?;
    for _ in 0..plan.map_sets {
        maps(plan, requirements)?;
    }
    if plan.bounce().is_some() {
        let vpls = requirements.of(GrowsWith::Rsm);
        VplLists::for_plan(&vpls, plan)?;
    }
    light::declare(&requirements.of(GrowsWith::Rsm), plan)?;
    // After the copies of the scene.
    requirements.either_later(|requirements| gathering(plan, requirements), |_| Ok(()))?;
    // The renderer keeps it from frame to frame.
    let readback = requirements.of(GrowsWith::Resolution);
    let bytes = buffer_bytes(plan, requirements.limits());
    readback.buffer("readback", bytes, BufferUse::Readback)?;
    surfaces(plan, scene, requirements)
}

/// Declares what one light sees.
fn maps(plan: &Plan, requirements: &Requirements) -> Result<()> {
    Rsm::for_plan(&requirements.of(GrowsWith::Rsm), plan)?;
    ShadowMap::for_plan(&requirements.of(GrowsWith::Resolution), plan)?;
    Ok(())
}

fn gathering(plan: &Plan, requirements: &Requirements) -> Result<()> {
    let Some(indirect) = plan.bounce() else {
        return Ok(());
    };
    let images = requirements.of(GrowsWith::Resolution);
    let stride = indirect.refinement.coarsest_stride;
    let is_noiseless = !indirect.is_final_gather();
    let refinement = |requirements: &Requirements| {
        let images = requirements.of(GrowsWith::Resolution);
        RefinementResources::new(&images, plan, stride, is_noiseless).map(|_| ())
    };
    match plan.pixel_sampling {
        None => refinement(requirements)?,
        Some(_) => requirements.either_later(refinement, |requirements| {
            let images = requirements.of(GrowsWith::Resolution);
            AntialiasedBounceResources::new(&images, plan).map(|_| ())
        })?,
    }
    images.buffer("sample of pixels", SAMPLE_BYTES, BufferUse::Device)?;
    if indirect.is_final_gather() {
        images.buffer("pilot", PILOT_BYTES, BufferUse::Readback)?;
        let sampling = requirements.of(GrowsWith::Rsm);
        final_gather::declare(&sampling, plan, indirect.emission_size)?;
    }
    Ok(())
}

/// Declares the scene for the raster passes and for rays.
fn surfaces(plan: &Plan, scene: &Scene, requirements: &Requirements) -> Result<()> {
    let of_scene = || requirements.of(GrowsWith::Scene);
    surface::declare(&of_scene(), scene, plan)?;
    if plan.needs_materials() {
        let fewer = "use fewer materials, or choose another device";
        materials::declare(&of_scene().with_hint(fewer), scene)?;
    }
    if plan.reads_texcoords() {
        let smaller = "scale the textures down, or choose another device";
        textures::declare(&of_scene().with_hint(smaller), scene)?;
    }
    let triangles = GeometrySize::of(scene).triangles;
    of_scene().check("the number of triangles", triangles, |_| MAX_TRIANGLES)?;
    let placed = scene.triangle_count();
    of_scene().check("the number of triangles of all instances", placed, |_| {
        MAX_PLACED_TRIANGLES
    })?;
    if let Some(tracer) = plan.tracer {
        let without_rays = [
            (plan.has_distortion, "a lens without distortion"),
            (scene.direct.shadow == Some(Shadow::Rays), "shadow maps"),
            (plan.has_final_gather(), "the instant-radiosity estimator"),
        ];
        let without_rays = without_rays.iter().filter(|(has_rays, _)| *has_rays);
        let without_rays: Vec<&str> = without_rays.map(|&(_, without)| without).collect();
        let without_rays = match &without_rays[..] {
            // Rays are used because the rasteriser is too coarse.
            [] => String::new(),
            some => format!("use {}, ", some.join(" and ")),
        };
        let hint = format!("{without_rays}simplify the meshes, or choose another device");
        rays::declare(&of_scene().with_hint(hint), scene, tracer)?;
        RayList::for_plan(&requirements.of(GrowsWith::Resolution), plan)?;
    }
    for (is_there, name, passes, without) in [
        (
            plan.has_final_gather(),
            "final gathering",
            &["final_gather_shade", "light_rays"][..],
            "the instant-radiosity estimator",
        ),
        (
            plan.has_distortion,
            "primary rays",
            &["primary_rays"],
            "a lens without distortion",
        ),
        (
            plan.has_cutouts,
            "shadows of cut-outs",
            &["trace"],
            "materials without map_d",
        ),
    ] {
        let hint = format!("use {without}, or choose another device");
        let of_scene = of_scene().with_hint(hint);
        let count = most_storage_images(passes);
        let what = format!("the number of storage images that a kernel of {name} reads");
        if is_there {
            of_scene.check(&what, count, |limits| limits.max_storage_images.into())?;
        }
    }
    if plan.shades_hits() {
        let fewer = "simplify the meshes, or choose another device";
        hits::declare(&of_scene().with_hint(fewer), scene)?;
    }
    primary_rays::declare(&requirements.of(GrowsWith::Resolution), plan)
}
