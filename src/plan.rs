//! What a scene needs: derived from it before any work starts, printed on request, and the only thing that picks passes
//! and kernel permutations.

use std::fmt;

use crate::{
    Error, Result, bvh,
    emission::EmissionDomain,
    scene::{BoundingSphere, Estimator, Indirect, Light, Scene, Shadow, Texture},
    vulkan::{DeviceInfo, DeviceKind},
};

/// Bytes of a pixel of every image.
const PIXEL_BYTES: u64 = 16;
/// Bounds of the edge of the shadow map that lights share whose RSM is too coarse, texels.
const SHADOW_SIZE: std::ops::RangeInclusive<u32> = 256..=2048;
/// Texels of such a map per triangle of the scene: fewer, and many triangles are not in the map.
const SHADOW_TEXELS_PER_TRIANGLE: f64 = 8.0;
/// Triangles that a pixel can tell apart: whole numbers that are exact in f32.
const MAX_TRIANGLES: u64 = 1 << 24;

/// The passes and permutations that a frame takes on a device.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    pub resolution_px: [u32; 2],
    /// Some material has a specular lobe.
    pub is_specular: bool,
    /// Some mesh has shading normals.
    pub is_smooth: bool,
    /// Some visible material has a texture.
    pub is_textured: bool,
    pub lights: Vec<LightPlan>,
    pub indirect: Option<IndirectPlan>,
    /// Joules per W/m² on the pixel, with a sensor.
    pub joule_per_irradiance: Option<f64>,
}

/// What one light takes.
#[derive(Debug, Clone, PartialEq)]
pub struct LightPlan {
    pub kind: &'static str,
    /// Faces that the light emits into.
    pub faces: u32,
    pub shadow: ShadowPlan,
}

/// How the shadow test of a light finds what is in its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShadowPlan {
    /// In the light's RSM, which is fine enough.
    Rsm { size: u32 },
    /// In a map of the light's own. The size is the edge of a face, texels.
    Map { size: u32 },
    /// By rays among all triangles.
    Rays(RayKernel),
}

impl ShadowPlan {
    /// Edge of a face of the map that the shadow test reads, texels; `None`: it reads none.
    pub fn map_size(self) -> Option<u32> {
        match self {
            ShadowPlan::Rsm { size } | ShadowPlan::Map { size } => Some(size),
            ShadowPlan::Rays(_) => None,
        }
    }

    /// Edge of a face of the light's own map, texels; `None`: it has none.
    pub(crate) fn own_map_size(self) -> Option<u32> {
        match self {
            ShadowPlan::Map { size } => Some(size),
            ShadowPlan::Rsm { .. } | ShadowPlan::Rays(_) => None,
        }
    }
}

/// How rays go through the tree of boxes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayKernel {
    /// The rays of a subgroup go together, for which it takes eight lanes; these load a node's words and broadcast them.
    Packet,
    /// Every ray goes by itself.
    Single,
}

impl RayKernel {
    pub const ALL: [RayKernel; 2] = [RayKernel::Packet, RayKernel::Single];

    /// The word of the shader permutation.
    pub fn name(self) -> &'static str {
        match self {
            RayKernel::Packet => "packet",
            RayKernel::Single => "single",
        }
    }

    /// Whether the kernel gives right results on the device: eight lanes hold a node.
    pub fn runs_on(self, device: &DeviceInfo) -> bool {
        match self {
            RayKernel::Packet => device.limits.subgroup_lanes >= 8,
            RayKernel::Single => true,
        }
    }

    /// This kernel, if it runs on the device.
    pub(crate) fn checked_for(self, device: &DeviceInfo) -> Result<Self> {
        if self.runs_on(device) {
            return Ok(self);
        }
        Err(does_not_fit("ray", self.name(), device))
    }

    /// The faster one of those that run on the device.
    pub fn best_for(device: &DeviceInfo) -> Self {
        if RayKernel::Packet.runs_on(device) {
            RayKernel::Packet
        } else {
            RayKernel::Single
        }
    }
}

/// What the indirect light takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IndirectPlan {
    pub estimator: Estimator,
    pub rsm_size: u32,
    /// relRMSE of the indirect light that is asked for; `None` for a plain sum, without visibility.
    pub target_error: Option<f64>,
    pub kernel: GatherKernel,
}

/// How the gather hands VPLs to its lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GatherKernel {
    /// Each of 8 lanes loads a VPL and broadcasts it: CPU drivers of 256 bits.
    Broadcast8,
    /// The same with 4 lanes: CPU drivers of 128 bits.
    Broadcast4,
    /// Tiles in workgroup memory: GPUs.
    Tile,
}

impl GatherKernel {
    pub const ALL: [GatherKernel; 3] = [
        GatherKernel::Broadcast8,
        GatherKernel::Broadcast4,
        GatherKernel::Tile,
    ];

    /// The word of the shader permutation.
    pub fn name(self) -> &'static str {
        match self {
            GatherKernel::Broadcast8 => "broadcast8",
            GatherKernel::Broadcast4 => "broadcast4",
            GatherKernel::Tile => "tile",
        }
    }

    /// Whether the kernel gives right results on the device: a broadcast counts on the number of lanes.
    pub fn runs_on(self, device: &DeviceInfo) -> bool {
        match self {
            GatherKernel::Broadcast8 => device.limits.subgroup_lanes == 8,
            GatherKernel::Broadcast4 => device.limits.subgroup_lanes == 4,
            GatherKernel::Tile => true,
        }
    }

    /// This kernel, if it runs on the device.
    pub(crate) fn checked_for(self, device: &DeviceInfo) -> Result<Self> {
        if self.runs_on(device) {
            return Ok(self);
        }
        Err(does_not_fit("gather", self.name(), device))
    }

    /// The fastest kernel for the device: lavapipe does one scalar load per lane from workgroup memory, GPUs do one for all.
    pub fn best_for(device: &DeviceInfo) -> Self {
        let is_cpu = device.kind == DeviceKind::Cpu;
        Self::ALL
            .into_iter()
            .find(|kernel| kernel.runs_on(device) && (is_cpu || *kernel == GatherKernel::Tile))
            .unwrap_or(GatherKernel::Tile)
    }
}

fn does_not_fit(what: &str, kernel: &str, device: &DeviceInfo) -> Error {
    let lanes = device.limits.subgroup_lanes;
    Error::NoDevice {
        problem: format!(
            "the {what} kernel {kernel} does not fit the {lanes} lanes of a subgroup of {}",
            device.name
        ),
        mend: "leave the choice to the renderer, or choose another device".into(),
    }
}

impl Plan {
    /// Plans a frame of a valid scene.
    ///
    /// # Errors
    /// [`Error::Scene`] for an invalid scene, [`Error::DeviceLimit`] where the device cannot hold what the scene asks for.
    pub fn new(scene: &Scene, device: &DeviceInfo) -> Result<Plan> {
        scene.validate()?;
        let used = || {
            let materials = scene.meshes.iter().flat_map(|m| &m.triangle_materials);
            materials.filter_map(|&index| scene.materials.get(index as usize))
        };
        let is_textured = scene.meshes.iter().any(|mesh| {
            !mesh.texcoords.is_empty()
                && mesh.triangle_materials.iter().any(|&index| {
                    let material = scene.materials.get(index as usize);
                    material.is_some_and(|m| m.kd_texture.is_some())
                })
        });
        let bounds = scene_sphere(scene);
        // The faces do not depend on the texels.
        let faces = |light: &Light| EmissionDomain::new(light, 1, &bounds).faces.len();
        let faces: Vec<usize> = scene.lights.iter().map(faces).collect();
        let fine_enough = shadow_size(scene, faces.iter().copied().min().unwrap_or(1), device);
        // The RSM's positions serve the shadow test where they lie as dense as a plain map's would: 64² texels would
        // miss what is smaller than twenty pixels.
        let rsm_size = scene.indirect.map(planned_rsm_size);
        let shadow = match (scene.direct.shadow, rsm_size) {
            (Shadow::Rays, _) => ShadowPlan::Rays(RayKernel::best_for(device)),
            (Shadow::Map, Some(size)) if size >= fine_enough => ShadowPlan::Rsm { size },
            (Shadow::Map, _) => ShadowPlan::Map { size: fine_enough },
        };
        let lights = scene.lights.iter().zip(faces);
        let lights = lights
            .map(|(light, faces)| LightPlan {
                kind: light.kind(),
                faces: faces as u32,
                shadow,
            })
            .collect();
        let plan = Plan {
            resolution_px: scene.camera.resolution_px,
            is_specular: used().any(|material| material.is_specular()),
            is_smooth: scene.meshes.iter().any(|mesh| !mesh.normals.is_empty()),
            is_textured,
            lights,
            indirect: scene.indirect.map(|indirect| IndirectPlan {
                estimator: indirect.estimator,
                rsm_size: planned_rsm_size(indirect),
                target_error: indirect.asked_error(),
                kernel: GatherKernel::best_for(device),
            }),
            joule_per_irradiance: scene.sensor.map(|sensor| sensor.joule_per_irradiance()),
        };
        plan.check_limits(scene, device)?;
        Ok(plan)
    }

    /// The word of the shader permutations that tells whether there is a specular term.
    pub(crate) fn brdf_word(&self) -> &'static str {
        if self.is_specular { "phong" } else { "lambert" }
    }

    /// Faces of the light that emits into the most.
    pub(crate) fn max_faces(&self) -> u32 {
        let faces = self.lights.iter().map(|light| light.faces);
        faces.max().unwrap_or(1)
    }

    /// Edge of a face of the shadow map that lights without a fine RSM use in turn, texels; `None`: no light needs one.
    pub(crate) fn own_map_size(&self) -> Option<u32> {
        let sizes = self.lights.iter().map(|light| light.shadow.own_map_size());
        sizes.max().flatten()
    }

    /// Whether the frame casts rays among the triangles.
    pub(crate) fn has_rays(&self) -> bool {
        let is_by_rays = |light: &LightPlan| matches!(light.shadow, ShadowPlan::Rays(_));
        self.lights.iter().any(is_by_rays)
    }

    fn check_limits(&self, scene: &Scene, device: &DeviceInfo) -> Result<()> {
        let limits = &device.limits;
        let check = |what: &str, asked: u64, limit: u64, mend: &str| {
            if asked <= limit {
                return Ok(());
            }
            Err(Error::DeviceLimit {
                what: what.into(),
                asked,
                limit,
                device: device.name.clone(),
                mend: mend.into(),
            })
        };
        let smaller_image = "render a smaller image, or choose another device";
        let smaller_rsm = "set a smaller rsm_size, or choose another device";
        let [width, height] = self.resolution_px;
        let pixels = u64::from(width) * u64::from(height);
        let max_image_px = limits.max_image_px.into();
        check(
            "the image's width (px)",
            width.into(),
            max_image_px,
            smaller_image,
        )?;
        check(
            "the image's height (px)",
            height.into(),
            max_image_px,
            smaller_image,
        )?;
        check(
            "an image of the G-buffer (bytes)",
            pixels * PIXEL_BYTES,
            limits.max_allocation_bytes,
            smaller_image,
        )?;
        if let Some(IndirectPlan { rsm_size, .. }) = self.indirect {
            check(
                "the list of pixels (bytes)",
                pixels * 4,
                limits.max_storage_buffer_bytes,
                smaller_image,
            )?;
            check(
                "rsm_size (texels)",
                rsm_size.into(),
                max_image_px,
                smaller_rsm,
            )?;
            let texels = u64::from(self.max_faces()) * u64::from(rsm_size) * u64::from(rsm_size);
            check(
                "an image of the RSM (bytes)",
                texels * PIXEL_BYTES,
                limits.max_allocation_bytes,
                smaller_rsm,
            )?;
            // A row of the VPL lists holds 1024.
            check(
                "the list of VPLs (rows)",
                texels.div_ceil(1024),
                max_image_px,
                smaller_rsm,
            )?;
            // Members of a record are layers of an image.
            let members = if self.is_specular { 5 } else { 3 };
            check(
                "the list of VPLs (bytes)",
                texels * members * PIXEL_BYTES,
                limits.max_allocation_bytes,
                smaller_rsm,
            )?;
            check(
                "the table of the RSM's texels (bytes)",
                texels * 8,
                limits.max_storage_buffer_bytes,
                smaller_rsm,
            )?;
        }
        let textures: &[Texture] = if self.is_textured {
            &scene.textures
        } else {
            &[]
        };
        for texture in textures {
            let [width, height] = texture.size_px;
            check(
                &format!("the longer edge of texture \"{}\" (px)", texture.name),
                width.max(height).into(),
                max_image_px,
                "scale the texture down, or choose another device",
            )?;
            check(
                &format!("texture \"{}\" (bytes)", texture.name),
                u64::from(width) * u64::from(height) * PIXEL_BYTES,
                limits.max_allocation_bytes,
                "scale the texture down, or choose another device",
            )?;
        }
        if let Some(size) = self.own_map_size() {
            check(
                "the shadow map (bytes)",
                u64::from(self.max_faces()) * u64::from(size) * u64::from(size) * PIXEL_BYTES,
                limits.max_allocation_bytes,
                smaller_image,
            )?;
        }
        let vertices: u64 = scene
            .meshes
            .iter()
            .map(|m| m.positions_m.len() as u64)
            .sum();
        let triangles: u64 = scene.meshes.iter().map(|m| m.triangles.len() as u64).sum();
        let fewer = "simplify the meshes, or choose another device";
        let storage = limits.max_storage_buffer_bytes;
        check(
            "the list of vertices (bytes)",
            vertices * 16,
            storage,
            fewer,
        )?;
        check(
            "the list of triangles (bytes)",
            triangles * 12,
            storage,
            fewer,
        )?;
        if self.has_rays() {
            check(
                "the tree of boxes (bytes)",
                bvh::max_bytes(triangles),
                storage,
                "set shadow = \"map\" in [direct], simplify the meshes, or choose another device",
            )?;
        }
        check("the number of triangles", triangles, MAX_TRIANGLES, fewer)
    }
}

/// The sphere around the scene. Where there is nothing, or only a point, it has 1 m, for a light must emit into something.
pub(crate) fn scene_sphere(scene: &Scene) -> BoundingSphere {
    let sphere = scene.bounding_sphere();
    let centre_m = sphere.map_or(glam::DVec3::ZERO, |sphere| sphere.centre_m);
    let radius_m = sphere.map_or(0.0, |sphere| sphere.radius_m);
    BoundingSphere {
        centre_m,
        radius_m: if radius_m > 0.0 { radius_m } else { 1.0 },
    }
}

/// Texels along one edge of a face; 64 where the scene leaves the choice to the engine.
fn planned_rsm_size(indirect: Indirect) -> u32 {
    indirect.rsm_size.unwrap_or(64)
}

/// Edge of a face of a shadow map that is fine enough for every light, so that the lights can use one in turn.
///
/// Shadow edges are those of triangles, not of texels: half the pixels' density is enough to find the triangles, if they
/// are not much smaller than the texels.
fn shadow_size(scene: &Scene, fewest_faces: usize, device: &DeviceInfo) -> u32 {
    let [width, height] = scene.camera.resolution_px;
    let triangles: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    let texels = SHADOW_TEXELS_PER_TRIANGLE * triangles as f64 / fewest_faces.max(1) as f64;
    (width.max(height) / 2)
        .max(texels.sqrt() as u32)
        .clamp(*SHADOW_SIZE.start(), *SHADOW_SIZE.end())
        .next_multiple_of(64)
        .min(device.limits.max_image_px)
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [width, height] = self.resolution_px;
        let brdf = if self.is_specular { "Phong" } else { "Lambert" };
        writeln!(f, "passes")?;
        writeln!(f, "  gbuffer    {width} x {height} px, {brdf}")?;
        for (index, light) in self.lights.iter().enumerate() {
            let LightPlan {
                kind,
                faces,
                shadow,
            } = light;
            if let Some(indirect) = self.indirect {
                let size = indirect.rsm_size;
                writeln!(
                    f,
                    "  rsm        light {index} ({kind}): {faces} x {size}² texels"
                )?;
            }
            match shadow {
                ShadowPlan::Rsm { .. } => writeln!(f, "             read by the shadow test too")?,
                ShadowPlan::Map { size } => writeln!(
                    f,
                    "  shadow     light {index} ({kind}): {faces} x {size}² texels"
                )?,
                ShadowPlan::Rays(_) => {}
            }
            write!(f, "  direct     light {index}, {brdf}")?;
            match shadow {
                ShadowPlan::Rays(kernel) => writeln!(f, ", shadow rays, kernel {}", kernel.name())?,
                ShadowPlan::Rsm { .. } | ShadowPlan::Map { .. } => writeln!(f)?,
            }
        }
        if let Some(indirect) = self.indirect {
            let name = indirect.estimator.name();
            writeln!(f, "  vpl        texels with flux, compacted")?;
            writeln!(f, "  receivers  pixels with a surface, compacted")?;
            let kernel = indirect.kernel.name();
            match indirect.target_error {
                None => writeln!(f, "  gather     {name}, no visibility, kernel {kernel}")?,
                Some(asked) => writeln!(
                    f,
                    "  gather     {name}, visibility by rays, target error {asked}, kernel {kernel}"
                )?,
            }
        }
        if self.joule_per_irradiance.is_some() {
            writeln!(f, "  sensor")?;
        }
        writeln!(f, "left out")?;
        let absent = [
            (!self.is_specular, "specular terms: no material has k_s"),
            (!self.is_smooth, "shading normals: no mesh has any"),
            (
                !self.is_textured,
                "textures: no material on a mesh with texcoords has one",
            ),
            (
                self.own_map_size().is_none() && self.has_rays(),
                "shadow maps: [direct] asks for rays",
            ),
            (!self.has_rays(), "tree of boxes: nothing casts rays"),
            (
                self.indirect.is_none(),
                "RSM, VPLs and gather: the scene has no [indirect]",
            ),
            (
                self.joule_per_irradiance.is_none(),
                "sensor: the scene has no [sensor]",
            ),
            (
                self.indirect.is_some_and(|i| i.target_error.is_none()),
                "visibility between VPLs and pixels: see docs/model.md",
            ),
        ];
        for (_, what) in absent.iter().filter(|(is_absent, _)| *is_absent) {
            writeln!(f, "  {what}")?;
        }
        Ok(())
    }
}
