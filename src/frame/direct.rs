//! What the camera sees, and the direct light there: at the pixels' centres, or at one sample of each pixel.

use glam::DVec2;

use super::{
    FrameImages, ProgressReport, area_light, lights::UpdatedLight, scene_resources::SceneResources,
};
use crate::{
    Result,
    passes::{
        Context,
        direct::{self, SeenPoints},
        gbuffer::{self, GBuffer},
        primary_rays::{self, Emission},
        rsm, shadow,
        surface::{Surfaces, upload_view},
        view,
    },
    vulkan::Image,
};

/// Fills a G-buffer with what the camera sees through points at `offset_px` from the pixels' centres. `share` is the weight of each point in
/// its pixel, unless it is the only one. Adds what the surfaces emit to `emission`.
pub(super) fn see<'g>(
    context: &Context,
    scene: &'g SceneResources,
    offset_px: DVec2,
    share: Option<f64>,
    gbuffer: &'g GBuffer,
    emission: Option<&Image>,
) -> Result<SeenPoints<'g>> {
    let surfaces = scene.surfaces()?;
    let camera = view::of_camera(&context.scene.camera, context.space, offset_px);
    let camera = upload_view(context.device, &camera)?;
    if context.plan.has_primary_rays {
        let (scene, lens) = (scene.hit_scene()?, scene.lens_rays());
        let emission = emission.map(|image| Emission {
            image,
            share: share.unwrap_or(1.0),
        });
        primary_rays::draw(context, scene, &camera, lens, offset_px, gbuffer, emission)?;
    } else {
        gbuffer::draw(context, surfaces, &camera, gbuffer)?;
    }
    Ok(SeenPoints {
        surfaces,
        gbuffer,
        share,
    })
}

/// Draws the maps of a light that have to be made.
pub(super) fn draw_maps(
    context: &Context,
    surfaces: &Surfaces,
    light: &UpdatedLight,
) -> Result<()> {
    if let Some(map) = light.rsm_to_draw {
        rsm::draw(context, surfaces, light.device, map)?;
    }
    if let Some(map) = light.shadow_map_to_draw {
        shadow::draw(context, surfaces, light.device, map)?;
    }
    Ok(())
}

/// Adds a light to the images of direct light, as the G-buffer shows it. Another `seed` gives other points of its area, if it has one.
/// Returns an estimate of the relRMSE of a light with an area. What surfaces emit is no direct light.
pub(super) fn shade(
    context: &Context,
    seen: SeenPoints,
    light: &UpdatedLight,
    images: &FrameImages,
    seed: u32,
    progress: &mut ProgressReport,
) -> Result<Option<f64>> {
    if light.device.plan.emission_points > 0 {
        // The gather finds it.
        return Ok(None);
    }
    if light.device.plan.has_area {
        return area_light::shade(context, seen, light, images, seed, progress);
    }
    let direct = images.direct_images();
    direct::shade(context, seen, light.device, None, light.occluders, direct)?;
    Ok(None)
}
