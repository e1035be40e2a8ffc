//! A frame, from the scene to the images of its layers: [`draw`] is the sequence of passes.

mod buffer_pool;
mod cache;
mod drawn;
mod images;
mod indirect;
mod lights;
mod progress;
mod readback;
mod requirements;
mod scene_resources;

use crate::{
    Error, Result,
    passes::{
        Context,
        cost::Cost,
        direct::{self, Occluders},
        gbuffer, rsm, sensor, shadow,
        surface::upload_view,
        view, vpl,
    },
    plan::{LightPlan, ShadowPlan},
    vulkan::Recorder,
};

pub(crate) use buffer_pool::BufferPool;
pub(crate) use cache::{Cached, FrameCache};
pub(crate) use drawn::DrawnFrame;
pub use drawn::{DeviceFrame, DeviceImage};
pub(crate) use images::FrameImages;
use images::FrameImagesKey;
pub(crate) use indirect::ErrorEstimates;
pub(crate) use lights::Lights;
use lights::LightsKey;
pub use progress::Progress;
pub(crate) use progress::ProgressReport;
use scene_resources::SceneResources;

/// Passes of one submission but the gather's: as many have timestamps.
const TIMED_PASSES: u32 = 16;

/// Is called for each light once its maps are drawn and its VPLs are listed, with its number.
pub(crate) type Observer<'o> = dyn FnMut(&Context, &Lights, usize) -> Result<()> + 'o;

/// The frame: G-buffer; for each light its maps, direct light and VPLs; the gather; the sensor.
///
/// What in the cache still fits is used again. Where the frame fails, the cache must be given up.
pub(crate) fn draw(
    context: &Context,
    cache: &mut FrameCache,
    progress: &mut ProgressReport,
    cost: &mut Cost,
    mut observe: Option<&mut Observer>,
) -> Result<(ErrorEstimates, u64)> {
    let images_key = FrameImagesKey::new(context.plan, context.stays_on_device);
    cache.images.drop_unless(&images_key);
    cache.lights.drop_unless(&LightsKey::new(context));
    cache.scene.update(context)?;
    let scene = &cache.scene;
    let new_lights = || Lights::new(context);
    let (lights, is_new) = cache
        .lights
        .get_or_make(LightsKey::new(context), new_lights)?;
    let (images, _) = cache.images.get_or_make(images_key.clone(), || {
        FrameImages::new(context.device, context.plan, images_key)
    })?;
    let images = &*images;

    progress.report("gbuffer", 0.0)?;
    draw_gbuffer(context, (scene, &*lights, is_new), images, cost)?;
    for (index, light_plan) in context.plan.lights.iter().enumerate() {
        progress.begin_light(index, "direct")?;
        light(context, (scene, lights, index), light_plan, images, cost)?;
        if let Some(observe) = observe.as_deref_mut() {
            observe(context, lights, index)?;
        }
    }
    let estimates = match context.plan.indirect {
        Some(plan) => indirect::gather(context, plan, (scene, &*lights), images, progress, cost)?,
        None => ErrorEstimates::default(),
    };
    expose(context, images, cost)?;
    Ok((estimates, lights.vpl_count()))
}

/// What the camera sees.
fn draw_gbuffer(
    context: &Context,
    (scene, lights, lights_are_new): (&SceneResources, &Lights, bool),
    images: &FrameImages,
    cost: &mut Cost,
) -> Result<()> {
    let camera = view::of_camera(&context.scene.camera, context.space);
    let camera = upload_view(context.device, &camera)?;
    let mut recorder = Recorder::new(context.device, TIMED_PASSES)?;
    scene.record_copies(&mut recorder);
    if lights_are_new {
        lights.record_clears(&mut recorder);
    }
    for sum in images.sums() {
        recorder.prepare_images(&[sum]);
        recorder.clear_image(sum);
    }
    let surfaces = scene.surfaces()?;
    gbuffer::draw(&mut recorder, context, surfaces, &camera, &images.gbuffer)?;
    cost.submit(recorder)
}

/// What one light sees, its direct light, and the VPLs that it makes.
fn light(
    context: &Context,
    (scene, lights, index): (&SceneResources, &mut Lights, usize),
    plan: &LightPlan,
    images: &FrameImages,
    cost: &mut Cost,
) -> Result<()> {
    let dirty = lights.update(context, index, scene.generation)?;
    let light = lights.light(index)?;
    let surfaces = scene.surfaces()?;
    let mut recorder = Recorder::new(context.device, TIMED_PASSES)?;
    let r = &mut recorder;
    if let (true, Some(map)) = (dirty.rsm, lights.rsm(index)) {
        rsm::draw(r, context, surfaces, light, map)?;
    }
    if let (true, Some(map)) = (dirty.shadow_map, lights.shadow_map(index)) {
        shadow::draw(r, context, surfaces, light, map)?;
    }
    let occluders = match plan.shadow {
        ShadowPlan::Rays(kernel) => Some(Occluders::Rays(kernel, scene.ray_tree()?)),
        map => lights.occluders(index, map),
    };
    let occluders = occluders.ok_or_else(|| Error::internal("a light has no shadow map"))?;
    let gbuffer = &images.gbuffer;
    direct::shade(
        r,
        context,
        surfaces,
        gbuffer,
        light,
        occluders,
        &images.direct,
    )?;
    if let (true, Some(indirect), Some(rsm), Some(vpls)) = (
        dirty.vpls,
        &context.plan.indirect,
        lights.rsm(index),
        &lights.vpls,
    ) {
        vpl::extract(r, context, indirect, light, rsm, vpls)?;
    }
    cost.submit(recorder)?;
    if dirty.vpls {
        lights.take_vpls(context, index)?;
    }
    Ok(())
}

/// Energy, and radiance for a host: in numbers the irradiance on the pixel.
fn expose(context: &Context, images: &FrameImages, cost: &mut Cost) -> Result<()> {
    for (factor, sum) in [
        (context.plan.joule_per_irradiance, &images.energy),
        (Some(1.0), &images.radiance),
    ] {
        let (Some(factor), Some(sum)) = (factor, sum) else {
            continue;
        };
        let (direct, indirect) = (&images.direct, images.indirect.as_ref());
        let mut recorder = Recorder::new(context.device, TIMED_PASSES)?;
        sensor::expose(&mut recorder, context, factor, direct, indirect, sum)?;
        cost.submit(recorder)?;
    }
    Ok(())
}
