//! Primary rays pass: fills the G-buffer like the gbuffer pass, but with rays through the pixels' centres.

use std::sync::Arc;

use glam::DVec2;

use super::{
    Context,
    gbuffer::GBuffer,
    hits::HitScene,
    trace::{Find, no_list},
};
use crate::{
    Result,
    output::per_pixel,
    plan::Plan,
    scene::Camera,
    vulkan::{
        Allocate, Buffer, BufferUse, CommandPool, Image, Resource, groups_in_rows,
        shaders::{Key, PeelParameters, PrimaryRayParameters},
    },
};

/// Rounds of rays that go on before the host waits to see whether any did. Few rays meet more than these walls from behind.
const ROUNDS_UNSEEN: u32 = 4;

/// Declares the memory for the lens of a plan.
pub(crate) fn declare(allocate: &impl Allocate, plan: &Plan) -> Result<()> {
    if plan.has_distortion {
        let pixels: u64 = plan.resolution_px.map(u64::from).iter().product();
        let bytes = pixels * size_of::<[f32; 4]>() as u64;
        allocate.uploaded_buffer("rays of the lens", bytes)?;
    }
    Ok(())
}

/// Uploads the direction of the ray through each pixel's centre, in the camera's axes and the shader's order: Z, X, Y. The fourth number is 1
/// for a pixel that sees nothing, outside the image circle of a fisheye lens. It has the direction at the circle's edge, between which and its
/// own the pixels at the edge interpolate.
pub(crate) fn upload_lens(commands: &CommandPool, camera: &Camera) -> Result<Arc<Buffer>> {
    let [width, height] = camera.resolution_px.map(|size| size as usize);
    let mut rays = vec![0.0; 4 * width * height];
    per_pixel(&mut rays, |i| {
        let [x_px, y_px] = [i % width, i / width].map(|place| place as f64 + 0.5);
        let seen = camera.unproject(x_px, y_px);
        let direction = seen.unwrap_or_else(|| camera.direction_at_circle(x_px, y_px));
        let is_unseen = f64::from(u8::from(seen.is_none()));
        [direction.z, direction.x, direction.y, is_unseen].map(|value| value as f32)
    });
    commands.upload("rays of the lens", &rays)
}

/// The image to which the light that surfaces emit to the camera is added, and the weight of the rays' points in their pixels.
pub(crate) struct Emission<'e> {
    pub image: &'e Image,
    pub share: f64,
}

/// Fills the G-buffer with the surfaces as seen from `view`, through points at `offset_px` from the pixels' centres.
pub(crate) fn draw(
    context: &Context,
    scene: HitScene,
    view: &Buffer,
    lens: Option<&Buffer>,
    offset_px: DVec2,
    gbuffer: &GBuffer,
    emission: Option<Emission>,
) -> Result<()> {
    let plan = context.plan;
    let emit = Key::PrimaryRaysEmit {
        lens: plan.has_distortion,
    };
    let shade = Key::PrimaryRaysShade {
        lens: plan.has_distortion,
        brdf: plan.brdf(),
        surface: plan.surface(),
        instanced: plan.has_shared_meshes,
    };
    let triangles = gbuffer.triangles.as_ref();
    let name_triangles = Key::PrimaryRaysTriangles {
        lens: plan.has_distortion,
        instanced: plan.has_shared_meshes,
    };
    let emit_light = Key::PrimaryRaysEmissive {
        lens: plan.has_distortion,
        surface: plan.surface(),
        instanced: plan.has_shared_meshes,
    };
    let mut resources = vec![("view", Resource::Buffer(view))];
    let of_emission = emission.iter();
    resources.extend(of_emission.map(|of| ("emission", Resource::Image(of.image))));
    resources.extend(lens.map(|lens| ("lens_rays", Resource::Buffer(lens))));
    resources.extend(scene.resources());
    let (mesh_ends, mesh_count) = scene.surfaces.mesh_ends();
    resources.push(("mesh_ends", mesh_ends));
    resources.extend(gbuffer.resources());
    resources.extend(triangles.map(|image| ("seen_triangles", Resource::Image(image))));
    let [width, _] = plan.resolution_px;
    context.prepare_images(&gbuffer.colors())?;
    context.prepare_images(triangles.as_slice())?;
    for [first_row, row_end] in context.row_ranges() {
        let parameters = PrimaryRayParameters {
            resolution_px: plan.resolution_px,
            material_count: context.scene.materials.len() as u32,
            mesh_count,
            offset_px: offset_px.as_vec2().to_array(),
            first_row,
            row_end,
            share: emission.as_ref().map_or(0.0, |emission| emission.share) as f32,
            ..PrimaryRayParameters::default()
        };
        let dispatch = |key| {
            let list = context.rays.borrow();
            let mut resources = resources.clone();
            resources.extend(list.as_ref().ok_or_else(no_list)?.resources());
            let size = [width, row_end - first_row];
            context.dispatch_image(key, &resources, &parameters, size)
        };
        dispatch(emit)?;
        let ray_count = width * (row_end - first_row);
        scene.tree.trace(context, Find::Closest, 0..ray_count)?;
        if plan.has_one_sided {
            peel(context, scene, ray_count)?;
        }
        dispatch(shade)?;
        if triangles.is_some() {
            dispatch(name_triangles)?;
        }
        if emission.is_some() {
            dispatch(emit_light)?;
        }
    }
    Ok(())
}

/// Lets the rays go on that hit a one-sided surface from behind, until each has hit what the camera sees.
fn peel(context: &Context, scene: HitScene, ray_count: u32) -> Result<()> {
    let key = Key::PrimaryRaysPeel {
        instanced: context.plan.has_shared_meshes,
    };
    let last_round = Buffer::filled(context.device, "last round", &[0u32], BufferUse::Readback)?;
    for round in 1.. {
        let list = context.rays.borrow();
        let mut resources = vec![("last_round", Resource::Buffer(&last_round))];
        resources.extend(scene.resources());
        resources.extend(list.as_ref().ok_or_else(no_list)?.resources());
        let parameters = PeelParameters { ray_count, round };
        let groups = groups_in_rows(ray_count.div_ceil(64));
        context.dispatch_groups(key, &resources, &parameters, groups)?;
        drop(list);
        if round > ROUNDS_UNSEEN {
            context.finish()?;
            if last_round.mapped::<u32>(1)?[0] < round {
                break;
            }
        }
        scene.tree.trace(context, Find::Closest, 0..ray_count)?;
    }
    Ok(())
}
