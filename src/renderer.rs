//! The renderer.

use std::{
    cell::{Cell, RefCell},
    iter,
    ops::ControlFlow,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use crate::{
    Device, DeviceFrame, Error, GatherKernel, GatherPlan, LocalSpace, Plan, Result, Scene, Tracer,
    frame::{
        self, BufferPool, Cached, DrawnFrame, FrameCache, Observer, Progress, ProgressReport,
        RenderedFrame, shows_triangles,
    },
    model::FrameKey,
    output::{Frame, FrameDescription, FrameStats, Layer, PassTime, StopReason},
    parallel::thread_count,
    passes::{
        Context,
        cost::{Cost, FIRST_ESTIMATE, FURTHER_ESTIMATES, Pace},
        kernels, modulation,
        trace::RayList,
    },
    plan::GatheredPart,
    scene::{IndirectLight, MAX_FREQUENCIES, PixelSampling, TARGET_ERRORS},
    vulkan::{CommandPool, PassTimes, Pipelines, Readback, Timeline, shaders::Key},
};

/// Renders frames on a device.
///
/// Pipelines are made once and kept; all renderers of a device share them. Data that the next frame may need stays on the device: surfaces, and what the lights see and light up.
/// The next frame uses it if it comes from the same values; meshes and textures must be the same [`Shared`](crate::scene::Shared) ones.
/// This changes only the time that a frame takes. A frame that fails leaves nothing.
pub struct Renderer {
    pub(crate) device: Device,
    pipelines: Arc<Pipelines>,
    commands: CommandPool,
    cache: FrameCache,
    /// Room for rays, if the last frame cast any.
    rays: Option<RayList>,
    /// Buffers for the layers of the next frame.
    pool: BufferPool,
    readback: RefCell<Readback>,
    /// The timeline of the frames that stay on the device; `None` before the first.
    timeline: Option<Arc<Timeline>>,
    /// The index of the next frame, unless its options give one.
    pub(crate) next_frame_index: u32,
    last: Option<RenderedFrame>,
    /// The frame whose images are in the cache.
    kept: Option<KeptFrame>,
    /// Of the last frame with final gathering.
    pace: Option<Pace>,
    /// Renderers for frames that render at the same time as this one's.
    pub(crate) others: Vec<Renderer>,
}

/// Largest width and height of the frame that prepares a renderer.
const PREPARED_PX: u32 = 64;

/// Some drivers compile a kernel again for images whose edge is not a power of two.
fn prepared_px(px: u32) -> u32 {
    match px.is_power_of_two() {
        true => px.min(PREPARED_PX),
        false => px.min(PREPARED_PX - 1),
    }
}

/// How to render a scene.
pub struct RenderOptions<'a> {
    /// Called between submissions; `Break` ends the render with [`Error::Cancelled`](crate::Error::Cancelled), or with what it has.
    pub progress: Option<&'a mut dyn FnMut(Progress) -> ControlFlow<()>>,
    /// A render that `progress` ends returns the best image that it has, with its estimated error; where it has none yet, one of few rays.
    /// Direct light is complete in any case. Only with final gathering.
    pub keep_partial: bool,
    /// If the scene, the seed and these options are those of the last frame, returns that frame as it is, but for its index and its sensor noise.
    /// Its statistics then have no passes. A frame that `max_ms` has cut short is drawn again. `false`: draws every frame, to measure it.
    pub repeat_unchanged: bool,
    /// Target GPU time of one submission of the gather.
    pub submission_target: Duration,
    /// The gather kernel; `None`: the fastest for the device.
    pub gather_kernel: Option<GatherKernel>,
    /// What finds the triangles that rays hit; `None`: the fastest for the device.
    pub tracer: Option<Tracer>,
    /// The seed of the frame's random numbers. Another seed gives other samples of indirect light, with another error, and other sensor
    /// noise.
    pub seed: u32,
    /// The index of the frame in a series. Another index gives other sensor noise. `None`: the renderer counts from 0, and goes on after
    /// the largest index that it was given. So two frames differ in their noise, unless you give both the same index.
    pub frame_index: Option<u32>,
    /// The index of the camera among several that see the same frame. Another camera has other sensor noise.
    pub camera_index: u32,
    /// The layers that the host requests. Others stay on the device and are not in the frame. `None`: all layers of the scene,
    /// except those [on request](Layer::is_on_request).
    pub layers: Option<&'a [Layer]>,
}

impl Default for RenderOptions<'_> {
    fn default() -> Self {
        RenderOptions {
            progress: None,
            keep_partial: false,
            repeat_unchanged: false,
            submission_target: Duration::from_millis(500),
            gather_kernel: None,
            tracer: None,
            seed: 0,
            frame_index: None,
            camera_index: 0,
            layers: None,
        }
    }
}

impl Renderer {
    /// Makes a renderer on a device.
    ///
    /// # Errors
    /// None at present; pipelines are made when a scene first needs them.
    pub fn new(device: &Device) -> Result<Renderer> {
        Ok(Renderer {
            device: device.clone(),
            pipelines: device.pipelines(),
            commands: CommandPool::new(device),
            cache: FrameCache::new(device),
            rays: None,
            pool: BufferPool::default(),
            readback: Readback::new(device).into(),
            timeline: None,
            next_frame_index: 0,
            last: None,
            kept: None,
            pace: None,
            others: Vec::new(),
        })
    }

    /// Frees what the last frame left on the device, and the memory of frames. The next frame makes it again.
    pub fn forget(&mut self) {
        self.others.clear();
        self.cache.clear();
        self.kept = None;
        self.rays = None;
        self.commands = CommandPool::new(&self.device);
        self.pool = BufferPool::default();
        self.readback = Readback::new(&self.device).into();
    }

    /// Takes the buffers of a frame that is no longer needed. The next frame of the same size is read into them, which saves time if you
    /// render many frames. Only the last returned frame counts.
    pub fn return_buffers(&mut self, frame: Frame) {
        self.pool = BufferPool::from_frame(frame);
    }

    /// Renders a frame.
    ///
    /// # Errors
    /// [`Error::Scene`](crate::Error::Scene) for an invalid scene, or one without a requested layer, and
    /// [`Error::DeviceLimit`](crate::Error::DeviceLimit) for one that the device cannot hold, both before any work starts;
    /// [`Error::NoDevice`](crate::Error::NoDevice) for a kernel that does not run on this device;
    /// [`Error::Cancelled`](crate::Error::Cancelled); [`Error::Memory`](crate::Error::Memory) and [`Error::Vulkan`](crate::Error::Vulkan)
    /// if the device fails, after which it can be used again; [`Error::DeviceLost`](crate::Error::DeviceLost), after which it cannot.
    pub fn render(&mut self, scene: &Scene, options: &mut RenderOptions) -> Result<Frame> {
        for layer in options.layers.unwrap_or_default() {
            layer.check_made_for(scene)?;
        }
        match options.layers.unwrap_or_default() {
            layers if layers.iter().any(|layer| layer.bounces().is_some()) => {
                self.render_with_bounces(scene, options)
            }
            _ => self.render_part(scene, options, None),
        }
    }

    /// Renders a frame, or a part of one.
    pub(crate) fn render_part(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        part: Option<GatheredPart>,
    ) -> Result<Frame> {
        let start = Instant::now();
        let repeated = match options.repeat_unchanged && part.is_none() {
            true => self.repeat(scene, options)?,
            false => None,
        };
        let is_repeated = repeated.is_some();
        let drawing = Drawing {
            part,
            ..Drawing::default()
        };
        let drawn = match repeated {
            Some(drawn) => drawn,
            None => self.draw(scene, options, drawing)?,
        };
        let pool = std::mem::take(&mut self.pool);
        let began = Instant::now();
        let read = drawn.read(self.readback.get_mut(), pool, options.layers);
        let mut frame = read.inspect_err(|_| self.forget())?;
        let of_layers = began.elapsed() - self.readback.get_mut().take_waiting();
        let host = &mut frame.stats.host_steps;
        host.push(PassTime {
            name: "layers",
            milliseconds: 1e3 * of_layers.as_secs_f64(),
        });
        let wall = start.elapsed().as_secs_f64();
        frame.stats.wall_milliseconds = wall * 1e3;
        if let Some(pace) = self.pace.as_mut().filter(|_| !is_repeated) {
            pace.end_seconds += wall - 1e-3 * drawn.stats.wall_milliseconds;
        }
        let whole = part.is_none().then_some(&drawn);
        self.kept = whole.and_then(|drawn| KeptFrame::of(drawn, options));
        self.cache.images = Cached::new(drawn.images.key.clone(), drawn.images);
        Ok(frame)
    }

    /// The last frame again, if nothing has changed that its images depend on.
    fn repeat(&mut self, scene: &Scene, options: &mut RenderOptions) -> Result<Option<DrawnFrame>> {
        let scene = &*scene.in_world();
        let kept = self.kept.take_if(|kept| kept.is_of(scene, options));
        let (Some(kept), Some(images)) = (kept, self.cache.images.take()) else {
            return Ok(None);
        };
        // The caller may have ended it before it began; the frame is then as complete as it can be.
        let report = options.progress.as_mut().map(|report| &mut **report as _);
        let is_ended = Cell::new(false);
        let ends_early = options.keep_partial.then_some(&is_ended);
        let ended = ProgressReport::new(report, ends_early, 0, false, false).end();
        ended.inspect_err(|_| self.forget())?;
        Ok(Some(DrawnFrame {
            geometry: self.cache.scene.geometry().cloned(),
            images,
            space: LocalSpace::of(scene.bounding_box()),
            stats: kept.stats,
            description: self.describe(scene, options),
        }))
    }

    /// Describes the next frame, and counts it.
    fn describe(&mut self, scene: &Scene, options: &RenderOptions) -> FrameDescription {
        let index = options.frame_index.unwrap_or(self.next_frame_index);
        self.next_frame_index = self.next_frame_index.max(index.wrapping_add(1));
        FrameDescription {
            key: FrameKey {
                index,
                camera: options.camera_index,
                seed: options.seed,
            },
            ..FrameDescription::new(scene, scene.hash())
        }
    }

    /// Compiles what frames of the scene need and copies the scene to the device, so that the next frame does neither. Returns the time that
    /// it took, milliseconds.
    ///
    /// It draws a small frame, because the passes alone know what they need. With a distorted lens it draws a whole one: the rays of the lens
    /// belong to the size of the image.
    ///
    /// # Errors
    /// The same as for [`Renderer::render`].
    pub fn prepare(&mut self, scene: &Scene) -> Result<f64> {
        let start = Instant::now();
        let mut small = scene.clone();
        let camera = &scene.camera;
        if camera.distortion().is_none() {
            small.camera = camera.resized(camera.resolution_px.map(prepared_px));
        }
        // The same passes as in the frame, with the least work.
        if let Some(PixelSampling { samples, .. }) = &mut small.camera.pixel_sampling {
            *samples = (*samples).min(2);
        }
        if let Some(IndirectLight::FinalGather(gather)) = &mut small.indirect {
            gather.target_error = TARGET_ERRORS.most;
            gather.max_rays = Some(1);
        }
        // They belong to the frame before.
        let (images, last) = (std::mem::take(&mut self.cache.images), self.last.take());
        let kept = self.kept.take();
        let (next_frame_index, pace) = (self.next_frame_index, self.pace);
        let drawn = self.draw(&small, &mut RenderOptions::default(), Drawing::default());
        self.next_frame_index = next_frame_index;
        (self.last, self.pace) = (last, pace);
        drop(drawn?);
        (self.cache.images, self.kept) = (images, kept);
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }

    /// Predicts the GPU time of a frame of the scene from the last frame, milliseconds. `None` unless the last frame had the same number of
    /// triangles and lights and the same estimator. Accurate to a factor of 2 for up to four times the pixels and half the error.
    pub fn foretell_ms(&self, scene: &Scene) -> Option<f64> {
        self.last.as_ref()?.foretell_ms(scene)
    }

    /// Renders a frame whose images stay on the device, for a host that uses them there.
    ///
    /// # Errors
    /// The same as for [`Renderer::render`].
    pub fn render_on_device(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
    ) -> Result<DeviceFrame> {
        let timeline = match &self.timeline {
            Some(timeline) => timeline.clone(),
            None => Arc::new(Timeline::new(&self.device)?),
        };
        self.timeline = Some(timeline.clone());
        let drawing = Drawing {
            stays_on_device: true,
            ..Drawing::default()
        };
        let drawn = self.draw(scene, options, drawing)?;
        let ready_at = timeline.rise().inspect_err(|_| self.forget())?;
        Ok(DeviceFrame::new(&self.device, drawn, timeline, ready_at))
    }

    /// Draws a frame without reusing the last one, and calls `observe` for each light once its VPLs are listed.
    #[cfg(feature = "internals")]
    pub(crate) fn draw_observed(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        observe: &mut Observer,
    ) -> Result<DrawnFrame> {
        let drawing = Drawing {
            observe: Some(observe),
            ..Drawing::default()
        };
        self.draw(scene, options, drawing)
    }

    fn draw(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        drawing: Drawing,
    ) -> Result<DrawnFrame> {
        let drawn = self.try_to_draw(scene, options, drawing);
        // Copies that are still waiting are of no use.
        drawn.inspect_err(|_| {
            self.commands = CommandPool::new(&self.device);
            self.readback = Readback::new(&self.device).into();
        })
    }

    fn try_to_draw(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        drawing: Drawing,
    ) -> Result<DrawnFrame> {
        let Drawing {
            part,
            stays_on_device,
            observe,
        } = drawing;
        self.kept = None;
        let cost = RefCell::new(Cost::new(
            options.submission_target,
            &self.pipelines,
            self.pace,
        ));
        let scene = &*scene.in_world();
        self.device.check()?;
        let info = self.device.info();
        let mut plan = Plan::new(scene, info)?;
        if let Some(part) = part {
            plan.gather_part(part);
        }
        // The frame's description has the lights of the scene alone.
        let lit = &*scene.with_emissive_light();
        let mut gather = plan.indirect.as_mut().map(|indirect| &mut indirect.gather);
        if let (Some(GatherPlan::VplSum { kernel, .. }), Some(chosen)) =
            (&mut gather, options.gather_kernel)
        {
            *kernel = chosen.checked_for(info)?;
        }
        if let Some(chosen) = options.tracer {
            plan.trace_by(chosen, info)?;
        }
        let space = LocalSpace::of(scene.bounding_box());
        let recorded = RefCell::default();
        let rays = RefCell::new(self.rays.take());
        let ends_early = Cell::new(false);
        let modulation = modulation::upload(
            &self.device,
            lit,
            &space,
            [1.0; MAX_FREQUENCIES],
            [modulation::USUAL_TURNING_SHARE; MAX_FREQUENCIES],
        )?;
        let context = Context {
            device: &self.device,
            pipelines: &self.pipelines,
            commands: &self.commands,
            scene: lit,
            plan: &plan,
            space: &space,
            stays_on_device,
            layers: options.layers,
            seed: options.seed,
            modulation: modulation.as_ref(),
            cost: &cost,
            ends_early: &ends_early,
            rays: &rays,
            readback: &self.readback,
            recorded: &recorded,
        };
        let report = options.progress.as_mut().map(|report| &mut **report as _);
        let mut progress = ProgressReport::new(
            report,
            (options.keep_partial && plan.has_final_gather()).then_some(&ends_early),
            plan.lights.len(),
            plan.indirect.is_some(),
            plan.pixel_sampling.is_some(),
        );
        // An observer must see everything being made, so the cache is empty.
        let mut nothing = FrameCache::default();
        let cache = match observe {
            Some(_) => &mut nothing,
            None => &mut self.cache,
        };
        let missing = self.pipelines.missing(kernels::of_final_gather(&plan));
        let drawn = with_kernels(&self.pipelines, missing, || {
            frame::draw(&context, cache, &mut progress, observe)
        });
        let images = cache.images.take();
        let geometry = cache.scene.geometry().cloned();
        let (estimates, vpl_count) = drawn.inspect_err(|_| cache.clear())?;
        self.rays = rays.into_inner();
        let mut cost = cost.into_inner();
        cost.begin_step("layers", &self.pipelines);
        let images = images.ok_or_else(|| Error::internal("a frame without images"))?;
        let preparation = cost.making(&self.pipelines) + cost.copying;
        self.pace = cost.pace;
        let stats = FrameStats {
            device: info.name.clone(),
            driver: info.driver.clone(),
            passes: passes_of(cost.times()),
            host_steps: passes_of(cost.host()),
            vpl_count,
            pixel_vpl_pairs: cost.work_of("gather"),
            ray_count: cost.ray_count(),
            estimated_error: estimates.error,
            estimated_error_upper: estimates.error_upper,
            estimated_range_error_mm: estimates.range_errors_m.map(|[m, _]| 1e3 * m),
            estimated_range_error_upper_mm: estimates.range_errors_m.map(|[_, m]| 1e3 * m),
            stop: estimates.stop,
            least_rays: estimates.least.map(|(rays, _)| rays),
            least_milliseconds: estimates.least.map(|(_, milliseconds)| milliseconds),
            estimated_interpolation_error: estimates.interpolation_error,
            estimated_area_light_error: estimates.area_light_error,
            submissions: cost.submissions,
            wall_milliseconds: cost.wall().as_secs_f64() * 1e3,
            preparation_milliseconds: preparation.as_secs_f64() * 1e3,
        };
        self.last = Some(RenderedFrame::new(
            scene,
            &stats,
            cost.work_of(FIRST_ESTIMATE),
            cost.work_of(FURTHER_ESTIMATES),
        ));
        if let Some(pace) = &mut self.pace {
            pace.end_seconds = cost.seconds(&self.pipelines) - cost.gathered_at;
        }
        Ok(DrawnFrame {
            geometry: geometry.filter(|_| images.gbuffer.triangles.is_some()),
            images,
            space,
            stats,
            description: self.describe(scene, options),
        })
    }
}

/// How a frame is drawn, beside its options.
#[derive(Default)]
struct Drawing<'d, 'o> {
    /// `None`: all of it.
    part: Option<GatheredPart>,
    /// Its images are for a host that uses them on the device.
    stays_on_device: bool,
    observe: Option<&'d mut Observer<'o>>,
}

/// Draws while other threads make the pipelines of kernels.
fn with_kernels<T>(
    pipelines: &Pipelines,
    missing: Vec<Key>,
    draw: impl FnOnce() -> Result<T>,
) -> Result<T> {
    let threads = missing.len().min(thread_count().saturating_sub(1));
    let next = Mutex::new(missing.into_iter());
    let is_over = AtomicBool::new(false);
    let take = || match is_over.load(Ordering::Relaxed) {
        true => None,
        false => next.lock().map_or(None, |mut next| next.next()),
    };
    thread::scope(|scope| {
        let makers = (0..threads).map(|_| {
            let take = &take;
            scope.spawn(move || pipelines.make_ahead(iter::from_fn(take)))
        });
        let makers: Vec<_> = makers.collect();
        let drawn = draw();
        // What the frame did not need can wait.
        is_over.store(true, Ordering::Relaxed);
        let drawn = drawn?;
        for maker in makers {
            let panicked = |_| Error::internal("a thread that makes pipelines panicked");
            maker.join().map_err(panicked)??;
        }
        Ok(drawn)
    })
}

/// What the images of a frame depend on, and what they have cost.
struct KeptFrame {
    scene_hash: String,
    seed: u32,
    submission_target: Duration,
    gather_kernel: Option<GatherKernel>,
    tracer: Option<Tracer>,
    has_triangles: bool,
    stats: FrameStats,
}

impl KeptFrame {
    /// `None` if another attempt could do better.
    fn of(drawn: &DrawnFrame, options: &RenderOptions) -> Option<KeptFrame> {
        let indirect = drawn.description.indirect.as_ref();
        let gather = indirect.and_then(IndirectLight::gather);
        let has_time_limit = gather.is_some_and(|gather| gather.max_ms.is_some());
        let is_final = match drawn.stats.stop {
            Some(StopReason::Cancelled) => false,
            Some(StopReason::BudgetSpent) => !has_time_limit,
            None | Some(StopReason::TargetMet | StopReason::SamplesExhausted) => true,
        };
        is_final.then(|| KeptFrame {
            scene_hash: drawn.description.scene_hash.clone(),
            seed: options.seed,
            submission_target: options.submission_target,
            gather_kernel: options.gather_kernel,
            tracer: options.tracer,
            has_triangles: drawn.images.gbuffer.triangles.is_some(),
            stats: FrameStats {
                passes: Vec::new(),
                host_steps: Vec::new(),
                submissions: 0,
                preparation_milliseconds: 0.0,
                ..drawn.stats.clone()
            },
        })
    }

    fn is_of(&self, scene: &Scene, options: &RenderOptions) -> bool {
        self.scene_hash == scene.hash()
            && self.seed == options.seed
            && self.submission_target == options.submission_target
            && self.gather_kernel == options.gather_kernel
            && self.tracer == options.tracer
            && (self.has_triangles || !shows_triangles(options.layers))
    }
}

/// The total time of each pass or step, in the order of first appearance.
fn passes_of(times: &PassTimes) -> Vec<PassTime> {
    let mut passes: Vec<PassTime> = Vec::new();
    for &(name, milliseconds) in times {
        match passes.iter_mut().find(|pass| pass.name == name) {
            Some(pass) => pass.milliseconds += milliseconds,
            None => passes.push(PassTime { name, milliseconds }),
        }
    }
    passes
}
