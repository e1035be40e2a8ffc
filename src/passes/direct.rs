//! Direct pass: the direct radiance of one light, added to the direct image.

use super::{Context, gbuffer::GBuffer, light::DeviceLight, rays::RayTriangles, surface::Surfaces};
use crate::{
    RayKernel, Result,
    vulkan::{Image, Recorder, Resource, shaders::DirectParameters},
};

/// What the shadow test looks into.
#[derive(Clone, Copy)]
pub(crate) enum Occluders<'r> {
    /// The positions and triangles that the light sees.
    Map(&'r Image),
    /// All triangles.
    Rays(RayKernel, &'r RayTriangles),
}

impl<'r> Occluders<'r> {
    pub fn map(self) -> Option<&'r Image> {
        match self {
            Occluders::Map(map) => Some(map),
            Occluders::Rays(..) => None,
        }
    }
}

/// Shades the G-buffer.
pub(crate) fn shade<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    surfaces: &'r Surfaces,
    gbuffer: &'r GBuffer,
    light: &'r DeviceLight,
    occluders: Occluders<'r>,
    direct: &'r Image,
) -> Result<()> {
    let plan = context.plan;
    let mut words = vec![light.plan.kind, plan.brdf_word()];
    let mut resources = gbuffer.resources();
    resources.extend([
        ("light", Resource::Buffer(&light.uniform)),
        ("direct_radiance", Resource::Image(direct)),
    ]);
    let mut parameters = DirectParameters {
        camera_position: context.camera_position(),
        ..DirectParameters::default()
    };
    match occluders {
        Occluders::Map(map) => {
            resources.extend(surfaces.triangles());
            resources.push(("light_map", Resource::Image(map)));
        }
        Occluders::Rays(kernel, triangles) => {
            words.push(kernel.name());
            resources.extend(triangles.resources());
            parameters.node_count = triangles.node_count;
        }
    }
    let pipeline = context.pipelines.compute("direct", &words)?;
    let tile_px = pipeline.module.constant("TILE_PX")?;
    let [columns, rows] = plan.resolution_px.map(|size| size.div_ceil(tile_px));
    recorder.pass("direct", |recorder| {
        recorder.dispatch(&pipeline, &resources, &parameters, [columns, rows, 1])
    })
}
