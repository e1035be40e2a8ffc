//! Light rays pass: makes the VPLs of final gathering, where rays from the lights hit the scene.

use super::{
    Context,
    gatherer::{LightRaySets, MAX_LIGHT_RAYS, MOST_SETS},
    hits::HitScene,
    light::DeviceLight,
    light_paths,
    ray_table::RayTable,
    trace::{Find, no_list},
    vpl::vpl_layers,
    vpl_sampler::POINTS_PER_RAY,
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{
        Allocate, BufferUse, Device, ImageShape, Resource, TexelList, groups_in_rows,
        shaders::{
            Key, LightPath, LightRayParameters,
            constants::{RAYS_AT_ONCE, VPLS_PER_ROW},
        },
    },
};

/// VPLs, one per ray, with one layer per member.
pub(crate) struct LightRays<A: Allocate = Device> {
    pub vpls: A::Image,
    /// The cell of each ray.
    cells: A::Buffer,
    /// What rays of further bounces carry.
    paths: A::Buffer,
}

impl<A: Allocate> LightRays<A> {
    pub fn new(allocate: &A, plan: &Plan) -> Result<LightRays<A>> {
        let module = shade_key(plan).module();
        let columns = VPLS_PER_ROW;
        let layers = vpl_layers(plan);
        // Every light has at least one packet.
        let rays_from_lights = MAX_LIGHT_RAYS + 1024 * plan.lights.len() as u32;
        let rays = rays_from_lights;
        let has_points = plan.lights.iter().any(|light| light.emission_points > 0);
        let rays = match has_points {
            true => rays + (POINTS_PER_RAY * f64::from(rays)).ceil() as u32 + 1024,
            false => rays,
        } + light_paths::most_vpls(rays, plan.bounces(), MOST_SETS);
        let shape = ImageShape::plain([columns, rays.div_ceil(columns)]);
        let shape = shape.with_layers(module.constant(layers)?);
        let bytes = u64::from(rays_from_lights) * size_of::<u32>() as u64;
        let path_bytes = match plan.bounces() {
            1 => 0,
            _ => u64::from(plan.rays_at_once) * size_of::<LightPath>() as u64,
        };
        Ok(LightRays {
            vpls: allocate.image("VPLs", shape)?,
            cells: allocate.buffer("cells of the lights' rays", bytes, BufferUse::Device)?,
            paths: allocate.buffer("paths of light", path_bytes, BufferUse::Device)?,
        })
    }
}

pub(super) fn shade_key(plan: &Plan) -> Key {
    Key::LightRaysShade {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
        surface: plan.surface(),
        instanced: plan.has_shared_meshes,
    }
}

/// Lists points of emissive surfaces as VPLs.
fn surfaces_key(plan: &Plan) -> Key {
    Key::LightRaysSurfaces {
        phasors: plan.has_phasors(),
        brdf: plan.brdf(),
    }
}

impl LightRays {
    /// Traces rays from the lights as the table says. Returns their number.
    pub fn trace(
        &self,
        context: &Context,
        scene: HitScene,
        lights: &[&DeviceLight],
        light_list: &TexelList,
        table: &RayTable,
        sets: LightRaySets,
    ) -> Result<u64> {
        let plan = context.plan;
        let LightRaySets {
            seed, set_count, ..
        } = sets;
        let rays_of_set = table.ray_count();
        let count = u64::from(rays_of_set) * u64::from(set_count);
        context.cost.borrow_mut().count_work("light_rays", count);
        context.prepare_images(&[&self.vpls])?;
        for (light_index, rays) in (0..lights.len() as u32).zip(&table.lights) {
            let all_rays = rays.ray_count * set_count;
            for first in (0..all_rays).step_by(plan.rays_at_once as usize) {
                let end = all_rays.min(first + plan.rays_at_once);
                let parameters = LightRayParameters {
                    light_index,
                    first_ray: rays.first_ray,
                    ray_count: rays.ray_count,
                    set_size: table.set_size,
                    set_count,
                    first_cell: rays.first_cell,
                    cell_count: rays.cell_count,
                    stride: rays.stride,
                    seed,
                    first_in_list: first,
                    end_in_list: end,
                };
                let dispatch = |key| {
                    let list = context.rays.borrow();
                    let mut resources = list.as_ref().ok_or_else(no_list)?.resources();
                    resources.extend(scene.resources());
                    resources.extend(table.resources());
                    resources.extend([
                        ("lights", light_list.resource()),
                        ("light_ray_cells", Resource::Buffer(&self.cells)),
                        ("drawn_vpls", Resource::Image(&self.vpls)),
                    ]);
                    resources.extend(context.modulation());
                    let per_group = 64 * RAYS_AT_ONCE;
                    let groups = groups_in_rows((end - first).div_ceil(per_group));
                    context.dispatch_groups(key, &resources, &parameters, groups)
                };
                dispatch(Key::LightRaysEmit {})?;
                scene.tree.trace(context, Find::Closest, 0..end - first)?;
                dispatch(shade_key(plan))?;
            }
        }
        for light_index in 0..lights.len() as u32 {
            if lights[light_index as usize].plan.emission_points == 0 {
                continue;
            }
            let parameters = LightRayParameters {
                light_index,
                first_ray: table.set_size - table.point_count,
                ray_count: table.point_count,
                set_size: table.set_size,
                set_count,
                seed,
                ..LightRayParameters::default()
            };
            let mut resources = vec![
                ("lights", light_list.resource()),
                ("drawn_vpls", Resource::Image(&self.vpls)),
            ];
            resources.extend(context.modulation());
            let groups = groups_in_rows((table.point_count * set_count).div_ceil(64));
            context.dispatch_groups(surfaces_key(plan), &resources, &parameters, groups)?;
        }
        let (vpls, paths) = (&self.vpls, &self.paths);
        let further = light_paths::trace(context, scene, vpls, paths, table, sets)?;
        Ok(count + further)
    }
}
