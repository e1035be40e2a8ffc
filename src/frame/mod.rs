//! A frame, from the scene to the images of its layers: [`draw`] is the sequence of passes.

mod adaptive;
mod cost;
mod indirect;
mod progress;
mod readback;
mod shuffle;
mod source;

use std::time::Duration;

use crate::{
    Error, Result, ShadowPlan,
    intermediates::{Intermediates, LightIntermediates},
    passes::{
        Context,
        direct::{self, Occluders},
        gbuffer::{self, GBuffer},
        hits::HitSurfaces,
        light::DeviceLight,
        rays::RayTreeImages,
        receivers, rsm, sensor,
        shadow::{self, ShadowMap},
        surface::{Surfaces, upload_view},
        view, vpl,
    },
    vulkan::{Image, ImageShape, Recorder},
};

pub(crate) use cost::Cost;
use indirect::Indirect;
pub use progress::Progress;
pub(crate) use progress::ProgressReport;
pub(crate) use readback::{Readback, read_layers};

/// Passes of one submission but the gather's: as many have timestamps.
const TIMED_PASSES: u32 = 16;

/// The images that a frame ends with.
pub(crate) struct DrawnFrame {
    pub gbuffer: GBuffer,
    pub direct: Image,
    pub indirect: Option<Image>,
    pub energy: Option<Image>,
}

/// The frame: G-buffer; for each light its maps, direct light, VPLs and gather; the sensor.
pub(crate) fn draw(
    context: &Context,
    submission_target: Duration,
    progress: &mut ProgressReport,
    cost: &mut Cost,
    mut keep: Option<&mut Intermediates>,
) -> Result<DrawnFrame> {
    let Context {
        device,
        scene,
        plan,
        space,
        ..
    } = *context;
    let image = |what| Image::new(device, what, ImageShape::plain(plan.resolution_px));
    let surfaces = Surfaces::upload(device, scene, plan, space)?;
    let ray_tree = RayTreeImages::for_plan(device, scene, plan, space)?;
    let hit_surfaces = plan
        .bounce()
        .map(|_| HitSurfaces::upload(device, scene, plan))
        .transpose()?;
    let camera_view = upload_view(device, &view::of_camera(&scene.camera, space))?;
    let gbuffer = GBuffer::new(device, plan)?;
    let direct = image("direct radiance")?;
    let shadow_map = ShadowMap::for_plan(device, plan)?;
    let mut indirect = plan
        .indirect
        .as_ref()
        .map(|indirect| Indirect::new(context, indirect, submission_target))
        .transpose()?;

    progress.report("gbuffer", 0.0)?;
    let mut recorder = Recorder::new(device, TIMED_PASSES)?;
    surfaces.record_textures(&mut recorder);
    if let Some(tree) = &ray_tree {
        tree.record_copy(&mut recorder);
    }
    if let Some(surfaces) = &hit_surfaces {
        surfaces.record_copy(&mut recorder);
    }
    recorder.prepare_images(&[&direct]);
    recorder.clear_image(&direct);
    gbuffer::draw(&mut recorder, context, &surfaces, &camera_view, &gbuffer)?;
    if let Some(indirect) = &indirect {
        recorder.prepare_images(&[&indirect.radiance]);
        recorder.clear_image(&indirect.radiance);
        if let Some(receivers) = &indirect.receivers {
            receivers::list(&mut recorder, context, &gbuffer, receivers)?;
        } else if plan.bounce().is_some() {
            recorder.prepare_images(&[&indirect.vpls.matte]);
        }
    }
    cost.submit(recorder)?;

    for (index, (light, light_plan)) in scene.lights.iter().zip(&plan.lights).enumerate() {
        progress.begin_light(index, "direct")?;
        let place = match &indirect {
            Some(indirect) => indirect.vpls.room_per_light.map(|room| index as u32 * room),
            None => [0; 2],
        };
        let light = DeviceLight::new(context, light, light_plan, place)?;
        if let Some(indirect) = &mut indirect {
            indirect.vpls.set_texel_count(light.texel_count)?;
        }

        let mut recorder = Recorder::new(device, TIMED_PASSES)?;
        if let Some(indirect) = &indirect {
            rsm::draw(&mut recorder, context, &surfaces, &light, &indirect.rsm)?;
        }
        let occluders = match (light_plan.shadow, &indirect, &shadow_map, &ray_tree) {
            (ShadowPlan::Rsm { .. }, Some(indirect), ..) => Occluders::Map(&indirect.rsm.position),
            (ShadowPlan::Map { .. }, _, Some(map), _) => {
                shadow::draw(&mut recorder, context, &surfaces, &light, map)?;
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
            &surfaces,
            &gbuffer,
            &light,
            occluders,
            &direct,
        )?;
        if let Some(Indirect {
            plan, rsm, vpls, ..
        }) = &indirect
        {
            vpl::extract(&mut recorder, context, plan, &light, rsm, vpls)?;
        }
        cost.submit(recorder)?;

        if let Some(keep) = keep.as_deref_mut() {
            let rsm = indirect.as_ref().map(|i| (&i.rsm, &i.vpls));
            let kept = LightIntermediates::read(context, &light, occluders.map(), rsm)?;
            keep.lights.push(kept);
        }
        if let Some(indirect) = &mut indirect {
            indirect.take_vpls(context, &light, cost)?;
            indirect.gather_everywhere(context, &gbuffer, progress, cost)?;
        }
    }

    if let Some(indirect) = &indirect {
        let rays = ray_tree.as_ref().zip(hit_surfaces.as_ref());
        indirect.gather_where_it_varies(context, &gbuffer, rays, progress, cost)?;
    }
    let mut frame = DrawnFrame {
        gbuffer,
        direct,
        indirect: indirect.map(|indirect| indirect.radiance),
        energy: None,
    };
    if let Some(joule_per_irradiance) = plan.joule_per_irradiance {
        let energy = image("energy")?;
        let mut recorder = Recorder::new(device, TIMED_PASSES)?;
        let (direct, indirect) = (&frame.direct, frame.indirect.as_ref());
        sensor::expose(
            &mut recorder,
            context,
            joule_per_irradiance,
            direct,
            indirect,
            &energy,
        )?;
        cost.submit(recorder)?;
        frame.energy = Some(energy);
    }
    Ok(frame)
}
