//! What the passes of a frame hand to each other, read back and turned into f64: for tests against the model, and for a
//! look inside. Positions are exactly those that the kernels computed with.

use glam::{DVec2, DVec3};

use crate::{
    Device, LocalSpace, Result, ShadowPlan,
    emission::{EmissionDomain, Projection},
    frame::Lights,
    model::Brdf,
    passes::{Context, gbuffer::GBuffer},
    scene::Bands,
    vulkan::{Image, Readback},
};

/// What was kept of a frame.
#[derive(Debug, Clone, Default)]
pub struct Intermediates {
    pub space: LocalSpace,
    /// The G-buffer, row by row from the top; `None`: background.
    pub gbuffer: Vec<Option<SurfacePoint>>,
    /// In the order of the scene's lights.
    pub lights: Vec<LightIntermediates>,
}

/// A point of a surface as the G-buffer or an RSM holds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// World position.
    pub position_m: DVec3,
    /// Unit shading normal, on the side that is seen.
    pub normal: DVec3,
    /// Unit normal of the triangle, on the side that is seen, within 1.1e-3 rad.
    pub geometric_normal: DVec3,
    pub kd: Bands,
    pub ks: Bands,
    pub shininess: f64,
}

impl SurfacePoint {
    /// f_P of a point of the G-buffer, or f_Q of one of an RSM.
    pub fn brdf(&self) -> Brdf {
        Brdf {
            kd: self.kd,
            ks: self.ks,
            shininess: self.shininess,
        }
    }
}

/// What was kept of one light.
#[derive(Debug, Clone)]
pub struct LightIntermediates {
    /// Faces and texels of the emission domain.
    pub domain: EmissionDomain,
    /// The RSM, in the order of the domain's texels; empty without indirect light.
    pub rsm: Vec<Option<RsmTexel>>,
    /// VPLs that were extracted: on matte and on glossy surfaces.
    pub vpl_counts: [u32; 2],
    /// Edge of a face of the map that the shadow test reads, texels; 0 where it casts rays.
    pub shadow_size: u32,
    /// World positions that the shadow test reads, face by face, row by row from the top; empty where it casts rays.
    pub shadow_map: Vec<Option<DVec3>>,
}

/// A texel of an RSM.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RsmTexel {
    /// Q, n_Q and f_Q
    pub point: SurfacePoint,
    /// L_{L→Q} over the light's axial intensity: 1/m² (directional: 1).
    pub irradiance_per_intensity: f64,
}

impl Intermediates {
    pub(super) fn read_gbuffer(
        &mut self,
        device: &Device,
        gbuffer: &GBuffer,
        space: &LocalSpace,
    ) -> Result<()> {
        let images = read_images(device, &gbuffer.colors())?;
        self.space = *space;
        self.gbuffer = (0..images[0].len())
            .map(|i| {
                let (position, normal) = (images[0][i], images[1][i]);
                let ks = images.get(3).map_or([0.0, 0.0, 0.0, 1.0], |ks| ks[i]);
                (position[3] != 0.0)
                    .then(|| surface_point(space, position, normal, normal[3], images[2][i], ks))
            })
            .collect();
        Ok(())
    }
}

impl LightIntermediates {
    pub(super) fn read(context: &Context, lights: &Lights, index: usize) -> Result<Self> {
        let Context { device, space, .. } = *context;
        let (light, rsm_images, shadow_map) = lights.light(index)?;
        let mut rsm = Vec::new();
        if let Some(images) = rsm_images {
            let read = read_images(device, &images.colors())?;
            let is_parallel = light.domain.projection == Projection::Orthographic;
            let unit = if is_parallel {
                1.0
            } else {
                space.metres_per_unit.powi(2)
            };
            rsm = (0..light.texel_count as usize)
                .map(|i| {
                    let position = read[0][i];
                    (position[3] >= 0.0).then(|| RsmTexel {
                        point: surface_point(
                            space,
                            position,
                            read[1][i],
                            read[1][i][3],
                            read[2][i],
                            read.get(3).map_or([0.0, 0.0, 0.0, 1.0], |ks| ks[i]),
                        ),
                        irradiance_per_intensity: f64::from(read[2][i][3]) / unit,
                    })
                })
                .collect();
        }
        let shadow_map = match light.plan.shadow {
            ShadowPlan::Rsm { .. } => rsm_images.map(|rsm| &rsm.position),
            ShadowPlan::Map { .. } => shadow_map.map(|map| &map.position),
            ShadowPlan::Rays(_) => None,
        };
        let shadow_size = light.plan.shadow.map_size().unwrap_or_default();
        let shadow_map = read_images(device, shadow_map.as_slice())?
            .concat()
            .into_iter()
            // Other lights may have more faces.
            .take(light.domain.faces.len() * (shadow_size as usize).pow(2))
            .map(|[x, y, z, triangle]| (triangle >= 0.0).then(|| space.to_world([x, y, z])))
            .collect();
        Ok(LightIntermediates {
            domain: light.domain.clone(),
            rsm,
            vpl_counts: lights
                .vpls_of(index)
                .map_or([0; 2], |vpls| [vpls.lengths.matte, vpls.lengths.glossy]),
            shadow_size,
            shadow_map,
        })
    }
}

/// The pixels of images of one shape.
fn read_images(device: &Device, images: &[&Image]) -> Result<Vec<Vec<[f32; 4]>>> {
    let Some(first) = images.first() else {
        return Ok(Vec::new());
    };
    let mut readback = Readback::new(device, first.shape)?;
    images
        .iter()
        .map(|image| Ok(readback.pixels(image)?.to_vec()))
        .collect()
}

fn surface_point(
    space: &LocalSpace,
    [x, y, z, _]: [f32; 4],
    [nx, ny, nz, _]: [f32; 4],
    packed_normal: f32,
    [r, g, b, _]: [f32; 4],
    [kr, kg, kb, shininess]: [f32; 4],
) -> SurfacePoint {
    SurfacePoint {
        position_m: space.to_world([x, y, z]),
        normal: DVec3::from([nx, ny, nz].map(f64::from)).normalize_or_zero(),
        geometric_normal: unpack_direction(packed_normal),
        kd: [r, g, b].map(f64::from),
        ks: [kr, kg, kb].map(f64::from),
        shininess: shininess.into(),
    }
}

/// The unit vector that `pack_direction` of `shaders/hit.wgsl` packed.
fn unpack_direction(packed: f32) -> DVec3 {
    let packed = f64::from(packed);
    let row = (packed / 4096.0).floor();
    let flat = DVec2::new(packed - row * 4096.0, row) / 4094.0 * 2.0 - 1.0;
    let z = 1.0 - flat.x.abs() - flat.y.abs();
    let fold = (-z).max(0.0);
    let unfold = |v: f64| if v >= 0.0 { v - fold } else { v + fold };
    DVec3::new(unfold(flat.x), unfold(flat.y), z).normalize()
}
