//! A frame, from the scene to the images of its layers: [`draw`] is the sequence of passes.

mod area_light;
mod buffer_pool;
mod cache;
mod drawn;
mod forecast;
mod images;
mod indirect;
mod lights;
mod pixel_samples;
mod progress;
mod readback;
mod requirements;
mod scene_resources;

use std::time::Instant;

use glam::DVec2;

use crate::{
    Result,
    passes::{
        Context,
        direct::{self, DirectImages, SeenAt},
        gbuffer::{self, GBuffer},
        light::DeviceLight,
        primary_rays, rsm, sensor, shadow,
        surface::{Surfaces, upload_view},
        trace::RayList,
        view, vpl,
    },
    vulkan::shaders::Seen,
};

pub(crate) use buffer_pool::BufferPool;
use cache::LockedLate;
pub(crate) use cache::{Cached, FrameCache};
pub(crate) use drawn::DrawnFrame;
pub use drawn::{DeviceFrame, DeviceImage};
pub(crate) use forecast::RenderedFrame;
pub(crate) use images::FrameImages;
use images::FrameImagesKey;
pub(crate) use indirect::ErrorEstimates;
pub(crate) use lights::Lights;
use lights::{Dirty, LightsKey};
pub use progress::Progress;
pub(crate) use progress::ProgressReport;
use scene_resources::SceneResources;

/// Called for each light, with its index, once its maps are drawn and its VPLs are listed.
pub(crate) type Observer<'o> = dyn FnMut(&Context, &Lights, usize) -> Result<()> + 'o;

/// Draws a frame: G-buffer; for each light its maps, direct light and VPLs; the gather; the sensor.
///
/// Reuses what still fits in the cache. If the frame fails, the cache must be discarded.
pub(crate) fn draw(
    context: &Context,
    cache: &mut FrameCache,
    progress: &mut ProgressReport,
    mut observe: Option<&mut Observer>,
) -> Result<(ErrorEstimates, u64)> {
    // Drop what no longer fits before anything is made.
    let images_key = FrameImagesKey::new(context.plan, context.stays_on_device);
    let lights_key = LightsKey::new(context);
    cache.images.drop_unless(&images_key);
    cache.lights.drop_unless(&lights_key);
    let start = Instant::now();
    if cache.scene.update(context, &cache.scenes)? {
        context.cost.borrow_mut().copying += start.elapsed();
    }
    let (scene, surfaces) = (&cache.scene, cache.scene.surfaces()?);
    let (lights, lights_are_new) = cache
        .lights
        .get_or_make(lights_key, || Lights::new(context))?;
    let (images, _) = cache.images.get_or_make(images_key.clone(), || {
        FrameImages::new(context.device, context.plan, images_key)
    })?;
    let FrameImages {
        gbuffer, direct, ..
    } = &*images;

    context.begin_step("direct");
    progress.report("gbuffer", 0.0)?;
    RayList::update(context.rays, context)?;
    context.record(|r| {
        if lights_are_new {
            lights.record_clears(r);
        }
        images.record_clears(r);
        Ok(())
    })?;
    see(context, scene, DVec2::ZERO, gbuffer)?;

    let direct_images = DirectImages {
        radiance: direct,
        phasors: images.direct_phasors.as_ref(),
    };
    let mut area_light_error: Option<f64> = None;
    for index in 0..context.plan.lights.len() {
        progress.begin_light(index, "direct")?;
        let (light, dirty) = lights.update(context, index, scene)?;
        let is_centre = context.plan.pixel_sampling.is_none();
        if let (true, true, Some(sums)) = (is_centre, light.plan.is_area(), &images.area_light) {
            let error = area_light::shade(
                context,
                surfaces,
                (gbuffer, None),
                (index, light, dirty.occluders),
                (sums, direct_images),
                context.seed,
                progress,
            )?;
            area_light_error = Some(area_light_error.unwrap_or_default().max(error));
        }
        draw_maps(context, surfaces, light, &dirty)?;
        if is_centre && !light.plan.is_area() {
            let seen = (gbuffer, SeenAt::Centres);
            let light = (light, None, dirty.occluders);
            direct::shade(context, surfaces, seen, light, direct_images)?;
        }
        if let Some((rsm, vpls)) = dirty.vpls {
            context.record(|r| vpl::extract(r, context, light, rsm, vpls))?;
        }
        if dirty.vpls.is_some() {
            context.finish()?;
            lights.take_vpls(index)?;
        }
        if let Some(observe) = observe.as_deref_mut() {
            context.finish()?;
            observe(context, lights, index)?;
        }
    }

    context.begin_step("indirect");
    let mut estimates = match context.plan.bounce() {
        Some(plan) => indirect::gather(context, plan, scene, lights, images, progress)?,
        None => ErrorEstimates::default(),
    };

    context.begin_step("sensor");
    let of_samples = pixel_samples::average(context, scene, lights, images, progress)?;
    estimates.area_light_error = of_samples.or(area_light_error);

    // Radiance is the same sum as energy. It is for a host that reads it on the device.
    let plan = context.plan;
    let (joule, aperture) = (plan.joule_per_irradiance, plan.irradiance_per_radiance);
    let energy_factor = joule.map(|joule| joule * aperture.unwrap_or(1.0));
    let seen = match &images.sampled {
        Some(sampled) => (Seen::Sampled, "footprint", &sampled.footprint),
        None => (Seen::Aperture, "position_mesh", &gbuffer.position_mesh),
    };
    for (factor, seen, sum) in [
        (energy_factor, aperture.map(|_| seen), &images.energy),
        (Some(1.0), None, &images.radiance),
    ] {
        if let (Some(factor), Some(sum)) = (factor, sum) {
            let exposure = sensor::Exposure {
                factor,
                seen,
                direct,
                indirect: images.indirect.as_ref(),
                sum,
            };
            context.record(|r| sensor::expose(r, context, &exposure))?;
        }
    }
    if !context.stays_on_device {
        readback::record(context, images)?;
    }
    context.finish()?;
    scene.share(LockedLate::new(&cache.scenes).lock());
    progress.end()?;
    let vpl_count = lights.vpl_count() + context.cost.borrow().work_of("light_rays");
    Ok((estimates, vpl_count))
}

/// Fills a G-buffer with what the camera sees through points at `offset_px` from the pixels' centres.
fn see(
    context: &Context,
    scene: &SceneResources,
    offset_px: DVec2,
    gbuffer: &GBuffer,
) -> Result<()> {
    let camera = view::of_camera(&context.scene.camera, context.space, offset_px);
    let camera = upload_view(context.device, &camera)?;
    if context.plan.has_primary_rays {
        let hit = (scene.ray_tree()?, scene.hit_surfaces()?);
        let rays = (&camera, scene.lens_rays(), offset_px);
        return primary_rays::draw(context, hit, rays, gbuffer);
    }
    let surfaces = scene.surfaces()?;
    context.record(|r| gbuffer::draw(r, context, surfaces, &camera, gbuffer))
}

/// Draws the maps of a light that have to be made.
fn draw_maps(
    context: &Context,
    surfaces: &Surfaces,
    light: &DeviceLight,
    dirty: &Dirty,
) -> Result<()> {
    context.record(|r| {
        if let Some(map) = dirty.rsm {
            rsm::draw(r, context, surfaces, light, map)?;
        }
        if let Some(map) = dirty.shadow_map {
            shadow::draw(r, context, surfaces, light, map)?;
        }
        Ok(())
    })
}
