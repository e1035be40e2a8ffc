//! A light on the device: its parameters, its views, and its emission table.

use super::{Context, modulation, surface::upload_view, view};
use crate::{
    Error, Result,
    emission::EmissionDomain,
    local_space::LocalSpace,
    plan::{LightPlan, Plan},
    scene::{AreaShape, EmissionPoint, Intrinsics, Lamp, Light, Profile},
    vulkan::{
        Allocate, Buffer, BufferUse, Resource,
        shaders::{self, Emission, LightFace},
    },
};

/// What the passes of one light share.
pub(crate) struct DeviceLight {
    pub plan: LightPlan,
    /// The kernels' choice for what the light emits.
    pub kernels: Emission,
    pub domain: EmissionDomain,
    pub parameters: shaders::Light,
    pub uniform: Buffer,
    pub shadow_views: Vec<Buffer>,
    pub rsm_views: Vec<Buffer>,
    /// ΔΩ and s of each texel of the RSM.
    pub emission: Buffer,
    /// The numbers of a pattern, in the layout of `shaders/shared/pattern.wgsl`; empty for other lights.
    pub pattern: Vec<f32>,
    pattern_buffer: Option<Buffer>,
    /// Points of emissive surfaces; empty for other lights.
    points: Vec<EmissionPoint>,
    /// Texels of the RSM; 0 without one.
    pub texel_count: u32,
}

/// Declares the memory for the emission tables and patterns of all lights.
pub(crate) fn declare(allocate: &impl Allocate, plan: &Plan) -> Result<()> {
    let rsm_size = plan.rsm_size().unwrap_or_default();
    for light in &plan.lights {
        let texels = u64::from(light.faces) * u64::from(rsm_size).pow(2);
        let bytes = texels * size_of::<[f32; 2]>() as u64;
        allocate.buffer("table of the RSM's texels", bytes, BufferUse::Upload)?;
        let pattern_bytes = u64::from(light.pattern_numbers) * size_of::<f32>() as u64;
        allocate.buffer("pattern of a light", pattern_bytes, BufferUse::Upload)?;
    }
    Ok(())
}

impl DeviceLight {
    /// Uploads the light with this index. All lights share lists of VPLs and RSM tiles; `first_vpl` and `first_tile` are where this
    /// light's part begins.
    pub fn new(context: &Context, index: usize, [first_vpl, first_tile]: [u32; 2]) -> Result<Self> {
        let Context {
            device,
            scene,
            space,
            ..
        } = *context;
        let (light, plan) = (&scene.lights[index].light, &context.plan.lights[index]);
        // Without indirect light only the faces count. They do not depend on the texels.
        let emission_size = context
            .plan
            .indirect
            .map_or(1, |indirect| indirect.emission_size);
        let rsm_size = context.plan.rsm_size();
        let domain = EmissionDomain::new(light, emission_size, &scene.bounding_sphere_or_unit());
        let views = |size: u32| -> Result<Vec<Buffer>> {
            (0..domain.faces.len())
                .map(|face| upload_view(device, &view::of_light_face(&domain, face, size, space)))
                .collect()
        };
        let is_parallel = matches!(light, Light::Directional { .. });
        // A parallel light's texels are areas, in local units like every length on the device.
        let measure_unit = if is_parallel {
            space.metres_per_unit.powi(2)
        } else {
            1.0
        };
        let emission: Vec<[f32; 2]> = match rsm_size {
            None => Vec::new(),
            Some(_) => domain
                .texels
                .iter()
                .map(|texel| [(texel.measure / measure_unit) as f32, texel.falloff as f32])
                .collect(),
        };
        let (kernels, parameters) = parameters(light, &domain, space);
        let parameters = shaders::Light {
            shadow_size: plan.shadow.map_size().unwrap_or_default(),
            emission_size,
            emission_measure: (domain.total_measure() / measure_unit) as f32,
            is_parallel: is_parallel.into(),
            first_vpl,
            first_tile,
            emission_points: plan.emission_points,
            is_modulated: plan.is_modulated.into(),
            origin_turns: modulation::origin_turns(scene, space, index).unwrap_or_default(),
            ..parameters
        };
        let pattern = light
            .lamp()
            .map_or_else(Vec::new, |lamp| pattern_numbers(&lamp.profile));
        let surfaces = light.surfaces();
        let points = surfaces.map_or_else(Vec::new, |surfaces| {
            surfaces.points(plan.emission_points, context.seed)
        });
        Ok(DeviceLight {
            plan: plan.clone(),
            kernels,
            uniform: Buffer::upload(device, "light", &[parameters])?,
            parameters,
            shadow_views: match plan.shadow.own_map_size() {
                None => Vec::new(),
                Some(size) => views(size)?,
            },
            rsm_views: match rsm_size {
                None => Vec::new(),
                Some(size) => views(size)?,
            },
            texel_count: emission.len() as u32,
            emission: Buffer::upload(device, "emission", &emission)?,
            pattern_buffer: (!pattern.is_empty())
                .then(|| Buffer::upload(device, "pattern", &pattern))
                .transpose()?,
            pattern,
            points,
            domain,
        })
    }
}

impl DeviceLight {
    /// Texels of the points of emissive surfaces, as `shaders/shared/lights.wgsl` reads them: position, density; normal; radiance.
    pub fn point_texels(&self, space: &LocalSpace) -> Vec<[f32; 4]> {
        let texels = self.points.iter().flat_map(|point| {
            let with_fourth = |[x, y, z]: [f32; 3], fourth: f64| [x, y, z, fourth as f32];
            let density = point.density_per_m2 * space.metres_per_unit.powi(2);
            [
                with_fourth(space.to_local(point.position_m), density),
                with_fourth(point.normal.as_vec3().to_array(), 0.0),
                with_fourth(point.radiance.map(|radiance| radiance as f32), 0.0),
            ]
        });
        texels.collect()
    }

    /// The density of points of emissive surfaces per area, 1/local unit², over the radiance there, all bands together; 0 for other lights.
    pub fn emission_density(&self, space: &LocalSpace) -> f64 {
        let of_point = |point: &EmissionPoint| {
            let radiance: f64 = point.radiance.iter().sum();
            (radiance > 0.0).then(|| point.density_per_m2 / radiance)
        };
        let density = self.points.iter().find_map(of_point).unwrap_or_default();
        density * space.metres_per_unit.powi(2)
    }

    /// The pattern with its name in `shaders/direct.wgsl`.
    pub fn pattern_resource(&self) -> Option<(&'static str, Resource<'_>)> {
        let pattern = self.pattern_buffer.as_ref()?;
        Some(("pattern", Resource::Buffer(pattern)))
    }
}

/// Uploads one point of the light's area as a light, for `shaders/direct.wgsl`. `place` is in the unit square.
pub(crate) fn upload_area_point(
    context: &Context,
    index: usize,
    light: &DeviceLight,
    place: [f64; 2],
) -> Result<Buffer> {
    let Context { scene, space, .. } = *context;
    let lamp = scene.lights[index].lamp();
    let lamp = lamp.ok_or_else(|| Error::internal("a light has no area to have a point of"))?;
    let position_m = lamp.point_m(place);
    let parameters = shaders::Light {
        position: space.to_local(position_m),
        origin_turns: modulation::turns_to_origin(scene, space, position_m),
        ..light.parameters
    };
    Buffer::upload(context.device, "point of a light", &[parameters])
}

fn pattern_numbers(profile: &Profile) -> Vec<f32> {
    match profile {
        Profile::Measured(pattern) => {
            let nodes = pattern.gammas_rad.iter().chain(&pattern.planes_rad);
            let values = nodes.chain(&pattern.intensities);
            values.map(|&value| value as f32).collect()
        }
        Profile::Projected(image) => {
            let Intrinsics { fx, fy, cx, cy, .. } = image.intrinsics;
            let lens = [fx, fy, cx, cy].map(|number| number as f32);
            [&lens, &image.values[..]].concat()
        }
        _ => Vec::new(),
    }
}

/// The kernels for a light and its parameters in the shaders, except those of its maps.
fn parameters(
    light: &Light,
    domain: &EmissionDomain,
    space: &LocalSpace,
) -> (Emission, shaders::Light) {
    // Faces that the light does not have repeat its first face.
    let faces = std::array::from_fn(|index| {
        let face = domain.faces.get(index).or(domain.faces.first());
        face.map_or_else(LightFace::default, |face| LightFace {
            right: face.right.as_vec3().to_array(),
            up: face.up.as_vec3().to_array(),
            forward: face.forward.as_vec3().to_array(),
            ..LightFace::default()
        })
    });
    let half_extent = domain.faces.first().map_or(1.0, |face| face.half_extent);
    let axis = light.direction().map(|direction| direction.normalize());
    let common = shaders::Light {
        position: space.to_local(domain.origin_m),
        faces,
        face_count: domain.faces.len() as u32,
        axis: axis.unwrap_or_default().as_vec3().to_array(),
        ..shaders::Light::default()
    };
    let Some(lamp) = light.lamp() else {
        let parameters = shaders::Light {
            half_extent: space.length(half_extent) as f32,
            intensity: domain.axial_intensity.map(|irradiance| irradiance as f32),
            ..common
        };
        return (Emission::Directional, parameters);
    };
    // I/d² with d in local units is W/m² if I is divided by the unit squared.
    let per_local_unit = |intensity: f64| (intensity / space.metres_per_unit.powi(2)) as f32;
    let common = shaders::Light {
        half_extent: half_extent as f32,
        intensity: domain.axial_intensity.map(per_local_unit),
        ..common
    };
    let (kernels, point) = of_profile(lamp, common);
    (kernels, of_area(lamp, space, point))
}

/// Adds what a point of the lamp emits.
fn of_profile(lamp: &Lamp, common: shaders::Light) -> (Emission, shaders::Light) {
    let patterned = |columns: usize, rows: usize| shaders::Light {
        plane_0: lamp.axes().plane_0.as_vec3().to_array(),
        pattern_columns: columns as u32,
        pattern_rows: rows as u32,
        ..common
    };
    match lamp.profile_of_points() {
        Profile::Uniform => (Emission::Point, common),
        Profile::Cone(cone) => {
            let inner = cone.inner_half_angle_deg.to_radians();
            let outer = cone.outer_half_angle_deg.to_radians();
            let spot = shaders::Light {
                outer_half_angle: outer as f32,
                // Kept finite where the angles are equal: 0 · ∞ would not be a falloff.
                inverse_penumbra: (1.0 / (outer - inner)).min(1e30) as f32,
                ..common
            };
            (Emission::Spot, spot)
        }
        Profile::Measured(pattern) => {
            let measured = patterned(pattern.gammas_rad.len(), pattern.planes_rad.len());
            (Emission::Pattern, measured)
        }
        Profile::Projected(image) => {
            let [columns, rows] = image.size_px.map(|size| size as usize);
            let projector = shaders::Light {
                is_projected: 1,
                ..patterned(columns, rows)
            };
            (Emission::Projector, projector)
        }
    }
}

/// Adds the area of the lamp, if it has one.
fn of_area(lamp: &Lamp, space: &LocalSpace, point: shaders::Light) -> shaders::Light {
    let Some(shape) = lamp.area else {
        return point;
    };
    let [right, _] = lamp.area_axes();
    let [half_width_m, half_height_m] = shape.half_extents_m();
    let aspect = half_height_m / half_width_m;
    shaders::Light {
        plane_0: (right * space.length(half_width_m)).as_vec3().to_array(),
        area_aspect: match shape {
            AreaShape::Rectangle { .. } => aspect as f32,
            AreaShape::Disc { .. } => -aspect as f32,
        },
        ..point
    }
}
