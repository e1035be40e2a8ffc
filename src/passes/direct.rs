//! Direct pass: the direct radiance of one light, added to the direct image.

use super::{Context, gbuffer::GBuffer, light::DeviceLight, surface::Surfaces};
use crate::{
    Result,
    vulkan::{
        Image, Recorder, Resource,
        shaders::{DirectParameters, Module},
    },
};

/// Shades the G-buffer. `light_map` holds the positions and triangles that the light sees.
pub(crate) fn shade<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    surfaces: &'r Surfaces,
    gbuffer: &'r GBuffer,
    light: &'r DeviceLight,
    light_map: &'r Image,
    direct: &'r Image,
) -> Result<()> {
    let plan = context.plan;
    let words = [light.plan.kind, plan.brdf_word()];
    let pipeline = context.pipelines.compute("direct", &words)?;
    let mut resources = gbuffer.resources();
    resources.extend(surfaces.triangles());
    resources.extend([
        ("light", Resource::Buffer(&light.uniform)),
        ("light_map", Resource::Image(light_map)),
        ("direct_radiance", Resource::Image(direct)),
    ]);
    let parameters = DirectParameters {
        camera_position: context.camera_position(),
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
