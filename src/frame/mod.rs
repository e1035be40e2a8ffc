//! A frame, from the scene to the images of its layers: [`draw`] is the sequence of passes.

mod adaptive;
mod cost;
mod progress;
mod readback;
mod source;

use std::time::Duration;

use crate::{
    Error, IndirectMethod, IndirectPlan, Result, ShadowPlan, SumPlan,
    intermediates::{Intermediates, LightIntermediates},
    passes::{
        Context,
        bounce::Bounce,
        direct::{self, Occluders},
        gather::{Gather, GatherStats, ListedVpls, Sums},
        gbuffer::{self, GBuffer},
        hits::HitSurfaces,
        light::DeviceLight,
        rays::RayTreeImages,
        receivers::{self, Receivers},
        rsm::{self, Rsm},
        sensor,
        shadow::{self, ShadowMap},
        surface::{Surfaces, upload_view},
        view,
        vpl::{self, VplLists},
        vpl_draws::ListedLight,
    },
    vulkan::{Image, ImageShape, Recorder},
};

use adaptive::Adaptive;
pub(crate) use cost::Cost;
pub use progress::Progress;
pub(crate) use progress::ProgressReport;
pub(crate) use readback::{Readback, read_layers};
use source::SumOfLights;

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
        .map(|indirect| Indirect::new(context, indirect))
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

    let mut listed_lights = Vec::new();
    let mut listed_vpls = Vec::new();
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
        if let Some(indirect) = &indirect {
            let lengths = indirect.vpls.lengths()?;
            cost.vpl_count += u64::from(lengths.matte) + u64::from(lengths.glossy);
            if let IndirectMethod::Bounce(_) = indirect.plan.method {
                listed_lights.push(ListedLight::new(&light, &indirect.vpls)?);
            }
            let listed = ListedVpls {
                first: place[0],
                lengths,
            };
            listed_vpls.push(listed);
            if let (IndirectMethod::Sum(sum), Some(receivers)) =
                (indirect.plan.method, &indirect.receivers)
            {
                let mut gather = indirect.gather(context, sum, &gbuffer, submission_target);
                let runs = receivers.runs()?;
                gather.accumulate(
                    &[listed],
                    (&receivers.pixels, &runs),
                    Sums::Image(&indirect.radiance),
                    &mut |share| progress.report("gather", share),
                )?;
                cost.add_gather(gather.stats);
                // What is exact is within every error that is asked for.
                let asked = scene.indirect.and_then(|indirect| indirect.target_error);
                cost.estimated_error = asked.map(|_| 0.0);
            }
        }
    }

    if let Some(indirect) = &indirect
        && let Some(refinement) = indirect.plan.refinement()
        && (indirect.plan.bounce().is_some() || listed_vpls.iter().any(|listed| listed.count() > 0))
    {
        let adaptive = Adaptive {
            context,
            plan: refinement,
            gbuffer: &gbuffer,
            indirect_radiance: &indirect.radiance,
        };
        match (indirect.plan.method, &ray_tree, &hit_surfaces) {
            (IndirectMethod::Sum(sum), ..) => {
                let mut sums = SumOfLights {
                    gather: indirect.gather(context, sum, &gbuffer, submission_target),
                    lights: &listed_vpls,
                };
                let estimated = if sums.may_pay() {
                    adaptive.gather(&mut sums, progress, cost)?
                } else {
                    None
                };
                if estimated.is_none() {
                    sums.gather_everywhere(&indirect.radiance, progress, cost)?;
                }
                cost.estimated_error = estimated.or(Some(0.0));
                cost.add_gather(sums.gather.stats);
            }
            (IndirectMethod::Bounce(bounce_plan), Some(tree), Some(hit_surfaces)) => {
                let mut bounce = Bounce::new(
                    context,
                    &gbuffer,
                    (tree, hit_surfaces),
                    &indirect.vpls,
                    &listed_lights,
                    bounce_plan.kernel,
                    submission_target,
                )?;
                cost.estimated_error = adaptive.gather(&mut bounce, progress, cost)?;
                cost.add_bounce(bounce.stats);
            }
            (IndirectMethod::Bounce(_), ..) => {
                return Err(Error::internal("there are no triangles for rays"));
            }
        }
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

/// What indirect light takes beside the G-buffer. The RSM is room that the lights use in turn.
struct Indirect<'c> {
    plan: &'c IndirectPlan,
    rsm: Rsm,
    vpls: VplLists,
    /// Every pixel; `None` where few are gathered.
    receivers: Option<Receivers>,
    radiance: Image,
}

impl<'c> Indirect<'c> {
    fn new(context: &Context, plan: &'c IndirectPlan) -> Result<Self> {
        let Context {
            device,
            plan: frame,
            ..
        } = *context;
        let faces = frame.max_faces();
        let shape = ImageShape::plain(frame.resolution_px);
        let texels = faces * plan.rsm_size * plan.rsm_size;
        let is_refined = plan.refinement().is_some();
        let light_count = frame.lights.len() as u32;
        let vpls = match plan.method {
            IndirectMethod::Bounce(_) => VplLists::for_bounce(device, frame, light_count, texels)?,
            IndirectMethod::Sum(_) => {
                let lists = if is_refined { light_count } else { 1 };
                VplLists::new(device, frame, lists, texels)?
            }
        };
        Ok(Indirect {
            plan,
            rsm: Rsm::new(device, frame, plan.rsm_size, faces)?,
            vpls,
            receivers: (!is_refined)
                .then(|| Receivers::new(device, frame))
                .transpose()?,
            radiance: Image::new(device, "indirect radiance", shape)?,
        })
    }

    fn gather<'g>(
        &'g self,
        context: &'g Context<'g>,
        SumPlan { kernel, .. }: SumPlan,
        gbuffer: &'g GBuffer,
        submission_target: Duration,
    ) -> Gather<'g> {
        Gather {
            context,
            estimator: self.plan.estimator,
            kernel,
            gbuffer,
            vpls: &self.vpls,
            submission_target,
            stats: GatherStats::default(),
        }
    }
}
