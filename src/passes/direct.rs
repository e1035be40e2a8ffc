//! Direct pass: adds the direct radiance of one light to the direct image.

use super::{Context, gbuffer::GBuffer, light::DeviceLight, rays::RayTriangles, surface::Surfaces};
use crate::{
    RayKernel, Result,
    vulkan::{Buffer, Image, Recorder, Resource, shaders::DirectParameters},
};

/// What the shadow test searches.
#[derive(Clone, Copy)]
pub(crate) enum Occluders<'o> {
    /// The positions and triangles that the light sees.
    Map(&'o Image),
    /// All triangles.
    Rays(RayKernel, &'o RayTriangles),
}

/// The images to which direct light is added.
#[derive(Clone, Copy)]
pub(crate) struct DirectImages<'i> {
    pub radiance: &'i Image,
    /// Z, with time of flight. At pixel centres it lacks the path from P to C.
    pub phasors: Option<&'i Image>,
}

/// Which points of the pixels a G-buffer shows.
#[derive(Clone, Copy)]
pub(crate) enum SeenAt {
    Centres,
    /// `share` is the weight of each sample in its pixel.
    Samples {
        share: f64,
    },
}

/// Shades the G-buffer. For a light with an area, `point` is the uploaded point that shines.
pub(crate) fn shade(
    recorder: &mut Recorder,
    context: &Context,
    surfaces: &Surfaces,
    (gbuffer, seen_at): (&GBuffer, SeenAt),
    (light, point, occluders): (&DeviceLight, Option<&Buffer>, Occluders),
    direct: DirectImages,
) -> Result<()> {
    let plan = context.plan;
    let mut words = vec![light.plan.emission_word(), plan.brdf_word()];
    let mut resources = gbuffer.resources();
    resources.extend([
        ("light", Resource::Buffer(point.unwrap_or(&light.uniform))),
        ("direct_radiance", Resource::Image(direct.radiance)),
    ]);
    resources.extend(light.pattern_resource());
    if let Some(phasors) = direct.phasors.filter(|_| light.plan.is_modulated) {
        words.push("phasors");
        resources.push(("direct_phasors", Resource::Image(phasors)));
        resources.extend(context.modulation());
    }
    let centres = DirectParameters {
        camera_position: context.camera_position(),
        share: 1.0,
        ..DirectParameters::default()
    };
    let parameters = match seen_at {
        SeenAt::Centres => centres,
        SeenAt::Samples { share } => DirectParameters {
            share: share as f32,
            camera_turns: context.camera_turns(),
            has_way_to_camera: 1.0,
            ..centres
        },
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
