//! A frame, from the scene to the images of its layers: [`draw`] is the sequence of passes.

mod adaptive;
mod cost;
mod drawn;
mod images;
mod indirect;
mod kept;
mod lighting;
mod progress;
mod readback;
mod shuffle;
mod source;
mod spare;
mod stage;

use std::time::Duration;

use crate::{
    Error, Result, ShadowPlan,
    intermediates::{Intermediates, LightIntermediates},
    passes::{
        Context,
        direct::{self, Occluders},
        gbuffer, receivers, rsm, sensor, shadow,
        surface::upload_view,
        view, vpl,
    },
    vulkan::Recorder,
};

pub(crate) use cost::Cost;
pub(crate) use drawn::DrawnFrame;
pub use drawn::{DeviceFrame, DeviceImage};
pub(crate) use images::FrameImages;
use indirect::Indirect;
pub(crate) use kept::Kept;
use lighting::Lighting;
pub use progress::Progress;
pub(crate) use progress::ProgressReport;
pub(crate) use spare::Spare;
use stage::Stage;

/// Passes of one submission but the gather's: as many have timestamps.
const TIMED_PASSES: u32 = 16;

/// The frame: G-buffer; for each light its maps, direct light, VPLs and gather; the sensor.
///
/// Of what the frame before has left in `kept`, all that still fits is used again; what does not, and everything where the
/// frame fails, is given up.
pub(crate) fn draw(
    context: &Context,
    submission_target: Duration,
    kept: &mut Kept,
    progress: &mut ProgressReport,
    cost: &mut Cost,
    mut keep: Option<&mut Intermediates>,
) -> Result<FrameImages> {
    let Context {
        device,
        scene,
        plan,
        space,
        ..
    } = *context;
    let mut before = std::mem::take(kept);
    before.images = FrameImages::kept(before.images, context);
    before.lighting = Lighting::kept(before.lighting, context);
    let stage = Stage::renew(&mut before, context)?;
    let (is_new_room, mut lighting) = match before.lighting {
        Some(lighting) => (false, lighting),
        None => (true, Lighting::new(context)?),
    };
    let images = before
        .images
        .map_or_else(|| FrameImages::new(context), Ok)?;
    let camera_view = upload_view(device, &view::of_camera(&scene.camera, space))?;
    let indirect = Indirect::for_plan(context, submission_target)?;

    progress.report("gbuffer", 0.0)?;
    let mut recorder = Recorder::new(device, TIMED_PASSES)?;
    stage.record_copies(&mut recorder);
    if let (true, Some(_), Some(vpls)) = (is_new_room, plan.bounce(), &lighting.vpls) {
        recorder.prepare_images(&[&vpls.matte]);
    }
    for sum in images.sums() {
        recorder.prepare_images(&[sum]);
        recorder.clear_image(sum);
    }
    let gbuffer = &images.gbuffer;
    gbuffer::draw(
        &mut recorder,
        context,
        stage.surfaces(),
        &camera_view,
        gbuffer,
    )?;
    if let Some(pixels) = indirect.as_ref().and_then(|i| i.receivers.as_ref()) {
        receivers::list(&mut recorder, context, gbuffer, pixels)?;
    }
    cost.submit(recorder)?;

    for (index, light_plan) in plan.lights.iter().enumerate() {
        progress.begin_light(index, "direct")?;
        let renewed = lighting.renew(context, index)?;
        let light = lighting.light(index)?;
        let mut recorder = Recorder::new(device, TIMED_PASSES)?;
        if let (true, Some(rsm)) = (renewed.maps, &lighting.rsm) {
            rsm::draw(&mut recorder, context, stage.surfaces(), light, rsm)?;
        }
        let occluders = match (
            light_plan.shadow,
            &lighting.rsm,
            &lighting.shadow_map,
            stage.ray_tree(),
        ) {
            (ShadowPlan::Rsm { .. }, Some(rsm), ..) => Occluders::Map(&rsm.position),
            (ShadowPlan::Map { .. }, _, Some(map), _) => {
                if renewed.maps {
                    shadow::draw(&mut recorder, context, stage.surfaces(), light, map)?;
                }
                Occluders::Map(&map.position)
            }
            (ShadowPlan::Rays(kernel), .., Some(tree)) => Occluders::Rays(kernel, tree),
            _ => {
                return Err(Error::internal(
                    "a light has nothing to find its shadows in",
                ));
            }
        };
        direct::shade(
            &mut recorder,
            context,
            stage.surfaces(),
            gbuffer,
            light,
            occluders,
            &images.direct,
        )?;
        if let (true, Some(indirect), Some(rsm), Some(vpls)) =
            (renewed.vpls, &plan.indirect, &lighting.rsm, &lighting.vpls)
        {
            vpl::extract(&mut recorder, context, indirect, light, rsm, vpls)?;
        }
        cost.submit(recorder)?;

        if let Some(keep) = keep.as_deref_mut() {
            let rsm = lighting.rsm.as_ref().zip(lighting.vpls.as_ref());
            let kept = LightIntermediates::read(context, light, occluders.map(), rsm)?;
            keep.lights.push(kept);
        }
        if renewed.vpls {
            lighting.take_vpls(context, index)?;
        }
        cost.add_vpls(lighting.vpls_of(index));
        if let Some(indirect) = &indirect {
            indirect.gather_everywhere(index, &lighting, &images, progress, cost)?;
        }
    }

    if let Some(indirect) = &indirect {
        indirect.gather_where_it_varies(&stage, &lighting, &images, progress, cost)?;
    }
    // Radiance is, in numbers, the irradiance on the pixel.
    for (factor, sum) in [
        (plan.joule_per_irradiance, &images.energy),
        (Some(1.0), &images.radiance),
    ] {
        let (Some(factor), Some(sum)) = (factor, sum) else {
            continue;
        };
        let (direct, indirect) = (&images.direct, images.indirect.as_ref());
        let mut recorder = Recorder::new(device, TIMED_PASSES)?;
        sensor::expose(&mut recorder, context, factor, direct, indirect, sum)?;
        cost.submit(recorder)?;
    }
    kept.stage = Some(stage);
    kept.lighting = Some(lighting);
    Ok(images)
}
