//! Direct pass: the direct radiance of one light, added to the direct image.

use super::{gbuffer::GBuffer, surface::Surfaces};
use crate::{
    Result,
    plan::{LightPlan, Plan},
    vulkan::{
        Buffer, Image, Pipelines, Recorder, Resource,
        shaders::{DirectParameters, Module},
    },
};

/// Shades the G-buffer. `light_map` holds the positions and triangles that the light sees.
#[allow(
    clippy::too_many_arguments,
    reason = "a pass is a function of its images"
)]
pub(crate) fn shade<'r>(
    recorder: &mut Recorder<'r>,
    pipelines: &Pipelines,
    plan: &Plan,
    light_plan: &LightPlan,
    surfaces: &'r Surfaces,
    gbuffer: &'r GBuffer,
    light: &'r Buffer,
    light_map: &'r Image,
    camera_position: [f32; 3],
    direct: &'r Image,
) -> Result<()> {
    let words = [light_plan.kind, plan.brdf_word()];
    let pipeline = pipelines.compute("direct", &words)?;
    let mut resources = gbuffer.resources();
    resources.extend(surfaces.triangles());
    resources.extend([
        ("light", Resource::Buffer(light)),
        ("light_map", Resource::Image(light_map)),
        ("direct_radiance", Resource::Image(direct)),
    ]);
    let parameters = DirectParameters {
        camera_position,
        ..DirectParameters::default()
    };
    let groups = groups_over(plan.resolution_px, pipeline.module);
    recorder.pass("direct", |recorder| {
        recorder.dispatch(&pipeline, &resources, &parameters, groups)
    })
}

/// Workgroups that cover an image.
pub(crate) fn groups_over(size_px: [u32; 2], module: &Module) -> [u32; 3] {
    let [x, y, _] = module.workgroup_size;
    [size_px[0].div_ceil(x), size_px[1].div_ceil(y), 1]
}
