//! Direct pass: the direct radiance of one light, added to the direct image.

use super::{Context, gbuffer::GBuffer, light::DeviceLight, rays::RayTriangles, surface::Surfaces};
use crate::{
    RayKernel, Result,
    scene::MAX_FREQUENCIES,
    vulkan::{Buffer, Image, Recorder, Resource, shaders::DirectParameters},
};

/// What the shadow test looks into.
#[derive(Clone, Copy)]
pub(crate) enum Occluders<'o> {
    /// The positions and triangles that the light sees.
    Map(&'o Image),
    /// All triangles.
    Rays(RayKernel, &'o RayTriangles),
}

/// Where direct light is added up.
#[derive(Clone, Copy)]
pub(crate) struct DirectImages<'i> {
    pub radiance: &'i Image,
    /// With time of flight: Z but for the way to C, and the [modulation](super::modulation).
    pub phasors: Option<(&'i Image, &'i Buffer)>,
}

/// Shades the G-buffer. `origin_turns` is that of the light, where it is modulated.
pub(crate) fn shade(
    recorder: &mut Recorder,
    context: &Context,
    surfaces: &Surfaces,
    gbuffer: &GBuffer,
    (light, origin_turns): (&DeviceLight, Option<[f32; MAX_FREQUENCIES]>),
    occluders: Occluders,
    direct: DirectImages,
) -> Result<()> {
    let plan = context.plan;
    let mut words = vec![light.plan.kind, plan.brdf_word()];
    let mut resources = gbuffer.resources();
    resources.extend([
        ("light", Resource::Buffer(&light.uniform)),
        ("direct_radiance", Resource::Image(direct.radiance)),
    ]);
    if let (Some((phasors, modulation)), Some(_)) = (direct.phasors, origin_turns) {
        words.push("phasors");
        resources.extend([
            ("direct_phasors", Resource::Image(phasors)),
            ("modulation", Resource::Buffer(modulation)),
        ]);
    }
    let parameters = DirectParameters {
        camera_position: context.camera_position(),
        origin_turns: origin_turns.unwrap_or_default(),
        ..DirectParameters::default()
    };
    match occluders {
        Occluders::Map(map) => {
            resources.extend(surfaces.triangles());
            resources.push(("light_map", Resource::Image(map)));
        }
        Occluders::Rays(kernel, tree) => {
            words.extend([kernel.name(), tree.kernel_word()]);
            resources.extend(tree.resources());
        }
    }
    let pipeline = context.pipelines.compute("direct", &words)?;
    let [width, height] = plan.resolution_px;
    let columns = width.div_ceil(pipeline.module.constant("TILE_COLUMNS")?);
    let rows = height.div_ceil(pipeline.module.constant("TILE_ROWS")?);
    recorder.pass("direct", |recorder| {
        recorder.dispatch(&pipeline, &resources, &parameters, [columns, rows, 1])
    })
}
