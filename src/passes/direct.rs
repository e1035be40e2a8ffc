//! Direct pass: adds the direct radiance of one light to the direct image.

use super::{
    Context,
    gbuffer::GBuffer,
    light::DeviceLight,
    rays::RayTriangles,
    surface::Surfaces,
    trace::{Find, no_list},
};
use crate::{
    Result,
    vulkan::{
        Buffer, Image, Resource,
        shaders::{self, DirectParameters, Key},
    },
};

/// What the shadow test searches.
#[derive(Clone, Copy)]
pub(crate) enum Occluders<'o> {
    /// The positions and triangles that the light sees.
    Map(&'o Image),
    /// All triangles.
    Rays(&'o RayTriangles),
}

/// The images to which direct light is added.
#[derive(Clone, Copy)]
pub(crate) struct DirectImages<'i> {
    pub radiance: &'i Image,
    /// Z, with time of flight. At pixel centres it lacks the path from P to C.
    pub phasors: Option<&'i Image>,
}

/// Surfaces, a G-buffer of them, and which points of the pixels it shows.
#[derive(Clone, Copy)]
pub(crate) struct SeenPoints<'g> {
    pub surfaces: &'g Surfaces,
    pub gbuffer: &'g GBuffer,
    /// Weight of each point in its pixel; `None`: the points are the pixels' centres.
    pub share: Option<f64>,
}

/// Shades the points. For a light with an area, `point_of_area` is the uploaded point that shines.
pub(crate) fn shade(
    context: &Context,
    seen: SeenPoints,
    light: &DeviceLight,
    point_of_area: Option<&Buffer>,
    occluders: Occluders,
    direct: DirectImages,
) -> Result<()> {
    let plan = context.plan;
    let emission = light.kernels;
    let uniform = point_of_area.unwrap_or(&light.uniform);
    let mut resources = seen.gbuffer.resources();
    resources.extend([
        ("light", Resource::Buffer(uniform)),
        ("direct_radiance", Resource::Image(direct.radiance)),
    ]);
    resources.extend(light.pattern_resource());
    let phasors = direct.phasors.filter(|_| light.plan.is_modulated);
    let key = |shadow| Key::Direct {
        shadow,
        phasors: phasors.is_some(),
        emission,
        brdf: plan.brdf(),
        area: point_of_area.is_some(),
    };
    if let Some(phasors) = phasors {
        resources.push(("direct_phasors", Resource::Image(phasors)));
        resources.extend(context.modulation());
    }
    let centres = DirectParameters {
        camera_position: context.camera_position(),
        share: 1.0,
        ..DirectParameters::default()
    };
    let parameters = match seen.share {
        None => centres,
        Some(share) => DirectParameters {
            share: share as f32,
            camera_turns: context.camera_turns(),
            has_way_to_camera: 1.0,
            ..centres
        },
    };
    let [width, height] = plan.resolution_px;
    let dispatch = |key, resources: &[(&str, Resource)], rows: [u32; 2]| {
        let [first_row, row_end] = rows;
        let parameters = DirectParameters {
            first_row,
            row_end,
            ..parameters
        };
        let size = [width, row_end - first_row];
        context.dispatch_image(key, resources, &parameters, size)
    };
    match occluders {
        Occluders::Map(map) => {
            resources.extend(seen.surfaces.triangles());
            resources.push(("light_map", Resource::Image(map)));
            dispatch(key(shaders::Shadow::Map), &resources, [0, height])
        }
        Occluders::Rays(tree) => {
            for [first_row, row_end] in context.row_ranges() {
                let rows = [first_row, row_end];
                let with_list = |key| {
                    let list = context.rays.borrow();
                    let mut resources = resources.clone();
                    resources.extend(list.as_ref().ok_or_else(no_list)?.resources());
                    dispatch(key, &resources, rows)
                };
                with_list(Key::DirectEmit { emission })?;
                tree.trace(context, Find::Any, 0..width * (row_end - first_row))?;
                with_list(key(shaders::Shadow::Rays))?;
            }
            Ok(())
        }
    }
}
