//! Plans what a scene needs, before any work starts. Only the plan picks passes and kernel permutations; it can be printed.

mod axes;
mod display;
mod indirect;
mod kernels;
mod packet_rays;
mod steps;

pub(crate) use axes::surface_axis;
pub(crate) use indirect::GatheredPart;
pub use indirect::{GatherPlan, IndirectPlan, RefinementPlan};
pub use kernels::{GatherKernel, Tracer};
pub(crate) use packet_rays::PacketRays;
pub(crate) use steps::GridStep;

use crate::{
    Result,
    emission::EmissionDomain,
    geometry::has_shared_meshes,
    scene::{
        CountedElectrons, DEFAULT_TARGET_ERROR, Material, Mesh, PixelSampling, PlacedLight, Scene,
        Shadow, TextureLookup, TextureRole,
    },
    vulkan::{
        DeviceInfo, DeviceKind,
        shaders::{Falloff, most_storage_images},
    },
};

/// Bounds of the edge of the shared shadow map, texels. Lights whose RSM is too coarse share this map.
const SHADOW_SIZE: std::ops::RangeInclusive<u32> = 256..=2048;
/// Texels of that map per triangle of the scene. With fewer, many triangles are missing from the map.
const SHADOW_TEXELS_PER_TRIANGLE: f64 = 8.0;
/// Least sub-pixel bits of the rasterisers of GPUs.
const FINE_SUB_PIXEL_BITS: u32 = 8;
/// Most rays in memory at a time. More do not make a device faster, but a CPU loses them from its caches.
const MAX_RAYS_OF_CPU: u64 = 1 << 19;
const MAX_RAYS_OF_GPU: u64 = 1 << 22;
/// Memory of a ray, what it hits and what it contributes.
const BYTES_PER_RAY: u64 = 80;
/// Points on emissive surfaces from which samples of their light start. Each frame draws others.
const EMISSION_POINTS: u32 = 1 << 16;

/// The passes and permutations that a frame needs on a device.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    pub resolution_px: [u32; 2],
    /// Some material has a specular lobe.
    pub is_specular: bool,
    /// Some material is of microfacets.
    pub has_microfacets: bool,
    /// Some mesh has shading normals.
    pub is_smooth: bool,
    /// Some visible material has a texture.
    pub is_textured: bool,
    /// Some visible surface has more than a texture of k_d: colours of vertices, other textures, or another way to look one up. Its mesh then
    /// also counts as smooth.
    pub is_detailed: bool,
    /// Some visible material has an alpha texture. All surfaces that rays hit are then shaded as detailed ones.
    pub has_cutouts: bool,
    /// Some visible material is one-sided: the camera looks through its back.
    pub has_one_sided: bool,
    /// Whether instances share meshes on the device.
    pub has_shared_meshes: bool,
    /// The camera's lens distorts the image.
    pub has_distortion: bool,
    /// All rays of the camera are parallel: no light is off its axis.
    pub(crate) is_orthographic: bool,
    /// Some surface emits light.
    pub is_emissive: bool,
    /// How light is averaged over the pixels.
    pub pixel_sampling: Option<PixelSampling>,
    /// Rays find what the camera sees, and not the rasteriser.
    pub has_primary_rays: bool,
    /// What finds the triangles that rays hit; `None` if nothing casts rays.
    pub tracer: Option<Tracer>,
    /// Most rays that are in memory at a time.
    pub(crate) rays_at_once: u32,
    pub lights: Vec<LightPlan>,
    /// Sets of images for what lights see: one per light if they fit, else one that the lights use one after the other.
    pub map_sets: u32,
    pub indirect: Option<IndirectPlan>,
    /// What the host counts of the energy; `None` if nothing.
    pub counted_electrons: Option<CountedElectrons>,
    /// Joules per W/m² on the pixel; `None` without a sensor.
    pub joule_per_irradiance: Option<f64>,
    /// Irradiance on the pixel over the radiance of light along the axis, sr; `None` without an aperture.
    pub irradiance_per_radiance: Option<f64>,
    /// How the light off the axis falls, if it was measured; `None`: by cos⁴.
    pub(crate) vignetting: Option<Falloff>,
    /// `None` without time of flight.
    pub tof: Option<TofPlan>,
    /// Requested relRMSE of the direct light of lights with an area; `None` without such lights.
    pub target_area_light_error: Option<f64>,
    /// Images on the device are laid out in whole blocks of this many rows.
    pub(crate) image_block_rows: u32,
}

/// What time of flight needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TofPlan {
    pub frequency_count: u32,
    pub phase_count: u32,
    /// Number of bands that the pixels see.
    pub band_count: u32,
}

impl TofPlan {
    /// Layers of an image of phasors: each holds two frequencies.
    pub(crate) fn pair_count(self) -> u32 {
        self.frequency_count.div_ceil(2)
    }
}

/// What one light needs.
#[derive(Debug, Clone, PartialEq)]
pub struct LightPlan {
    pub kind: &'static str,
    pub(crate) has_area: bool,
    /// Points that stand for emissive surfaces; 0 for other lights.
    pub(crate) emission_points: u32,
    /// Number of faces that the light emits into.
    pub faces: u32,
    /// Whether the light is modulated; only with time of flight.
    pub is_modulated: bool,
    /// Count of the numbers of a pattern, such as angles and intensities; 0 without a pattern.
    pub pattern_numbers: u32,
    pub shadow: ShadowPlan,
}

/// How the shadow test of a light finds occluders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShadowPlan {
    /// In the light's RSM, which is fine enough.
    Rsm { size: u32 },
    /// In the light's own map. The size is the edge of a face, texels.
    Map { size: u32 },
    /// With rays among all triangles.
    Rays,
}

impl ShadowPlan {
    /// Edge of a face of the map that the shadow test reads, texels; `None` if it reads none.
    pub fn map_size(self) -> Option<u32> {
        match self {
            ShadowPlan::Rsm { size } | ShadowPlan::Map { size } => Some(size),
            ShadowPlan::Rays => None,
        }
    }

    /// Edge of a face of the light's own map, texels; `None` if it has none.
    pub(crate) fn own_map_size(self) -> Option<u32> {
        match self {
            ShadowPlan::Map { size } => Some(size),
            ShadowPlan::Rsm { .. } | ShadowPlan::Rays => None,
        }
    }
}

impl Plan {
    /// Plans for a scene, without checking that the device can hold it.
    pub(crate) fn for_scene(scene: &Scene, device: &DeviceInfo) -> Result<Plan> {
        scene.validate()?;
        let scene = &*scene.with_emissive_light();
        let tof = scene.tof.as_ref().map(|tof| TofPlan {
            frequency_count: tof.frequencies_hz.len() as u32,
            phase_count: tof.phase_count,
            band_count: tof.band_weights.iter().filter(|w| **w != 0.0).count() as u32,
        });
        let is_modulated = |light| scene.tof.as_ref().is_some_and(|t| t.is_modulated(light));
        let distinct_meshes = scene.distinct_meshes();
        let meshes = || distinct_meshes.iter();
        let is_specular = |mesh: &Mesh| scene.has_material(mesh, Material::is_specular);
        let has_microfacets =
            |mesh: &Mesh| scene.has_material(mesh, |material| material.microfacets.is_some());
        let is_one_sided = |mesh: &Mesh| scene.has_material(mesh, |m| m.is_one_sided);
        let is_textured = meshes().any(|mesh| {
            let shows = |(_, lookup)| mesh.shows(&lookup);
            scene.has_material(mesh, |material| material.textures().any(shows))
        });
        let is_detailed =
            meshes().any(|mesh| scene.has_material(mesh, |material| is_detailed(mesh, material)));
        let has_cutouts = scene.has_cutouts();
        let has_shared_meshes = has_shared_meshes(scene);
        // Lights that are all off need no passes.
        let lights = match scene.is_dark() {
            true => &[],
            false => &scene.lights[..],
        };
        let bounds = scene.bounding_sphere_or_unit();
        // The faces do not depend on the texels.
        let faces = |light: &PlacedLight| EmissionDomain::new(light, 1, &bounds).faces.len();
        let faces: Vec<usize> = lights.iter().map(faces).collect();
        let fine_enough = shadow_size(scene, faces.iter().copied().min().unwrap_or(1), device);
        let indirect = scene
            .indirect
            .map(|indirect| IndirectPlan::new(indirect, scene, device));
        let has_primary_rays = has_primary_rays(scene, device);
        // If something casts rays anyway, they cost less than a map, and their shadows are exact.
        let has_rays = has_primary_rays || indirect.is_some_and(|i| i.is_final_gather());
        // Rays are also used where the test by a map would be wrong. It takes a triangle with cut-outs as whole.
        // It sees all from one point, but a light with an area shines from many. It names a triangle, but not its instance.
        let has_rays = has_rays || has_cutouts || scene.has_area_light() || has_shared_meshes;
        let shadow = scene.direct.shadow.unwrap_or(match has_rays {
            true => Shadow::Rays,
            false => Shadow::Map,
        });
        // The shadow test uses the RSM's positions if they are as dense as those of a plain map: 64² texels would miss
        // what is smaller than twenty pixels.
        let shadow = match (shadow, indirect.and_then(|indirect| indirect.rsm_size())) {
            (Shadow::Rays, _) => ShadowPlan::Rays,
            (Shadow::Map, Some(size)) if size >= fine_enough => ShadowPlan::Rsm { size },
            (Shadow::Map, _) => ShadowPlan::Map { size: fine_enough },
        };
        let lights = lights.iter().zip(faces);
        let lights = lights.enumerate().map(|(i, (light, faces))| LightPlan {
            kind: light.kind(),
            has_area: light.has_area(),
            emission_points: light.surfaces().map_or(0, |_| EMISSION_POINTS),
            faces: faces as u32,
            is_modulated: is_modulated(i),
            pattern_numbers: light.lamp().map_or(0, |lamp| lamp.profile.number_count()),
            shadow,
        });
        let mut plan = Plan {
            resolution_px: scene.camera.resolution_px,
            is_specular: meshes().any(|mesh| is_specular(mesh)),
            has_microfacets: meshes().any(|mesh| has_microfacets(mesh)),
            is_smooth: is_detailed || has_cutouts || meshes().any(|mesh| !mesh.normals.is_empty()),
            is_textured,
            is_detailed,
            has_cutouts,
            has_one_sided: meshes().any(|mesh| is_one_sided(mesh)),
            has_shared_meshes,
            has_distortion: scene.camera.distortion().is_some(),
            is_orthographic: scene.camera.is_orthographic(),
            is_emissive: scene.has_emission(),
            pixel_sampling: scene.camera.pixel_sampling,
            has_primary_rays,
            tracer: None,
            rays_at_once: 0,
            lights: lights.collect(),
            map_sets: 1,
            image_block_rows: device.quirks.image_block_rows,
            indirect,
            counted_electrons: scene.sensor.and_then(|sensor| sensor.counted_electrons()),
            joule_per_irradiance: scene.sensor.map(|sensor| sensor.joule_per_irradiance()),
            irradiance_per_radiance: scene
                .sensor
                .filter(|sensor| sensor.f_number.is_some())
                .map(|sensor| sensor.irradiance_per_radiance(1.0)),
            vignetting: match scene.sensor.and_then(|sensor| sensor.vignetting) {
                _ if scene.vignetting_map.is_some() => Some(Falloff::Mapped),
                polynomial => polynomial.map(|_| Falloff::Vignetted),
            },
            tof,
            target_area_light_error: (scene.has_area_light() && !scene.is_dark()).then(|| {
                let target = scene.indirect.and_then(|indirect| indirect.target_error());
                target.unwrap_or(DEFAULT_TARGET_ERROR)
            }),
        };
        if plan.casts_rays() {
            plan.tracer = Some(Tracer::best_for(device));
            plan.rays_at_once = rays_at_once(&plan, device);
        }
        Ok(plan)
    }

    /// Changes what finds the triangles that rays hit, if anything casts rays.
    ///
    /// # Errors
    /// [`Error::NoDevice`](crate::Error::NoDevice) if that tracer does not run on the device.
    pub fn trace_by(&mut self, chosen: Tracer, device: &DeviceInfo) -> Result<()> {
        let chosen = chosen.checked_for(device)?;
        if let Some(tracer) = &mut self.tracer {
            *tracer = chosen;
        }
        Ok(())
    }

    /// Whether kernels read the list of materials.
    pub(crate) fn needs_materials(&self) -> bool {
        self.shows_detail() || self.shades_hits()
    }

    /// Whether kernels read texture coordinates, and textures if there are some.
    pub(crate) fn reads_texcoords(&self) -> bool {
        self.is_textured || self.shows_detail()
    }

    /// Whether kernels read `shaders/shared/materials.wgsl` for more than a texture of k_d.
    pub(crate) fn shows_detail(&self) -> bool {
        self.is_detailed || self.has_cutouts
    }

    /// The indirect light to gather; `None` if no light emits anything.
    pub(crate) fn bounce(&self) -> Option<IndirectPlan> {
        self.indirect.filter(|_| !self.lights.is_empty())
    }

    /// Lights of which rays from the hits of P's directions lead to each; and, as one more, what the hits emit by themselves.
    pub(crate) fn gathered_lights(&self) -> u32 {
        if self.gathers_last_bounce_alone() {
            return 0;
        }
        let is_emission = |light: &LightPlan| light.emission_points > 0;
        let emission = u32::from(self.lights.iter().any(is_emission));
        self.lights.len() as u32 + emission
    }

    /// The largest number of faces that a light emits into.
    pub(crate) fn max_faces(&self) -> u32 {
        let faces = self.lights.iter().map(|light| light.faces);
        faces.max().unwrap_or(1)
    }

    /// Edge of a face of the shadow map that lights without a fine RSM share, texels; `None` if no light needs one.
    pub(crate) fn own_map_size(&self) -> Option<u32> {
        let sizes = self.lights.iter().map(|light| light.shadow.own_map_size());
        sizes.max().flatten()
    }

    /// Edge of a face of the RSM, texels; `None` if there is no RSM.
    pub(crate) fn rsm_size(&self) -> Option<u32> {
        self.bounce().and_then(|plan| plan.rsm_size())
    }

    /// Whether the shadow test of some light uses rays.
    pub(crate) fn has_shadow_rays(&self) -> bool {
        let is_by_rays = |light: &LightPlan| light.shadow == ShadowPlan::Rays;
        self.lights.iter().any(is_by_rays)
    }

    fn casts_rays(&self) -> bool {
        self.has_primary_rays || self.has_shadow_rays() || self.has_final_gather()
    }

    /// Whether the standard error of each pixel's indirect light is requested.
    pub(crate) fn has_stderr_layer(&self) -> bool {
        self.indirect.is_some_and(|plan| plan.has_stderr_layer)
    }

    /// Time of flight of the bounce; `None` without a bounce or without a modulated light.
    pub(crate) fn bounced_tof(&self) -> Option<TofPlan> {
        let is_modulated = self.lights.iter().any(|light| light.is_modulated);
        self.tof.filter(|_| is_modulated && self.bounce().is_some())
    }

    /// The target error of range, metres, if there is one and the bounce has phasors.
    pub(crate) fn target_range_error_m(&self) -> Option<f64> {
        self.bounced_tof()?;
        self.bounce()?.refinement.target_range_error_m
    }

    /// Whether surfaces are shaded where rays hit them.
    pub(crate) fn shades_hits(&self) -> bool {
        self.has_final_gather() || self.has_primary_rays
    }

    /// Largest number of surfaces that reflect light on its way from a light to P.
    pub(crate) fn bounces(&self) -> u32 {
        match self.bounce().map(|plan| plan.gather) {
            Some(GatherPlan::FinalGather { bounces }) => bounces,
            _ => 1,
        }
    }

    /// Whether only light of several bounces is gathered, all of the same number.
    pub(crate) fn gathers_last_bounce_alone(&self) -> bool {
        let is_alone = |plan: IndirectPlan| plan.has_last_bounce_alone;
        self.bounces() > 1 && self.bounce().is_some_and(is_alone)
    }

    /// From here on, plans one of the frame's gathers. They share the limits.
    pub(crate) fn gather_part(&mut self, part: GatheredPart) {
        self.indirect = self.indirect.map(|indirect| indirect.of_part(part));
    }

    /// Whether indirect light is gathered by rays.
    pub(crate) fn has_final_gather(&self) -> bool {
        self.bounce().is_some_and(|plan| plan.is_final_gather())
    }
}

/// Whether a material on a mesh needs more than a repeated, bilinear texture of k_d.
pub(crate) fn is_detailed(mesh: &Mesh, material: &Material) -> bool {
    let is_plain = |(role, lookup): (TextureRole, TextureLookup)| {
        let plain = TextureLookup::from(lookup.texture);
        role == TextureRole::Alpha || role == TextureRole::Kd && lookup == plain
    };
    let mut shown = material.textures().filter(|(_, lookup)| mesh.shows(lookup));
    !mesh.colors.is_empty() || !shown.all(is_plain)
}

/// Plans primary rays if the lens bends rays, if surfaces emit, whose light is shaded where rays hit them, or if the rasteriser snaps corners to a grid so coarse that it shows wrong
/// triangles next to edges.
fn has_primary_rays(scene: &Scene, device: &DeviceInfo) -> bool {
    let limits = device.limits;
    let is_coarse = limits.sub_pixel_bits < FINE_SUB_PIXEL_BITS
        && u64::from(limits.max_storage_images) >= most_storage_images(&["primary_rays"]);
    scene.camera.distortion().is_some() || scene.has_emission() || is_coarse
}

/// Most rays that are in memory at a time: enough to fill the device, but at most a tenth of its memory. A row of pixels, and a packet of samples
/// with its rays to all lights, always fit.
fn rays_at_once(plan: &Plan, device: &DeviceInfo) -> u32 {
    let most = match device.kind {
        DeviceKind::Cpu => MAX_RAYS_OF_CPU,
        _ => MAX_RAYS_OF_GPU,
    };
    let limits = &device.limits;
    let fitting = (limits.memory_bytes / 10).min(limits.max_storage_buffer_bytes) / BYTES_PER_RAY;
    let [width, height] = plan.resolution_px.map(u64::from);
    let (needed, at_least) = match plan.has_final_gather() {
        true => (most, PacketRays::new(plan, 2).of_packet().into()),
        false => (width * height, 0),
    };
    let count = fitting.min(most).min(needed);
    count.max(at_least).max(width).min(u32::MAX.into()) as u32
}

/// Edge of a face of a shadow map that is fine enough for every light, so that the lights can share one.
///
/// Shadow edges are those of triangles, not of texels. Half the pixels' density is enough to find the triangles,
/// unless they are much smaller than the texels.
fn shadow_size(scene: &Scene, fewest_faces: usize, device: &DeviceInfo) -> u32 {
    let [width, height] = scene.camera.resolution_px;
    let triangles = scene.triangle_count();
    let texels = SHADOW_TEXELS_PER_TRIANGLE * triangles as f64 / fewest_faces.max(1) as f64;
    (width.max(height) / 2)
        .max(texels.sqrt() as u32)
        .clamp(*SHADOW_SIZE.start(), *SHADOW_SIZE.end())
        .next_multiple_of(64)
        .min(device.limits.max_image_px)
}
