//! A frame, from the scene to its layers: [`Renderer::draw_frame`] is the sequence of passes.

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use crate::{
    Device, Error, GatherKernel, Plan, Result, Scene,
    intermediates::{Intermediates, LightIntermediates},
    light_setup::LightSetup,
    local_space::LocalSpace,
    output::{Frame, FrameDescription, FrameStats, PassTime},
    passes::{
        direct,
        gather::{self, Gather, GatherStats},
        gbuffer::{self, GBuffer},
        receivers::{self, Receivers},
        rsm::{self, Rsm},
        sensor,
        shadow::{self, ShadowMap},
        surface::{Surfaces, upload_view},
        view,
        vpl::{self, VplLists},
    },
    readback::read_layers,
    vulkan::{Image, ImageShape, PassTimes, Pipelines, Recorder},
};

/// Passes of one submission but the gather's: as many have timestamps.
const TIMED_PASSES: u32 = 16;

/// Renders frames on a device. Pipelines are made once and kept.
pub struct Renderer {
    device: Device,
    pipelines: Pipelines,
}

/// How to render, apart from what.
pub struct RenderOptions<'a> {
    /// Called between submissions; `Break` ends the render with [`Error::Cancelled`].
    pub progress: Option<&'a mut dyn FnMut(Progress) -> ControlFlow<()>>,
    /// GPU time that one submission of the gather should take.
    pub submission_target: Duration,
    /// The gather kernel; `None`: the fastest for the device.
    pub gather_kernel: Option<GatherKernel>,
}

impl Default for RenderOptions<'_> {
    fn default() -> Self {
        RenderOptions {
            progress: None,
            submission_target: Duration::from_millis(500),
            gather_kernel: None,
        }
    }
}

/// How far a render is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// 0 to 1, by estimated work.
    pub fraction: f32,
    /// The pass that runs next.
    pub pass: &'static str,
}

/// The images that a frame ends with.
pub(crate) struct DrawnFrame {
    pub gbuffer: GBuffer,
    pub direct: Image,
    pub indirect: Option<Image>,
    pub energy: Option<Image>,
}

/// What a frame cost so far.
#[derive(Default)]
struct Cost {
    times: PassTimes,
    submissions: u32,
    vpl_count: u64,
    pairs: u64,
}

impl Cost {
    fn submit(&mut self, recorder: Recorder) -> Result<()> {
        self.times.extend(recorder.submit()?);
        self.submissions += 1;
        Ok(())
    }

    /// Times of the same pass added up, in the order of first appearance.
    fn passes(&self) -> Vec<PassTime> {
        let mut passes: Vec<PassTime> = Vec::new();
        for &(name, milliseconds) in &self.times {
            match passes.iter_mut().find(|pass| pass.name == name) {
                Some(pass) => pass.milliseconds += milliseconds,
                None => passes.push(PassTime { name, milliseconds }),
            }
        }
        passes
    }
}

impl Renderer {
    /// A renderer on a device.
    ///
    /// # Errors
    /// None today; pipelines are made when a scene first needs them.
    pub fn new(device: &Device) -> Result<Renderer> {
        Ok(Renderer {
            device: device.clone(),
            pipelines: Pipelines::new(device),
        })
    }

    /// Renders a frame.
    ///
    /// # Errors
    /// [`Error::Scene`] for an invalid scene and [`Error::DeviceLimit`] for one that the device cannot hold, both before
    /// any work starts; [`Error::NoDevice`] for a gather kernel that does not run on this one; [`Error::Cancelled`];
    /// [`Error::Memory`] and [`Error::Vulkan`] where the device fails.
    pub fn render(&mut self, scene: &Scene, options: &mut RenderOptions) -> Result<Frame> {
        self.render_keeping(scene, options, None)
    }

    /// Renders a frame and keeps what its passes hand to each other: for tests and for a look inside.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_with_intermediates(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
    ) -> Result<(Frame, Intermediates)> {
        let mut intermediates = Intermediates::default();
        let frame = self.render_keeping(scene, options, Some(&mut intermediates))?;
        Ok((frame, intermediates))
    }

    fn render_keeping(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        mut keep: Option<&mut Intermediates>,
    ) -> Result<Frame> {
        let start = Instant::now();
        let mut plan = Plan::new(scene, self.device.info())?;
        if let (Some(indirect), Some(kernel)) = (&mut plan.indirect, options.gather_kernel) {
            indirect.kernel = kernel.checked_for(self.device.info())?;
        }
        let space = LocalSpace::of(scene.bounding_box());
        let mut cost = Cost::default();
        let drawn = self.draw_frame(
            scene,
            &plan,
            &space,
            options,
            &mut cost,
            keep.as_deref_mut(),
        )?;
        if let Some(keep) = keep {
            keep.read_gbuffer(&self.device, &drawn.gbuffer, &space)?;
        }
        let layers = read_layers(&self.device, &scene.camera, &space, &drawn)?;
        let info = self.device.info();
        Ok(Frame {
            resolution_px: plan.resolution_px,
            layers,
            stats: FrameStats {
                device: info.name.clone(),
                driver: info.driver.clone(),
                passes: cost.passes(),
                vpl_count: cost.vpl_count,
                pixel_vpl_pairs: cost.pairs,
                submissions: cost.submissions,
                wall_milliseconds: start.elapsed().as_secs_f64() * 1e3,
            },
            description: FrameDescription::new(scene, scene.hash()),
        })
    }

    /// The frame: G-buffer; for each light its maps, direct light, VPLs and gather; the sensor.
    fn draw_frame(
        &self,
        scene: &Scene,
        plan: &Plan,
        space: &LocalSpace,
        options: &mut RenderOptions,
        cost: &mut Cost,
        mut keep: Option<&mut Intermediates>,
    ) -> Result<DrawnFrame> {
        let (device, pipelines) = (&self.device, &self.pipelines);
        let report = options.progress.as_mut().map(|report| &mut **report as _);
        let mut progress = ProgressReport::new(report, plan.lights.len());
        let shape = ImageShape::plain(plan.resolution_px);
        let camera_position = space.to_local(scene.camera.position_m);

        let surfaces = Surfaces::upload(device, scene, plan, space)?;
        let camera_view = upload_view(device, &view::of_camera(&scene.camera, space))?;
        let gbuffer = GBuffer::new(device, plan)?;
        let direct = Image::new(device, "direct radiance", shape)?;
        let indirect_radiance = plan
            .indirect
            .map(|_| Image::new(device, "indirect radiance", shape))
            .transpose()?;
        let receivers = plan
            .indirect
            .map(|_| Receivers::new(device, plan))
            .transpose()?;

        progress.report("gbuffer", 0.0)?;
        let mut recorder = Recorder::new(device, TIMED_PASSES)?;
        surfaces.record_textures(&mut recorder);
        for sum in [Some(&direct), indirect_radiance.as_ref()]
            .into_iter()
            .flatten()
        {
            recorder.prepare_images(&[sum]);
            recorder.clear_image(sum);
        }
        gbuffer::draw(
            &mut recorder,
            pipelines,
            plan,
            &surfaces,
            &camera_view,
            &gbuffer,
        )?;
        if let Some(receivers) = &receivers {
            receivers::list(&mut recorder, pipelines, plan, &gbuffer, receivers)?;
        }
        cost.submit(recorder)?;

        // Room that every light uses in turn.
        let mut maps = LightMaps::new(device, plan)?;
        for (index, light_plan) in plan.lights.iter().enumerate() {
            progress.begin_light(index, "direct")?;
            let light = LightSetup::new(device, scene, index, plan, space)?;
            if let Some(vpls) = &mut maps.vpls {
                vpls.set_texel_count(light.texel_count)?;
            }

            let mut recorder = Recorder::new(device, TIMED_PASSES)?;
            if let Some(rsm) = &maps.rsm {
                let (faces, emission) = (&light.rsm_views, &light.emission);
                rsm::draw(
                    &mut recorder,
                    pipelines,
                    plan,
                    &surfaces,
                    faces,
                    emission,
                    rsm,
                )?;
            }
            if let Some(map) = maps.shadow.as_ref().filter(|_| !light_plan.shadow_from_rsm) {
                shadow::draw(
                    &mut recorder,
                    pipelines,
                    &surfaces,
                    &light.shadow_views,
                    map,
                )?;
            }
            direct::shade(
                &mut recorder,
                pipelines,
                plan,
                light_plan,
                &surfaces,
                &gbuffer,
                &light.uniform,
                maps.shadow_positions(light_plan.shadow_from_rsm)?,
                camera_position,
                &direct,
            )?;
            if let (Some(indirect), Some(rsm), Some(vpls)) = (&plan.indirect, &maps.rsm, &maps.vpls)
            {
                let (uniform, emission) = (&light.uniform, &light.emission);
                vpl::extract(
                    &mut recorder,
                    pipelines,
                    plan,
                    indirect,
                    uniform,
                    emission,
                    rsm,
                    vpls,
                )?;
            }
            cost.submit(recorder)?;

            if let Some(keep) = keep.as_deref_mut() {
                let kept = LightIntermediates::read(device, &light, light_plan, &maps, space)?;
                keep.lights.push(kept);
            }
            if let (Some(indirect), Some(vpls), Some(receivers), Some(indirect_radiance)) =
                (&plan.indirect, &maps.vpls, &receivers, &indirect_radiance)
            {
                let gather = Gather {
                    device,
                    pipelines,
                    indirect,
                    gbuffer: &gbuffer,
                    receivers,
                    receiver_lengths: receivers.lengths()?,
                    camera_position,
                    indirect_radiance,
                    submission_target: options.submission_target,
                };
                let lengths = vpls.lengths()?;
                let mut stats = GatherStats::default();
                gather::accumulate(&gather, vpls, lengths, &mut stats, &mut |fraction| {
                    progress.report("gather", fraction)
                })?;
                cost.vpl_count += u64::from(lengths.matte) + u64::from(lengths.glossy);
                cost.pairs += stats.pairs;
                cost.submissions += stats.submissions;
                cost.times.extend(stats.times);
            }
        }

        let energy = match plan.joule_per_irradiance {
            None => None,
            Some(joule_per_irradiance) => {
                let energy = Image::new(device, "energy", shape)?;
                let mut recorder = Recorder::new(device, TIMED_PASSES)?;
                sensor::expose(
                    &mut recorder,
                    pipelines,
                    plan,
                    joule_per_irradiance,
                    &direct,
                    indirect_radiance.as_ref(),
                    &energy,
                )?;
                cost.submit(recorder)?;
                Some(energy)
            }
        };
        Ok(DrawnFrame {
            gbuffer,
            direct,
            indirect: indirect_radiance,
            energy,
        })
    }
}

/// The maps of the light at hand, and the list of its VPLs.
pub(crate) struct LightMaps {
    pub rsm: Option<Rsm>,
    pub shadow: Option<ShadowMap>,
    pub vpls: Option<VplLists>,
}

impl LightMaps {
    fn new(device: &Device, plan: &Plan) -> Result<LightMaps> {
        let faces = plan
            .lights
            .iter()
            .map(|light| light.faces)
            .max()
            .unwrap_or(1);
        let shadow_size = plan
            .lights
            .iter()
            .filter(|light| !light.shadow_from_rsm)
            .map(|light| light.shadow_size)
            .max();
        let texels = |size: u32| faces * size * size;
        Ok(LightMaps {
            rsm: plan
                .indirect
                .map(|indirect| Rsm::new(device, plan, indirect.rsm_size, faces))
                .transpose()?,
            shadow: shadow_size
                .map(|size| ShadowMap::new(device, size, faces))
                .transpose()?,
            vpls: plan
                .indirect
                .map(|indirect| VplLists::new(device, plan, texels(indirect.rsm_size)))
                .transpose()?,
        })
    }

    /// The positions that the shadow test reads.
    pub fn shadow_positions(&self, from_rsm: bool) -> Result<&Image> {
        let own = self.shadow.as_ref().map(|map| &map.position);
        let rsm = self.rsm.as_ref().map(|rsm| &rsm.position);
        if from_rsm { rsm } else { own }
            .ok_or_else(|| Error::internal("a light has no map for its shadows"))
    }
}

/// Turns the progress of passes into that of the frame.
struct ProgressReport<'a> {
    report: Option<&'a mut dyn FnMut(Progress) -> ControlFlow<()>>,
    light: usize,
    light_count: usize,
}

impl<'a> ProgressReport<'a> {
    fn new(
        report: Option<&'a mut dyn FnMut(Progress) -> ControlFlow<()>>,
        light_count: usize,
    ) -> Self {
        ProgressReport {
            report,
            light: 0,
            light_count,
        }
    }

    fn begin_light(&mut self, light: usize, pass: &'static str) -> Result<()> {
        self.light = light;
        self.report(pass, 0.0)
    }

    /// `fraction` is the share of the current light's work that is done.
    fn report(&mut self, pass: &'static str, fraction: f64) -> Result<()> {
        let Some(report) = &mut self.report else {
            return Ok(());
        };
        let fraction = (self.light as f64 + fraction) / self.light_count.max(1) as f64;
        let progress = Progress {
            fraction: fraction as f32,
            pass,
        };
        match report(progress) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Cancelled),
        }
    }
}
