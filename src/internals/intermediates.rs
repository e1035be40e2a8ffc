//! Data that the passes of a frame hand to each other, read back and converted to f64, for tests against the model and for inspection.
//! Positions are exactly those that the kernels used.

use glam::{DVec2, DVec3};

use crate::{
    Device, LocalSpace, Result, ShadowPlan,
    emission::{EmissionDomain, Projection},
    frame::Lights,
    model::{Brdf, Lobe},
    passes::{Context, gbuffer::GBuffer},
    vulkan::{Image, Readback},
};

/// Data kept from a frame.
#[derive(Debug, Clone, Default)]
pub struct Intermediates {
    pub space: LocalSpace,
    /// The G-buffer, row by row from the top; `None`: background.
    pub gbuffer: Vec<Option<SurfacePoint>>,
    /// In the order of the scene's lights.
    pub lights: Vec<LightIntermediates>,
}

/// A point of a surface in the G-buffer or an RSM.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// World position.
    pub position_m: DVec3,
    /// Unit shading normal, on the visible side.
    pub normal: DVec3,
    /// Unit normal of the triangle, on the visible side, within 1.1e-3 rad.
    pub geometric_normal: DVec3,
    pub brdf: Brdf,
}

/// Data kept from one light.
#[derive(Debug, Clone)]
pub struct LightIntermediates {
    /// Faces and texels of the emission domain.
    pub domain: EmissionDomain,
    /// The RSM, in the order of the domain's texels; empty without indirect light.
    pub rsm: Vec<Option<RsmTexel>>,
    /// Number of VPLs extracted on matte and on glossy surfaces.
    pub vpl_counts: [u32; 2],
    /// Edge length of a face of the map that the shadow test reads, texels; 0 if the test casts rays.
    pub shadow_size: u32,
    /// World positions that the shadow test reads, face by face, row by row from the top; empty if the test casts rays.
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

impl LightIntermediates {
    pub(super) fn read(context: &Context, lights: &Lights, index: usize) -> Result<Self> {
        let Context { device, space, .. } = *context;
        let (light, rsm_images, shadow_map) = lights.light(index)?;
        let mut rsm = Vec::new();
        if let Some(images) = rsm_images {
            let images = read_images(device, &images.colors())?;
            let unit = match light.domain.projection {
                Projection::Orthographic => 1.0,
                Projection::Perspective => space.metres_per_unit.powi(2),
            };
            rsm.extend((0..light.texel_count as usize).map(|i| {
                (images[0][i][3] >= 0.0).then(|| RsmTexel {
                    point: surface_point(space, &images, i),
                    irradiance_per_intensity: f64::from(images[2][i][3]) / unit,
                })
            }));
        }
        let shadow_map = match light.plan.shadow {
            ShadowPlan::Rsm { .. } => rsm_images.map(|rsm| &rsm.position),
            ShadowPlan::Map { .. } => shadow_map.map(|map| &map.position),
            ShadowPlan::Rays => None,
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

/// [`Intermediates::gbuffer`]
pub(super) fn read_gbuffer(
    device: &Device,
    gbuffer: &GBuffer,
    space: &LocalSpace,
) -> Result<Vec<Option<SurfacePoint>>> {
    let images = read_images(device, &gbuffer.colors())?;
    let seen = |i: usize| (images[0][i][3] != 0.0).then(|| surface_point(space, &images, i));
    Ok((0..images[0].len()).map(seen).collect())
}

/// The pixels of several images.
fn read_images(device: &Device, images: &[&Image]) -> Result<Vec<Vec<[f32; 4]>>> {
    let mut readback = Readback::new(device);
    readback.copy(images)?;
    let texels = images
        .iter()
        .map(|image| Ok(readback.copied(image)?.to_vec()));
    texels.collect()
}

/// A pixel of a G-buffer's or an RSM's images.
fn surface_point(space: &LocalSpace, images: &[Vec<[f32; 4]>], i: usize) -> SurfacePoint {
    let [x, y, z, _] = images[0][i];
    let [nx, ny, nz, packed_normal] = images[1][i];
    let [r, g, b, _] = images[2][i];
    let lobe = images.get(3).map(|lobes| Lobe::of_texel(lobes[i]));
    SurfacePoint {
        position_m: space.to_world([x, y, z]),
        normal: DVec3::from([nx, ny, nz].map(f64::from)).normalize_or_zero(),
        geometric_normal: unpack_direction(packed_normal),
        brdf: Brdf {
            kd: [r, g, b].map(f64::from),
            lobe: lobe.unwrap_or_default(),
        },
    }
}

/// Decodes a unit vector packed by `pack_direction` of `shaders/shared/hit.wgsl`.
fn unpack_direction(packed: f32) -> DVec3 {
    let packed = f64::from(packed);
    let row = (packed / 4096.0).floor();
    let flat = DVec2::new(packed - row * 4096.0, row) / 4094.0 * 2.0 - 1.0;
    let z = 1.0 - flat.x.abs() - flat.y.abs();
    let fold = (-z).max(0.0);
    let unfold = |v: f64| if v >= 0.0 { v - fold } else { v + fold };
    DVec3::new(unfold(flat.x), unfold(flat.y), z).normalize()
}
