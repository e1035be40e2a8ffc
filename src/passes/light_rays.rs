//! Light rays pass: makes the VPLs of final gathering, where rays from the lights hit the scene.

use super::{
    Context, hits::HitSurfaces, light::DeviceLight, rays::RayTriangles, vpl_sampler::RayTable,
};
use crate::{
    RayKernel, Result,
    plan::Plan,
    vulkan::{
        Allocate, BufferUse, Device, ImageShape, PixelKind, Resource, TexelList, groups_in_rows,
        shaders::{LightRayParameters, Module},
    },
};

/// Most rays of all sets together.
pub(crate) const MAX_RAYS: u32 = 1 << 18;

/// VPLs, one per ray, with one layer per member.
pub(crate) struct LightRays<A: Allocate = Device> {
    pub vpls: A::Image,
    hits: A::Buffer,
}

impl<A: Allocate> LightRays<A> {
    pub fn new(allocate: &A, plan: &Plan) -> Result<LightRays<A>> {
        let words = ["shade", plan.brdf_word(), "flat", plan.phasor_word()];
        let module = Module::find("light_rays", &words)?;
        let columns = module.constant("VPLS_PER_ROW")?;
        let layers = if plan.is_specular {
            "GLOSSY_VPL_LAYERS"
        } else {
            "VPL_LAYERS"
        };
        // Every light has at least one packet.
        let rays = MAX_RAYS + 1024 * plan.lights.len() as u32;
        let shape = ImageShape {
            size_px: [columns, rays.div_ceil(columns)],
            layers: Some(module.constant(layers)?),
            pixel: PixelKind::Color,
        };
        let bytes = u64::from(rays) * size_of::<[u32; 2]>() as u64;
        Ok(LightRays {
            vpls: allocate.image("VPLs", shape)?,
            hits: allocate.buffer("hits of the lights' rays", bytes, BufferUse::Device)?,
        })
    }
}

impl LightRays {
    /// Traces rays from the lights as the table says, in `set_count` sets. Returns their number.
    pub fn trace(
        &self,
        context: &Context,
        (tree, surfaces): (&RayTriangles, &HitSurfaces),
        (lights, light_list): (&[&DeviceLight], &TexelList),
        table: &RayTable,
        (set_count, seed): (u32, u32),
        kernel: RayKernel,
    ) -> Result<u64> {
        let plan = context.plan;
        let pipelines = context.pipelines;
        let tree_word = tree.kernel_word();
        let [shading, textured] = plan.shading_words();
        let shade = pipelines.compute(
            "light_rays",
            &[
                "shade",
                plan.brdf_word(),
                shading,
                textured,
                plan.phasor_word(),
            ],
        )?;
        let count = u64::from(table.set_size) * u64::from(set_count);
        context.cost.borrow_mut().count_work("light_rays", count);
        context.record(|recorder| {
            recorder.prepare_images(&[&self.vpls]);
            recorder.pass("light_rays", |recorder| {
                for (index, (light, rays)) in lights.iter().zip(&table.lights).enumerate() {
                    if rays.ray_count == 0 {
                        continue;
                    }
                    let mut resources = tree.resources();
                    resources.extend(surfaces.resources());
                    resources.extend(table.resources());
                    resources.extend([
                        ("lights", light_list.resource()),
                        ("light_ray_hits", Resource::Buffer(&self.hits)),
                        ("drawn_vpls", Resource::Image(&self.vpls)),
                    ]);
                    resources.extend(context.modulation());
                    let parameters = LightRayParameters {
                        light_index: index as u32,
                        first_ray: rays.first_ray,
                        ray_count: rays.ray_count,
                        set_size: table.set_size,
                        set_count,
                        first_cell: rays.first_cell,
                        cell_count: rays.cell_count,
                        stride: rays.stride,
                        seed,
                    };
                    let is_parallel = light.parameters.is_parallel == 1;
                    let origin = if is_parallel { "parallel" } else { "central" };
                    let words = ["trace", origin, kernel.name(), tree_word];
                    let trace = pipelines.compute("light_rays", &words)?;
                    let rays_per_group = 64 * trace.module.constant("RAYS")?;
                    let ray_count = rays.ray_count * set_count;
                    let groups = groups_in_rows(ray_count.div_ceil(rays_per_group));
                    recorder.dispatch(&trace, &resources, &parameters, groups)?;
                    recorder.barrier();
                    let groups = groups_in_rows(ray_count.div_ceil(64));
                    recorder.dispatch(&shade, &resources, &parameters, groups)?;
                }
                Ok(())
            })
        })?;
        Ok(count)
    }
}
