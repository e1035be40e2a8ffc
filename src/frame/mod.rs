//! A frame, from the scene to the images of its layers: [`draw`] is the sequence of passes.

mod antialiasing;
mod area_light;
mod buffer_pool;
mod cache;
mod direct;
mod drawn;
mod forecast;
mod frame_cache;
mod images;
mod indirect;
mod lights;
mod progress;
mod readback;
mod requirements;
mod scene_resources;
mod seen_triangles;

use std::time::Instant;

use glam::DVec2;

use crate::{
    Result,
    passes::{Context, sensor, trace::RayList, vpl},
    vulkan::shaders::Falloff,
};

pub(crate) use buffer_pool::BufferPool;
pub(crate) use cache::Cached;
use cache::LockedLate;
use direct::{draw_maps, see, shade};
pub(crate) use drawn::DrawnFrame;
pub use drawn::{DeviceFrame, DeviceImage};
pub(crate) use forecast::RenderedFrame;
pub(crate) use frame_cache::FrameCache;
pub(crate) use images::FrameImages;
use images::FrameImagesKey;
pub(crate) use indirect::ErrorEstimates;
pub(crate) use lights::Lights;
use lights::LightsKey;
pub use progress::Progress;
pub(crate) use progress::ProgressReport;
pub(crate) use seen_triangles::shows_triangles;

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
    let has_triangles = !context.stays_on_device && shows_triangles(context.layers);
    let images_key = FrameImagesKey::new(context.plan, context.stays_on_device, has_triangles);
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
    // Otherwise, light is averaged over the pixels below.
    let is_of_centres = context.plan.pixel_sampling.is_none();
    let emission = images.emission.as_ref().filter(|_| is_of_centres);
    let centres = see(context, scene, DVec2::ZERO, None, gbuffer, emission)?;

    let mut area_light_error: Option<f64> = None;
    for index in 0..context.plan.lights.len() {
        progress.begin_light(index, "direct")?;
        let light = lights.update(context, index, scene)?;
        draw_maps(context, surfaces, &light)?;
        if is_of_centres {
            let seed = context.seed;
            let error = shade(context, centres, &light, images, seed, progress)?;
            area_light_error = area_light_error.into_iter().chain(error).reduce(f64::max);
        }
        if let Some((rsm, vpls)) = light.vpls_to_list {
            vpl::extract(context, light.device, rsm, vpls)?;
            context.finish()?;
            lights.take_vpls(index)?;
        }
        if let Some(observe) = observe.as_deref_mut() {
            context.finish()?;
            observe(context, lights, index)?;
        }
    }

    context.begin_step("indirect");
    let estimates = match context.plan.bounce() {
        Some(plan) => indirect::gather(context, plan, scene, lights, images, progress)?,
        None => ErrorEstimates::default(),
    };

    context.begin_step("sensor");
    let of_samples = antialiasing::average(context, scene, lights, images, progress)?;
    let estimates = ErrorEstimates {
        area_light_error: of_samples.or(area_light_error),
        ..estimates
    };

    // Radiance is the same sum as energy. It is for a host that reads it on the device.
    let plan = context.plan;
    let (joule, aperture) = (plan.joule_per_irradiance, plan.irradiance_per_radiance);
    let energy_factor = joule.map(|joule| joule * aperture.unwrap_or(1.0));
    let positions = &gbuffer.position_instance;
    let falloff = match (plan.vignetting, &images.sampled) {
        (Some(measured), _) => Some((measured, None)),
        (None, _) if plan.is_orthographic => None,
        (None, Some(sampled)) => Some((Falloff::Sampled, Some(("footprint", &sampled.footprint)))),
        (None, None) => Some((Falloff::Aperture, Some(("position_instance", positions)))),
    };
    for (factor, falloff, sum) in [
        (energy_factor, aperture.and(falloff), &images.energy),
        (Some(1.0), None, &images.radiance),
    ] {
        if let (Some(factor), Some(sum)) = (factor, sum) {
            let exposure = sensor::Exposure {
                factor,
                falloff,
                direct,
                indirect: images.indirect.as_ref(),
                emission: images.emission.as_ref(),
                sum,
            };
            sensor::expose(context, &exposure)?;
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
