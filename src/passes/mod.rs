//! The passes of a frame: one file each, named like its shader and its timestamp. `frame` puts them in order.

use std::cell::{Cell, RefCell};

use bytemuck::Pod;

use crate::{
    LocalSpace, Plan, Result, Scene,
    output::Layer,
    scene::MAX_FREQUENCIES,
    vulkan::{
        Buffer, CommandPool, Device, Image, Pipelines, Readback, Recorder, Resource,
        groups_in_rows, shaders::Key,
    },
};

use cost::{Cost, WorkKind};
use trace::RayList;

pub(crate) mod area_light;
pub(crate) mod compact;
pub(crate) mod cost;
pub(crate) mod direct;
pub(crate) mod error_estimate;
pub(crate) mod final_gather;
pub(crate) mod gather;
pub(crate) mod gatherer;
pub(crate) mod gbuffer;
pub(crate) mod hits;
pub(crate) mod instances;
pub(crate) mod kernels;
pub(crate) mod light;
mod light_paths;
mod light_rays;
pub(crate) mod materials;
pub(crate) mod modulation;
mod packets;
pub(crate) mod pixel_filter;
pub(crate) mod predict;
pub(crate) mod primary_rays;
pub(crate) mod random;
pub(crate) mod range_weights;
pub(crate) mod ray_table;
pub(crate) mod rays;
pub(crate) mod receivers;
pub(crate) mod refinement;
pub(crate) mod resolve;
pub(crate) mod rsm;
pub(crate) mod sample_counts;
pub(crate) mod scatter;
pub(crate) mod sensor;
pub(crate) mod shadow;
pub(crate) mod smooth;
pub(crate) mod smooth_residuals;
pub(crate) mod stderr;
pub(crate) mod surface;
pub(crate) mod textures;
pub(crate) mod trace;
pub(crate) mod unoccluded;
pub(crate) mod view;
pub(crate) mod vpl;
pub(crate) mod vpl_sampler;

/// What all passes of a frame share.
#[derive(Clone, Copy)]
pub(crate) struct Context<'c> {
    pub device: &'c Device,
    pub pipelines: &'c Pipelines,
    pub commands: &'c CommandPool,
    pub scene: &'c Scene,
    pub plan: &'c Plan,
    pub space: &'c LocalSpace,
    /// The images stay on the device, for a host that uses them there.
    pub stays_on_device: bool,
    /// The layers that the host reads; `None`: all.
    pub layers: Option<&'c [Layer]>,
    /// Another seed gives other samples.
    pub seed: u32,
    /// Only with time of flight.
    pub modulation: Option<&'c Buffer>,
    pub cost: &'c RefCell<Cost>,
    /// Whether the frame is to end with what it has.
    pub ends_early: &'c Cell<bool>,
    /// The rays in memory; `None` if nothing casts rays.
    pub rays: &'c RefCell<Option<RayList>>,
    /// What passes hand to the host.
    pub readback: &'c RefCell<Readback>,
    /// Passes that are recorded but not yet submitted.
    pub recorded: &'c RefCell<Option<Recorder>>,
}

impl Context<'_> {
    /// Records passes for the next submission. If the command buffer has as many passes as it can time, it is submitted first.
    pub fn record(&self, record: impl FnOnce(&mut Recorder) -> Result<()>) -> Result<()> {
        let is_full = |recorder: &Recorder| !recorder.has_room();
        if self.recorded.borrow().as_ref().is_some_and(is_full) {
            self.finish()?;
        }
        let mut recorded = self.recorded.borrow_mut();
        let recorder = match recorded.take() {
            Some(recorder) => recorder,
            None => self.commands.begin()?,
        };
        record(recorded.insert(recorder))
    }

    /// Records passes, submits them with what was recorded before, and waits. The host can then read what they wrote.
    pub fn submit(&self, record: impl FnOnce(&mut Recorder) -> Result<()>) -> Result<()> {
        self.record(record)?;
        self.finish()
    }

    /// Begins work whose speed is measured.
    pub fn begin_work(&self, kind: WorkKind) -> Result<()> {
        if self.cost.borrow().has_other_work(kind) {
            self.finish()?;
        }
        self.cost.borrow_mut().begin_work(kind, self.pipelines);
        Ok(())
    }

    /// Work of this kind that fits into the submission that is being recorded. `as u32` saturates it.
    pub fn room_for(&self, kind: WorkKind) -> f64 {
        self.cost.borrow().room_for(kind)
    }

    /// Counts work that was recorded, and work of other passes along with it. Submits it if the submission is full.
    pub fn add_work(&self, kind: WorkKind, amount: u64, along: u64) -> Result<()> {
        let is_full = self.cost.borrow_mut().add_work(kind, amount, along);
        if is_full { self.finish() } else { Ok(()) }
    }

    /// Begins a step of the host's work, for the statistics.
    pub fn begin_step(&self, name: &'static str) {
        self.cost.borrow_mut().begin_step(name, self.pipelines);
    }

    /// Submits what was recorded and waits.
    pub fn finish(&self) -> Result<()> {
        match self.recorded.take() {
            Some(recorder) => self.cost.borrow_mut().submit(recorder, self.pipelines),
            None => Ok(()),
        }
    }

    /// Records a pass.
    pub fn pass(
        &self,
        name: &'static str,
        record: impl FnOnce(&mut Recorder) -> Result<()>,
    ) -> Result<()> {
        self.record(|recorder| recorder.pass(name, record))
    }

    /// Transitions new images to the layout that they keep. Their contents are undefined.
    pub fn prepare_images(&self, images: &[&Image]) -> Result<()> {
        self.record(|recorder| {
            recorder.prepare_images(images);
            Ok(())
        })
    }

    /// Records a pass of one kernel, with one invocation per item, or per pixel of an image.
    pub fn dispatch<T: Pod>(
        &self,
        key: Key,
        resources: &[(&str, Resource)],
        parameters: &T,
        [columns, rows]: [u32; 2],
    ) -> Result<()> {
        if rows > 1 {
            return self.dispatch_image(key, resources, parameters, [columns, rows]);
        }
        let [x, ..] = key.module().workgroup_size;
        let groups = groups_in_rows(columns.div_ceil(x));
        self.dispatch_groups(key, resources, parameters, groups)
    }

    /// The same for an image of any size.
    pub fn dispatch_image<T: Pod>(
        &self,
        key: Key,
        resources: &[(&str, Resource)],
        parameters: &T,
        [columns, rows]: [u32; 2],
    ) -> Result<()> {
        let [x, y, _] = key.module().workgroup_size;
        let groups = [columns.div_ceil(x), rows.div_ceil(y), 1];
        self.dispatch_groups(key, resources, parameters, groups)
    }

    /// The same for so many workgroups.
    pub fn dispatch_groups<T: Pod>(
        &self,
        key: Key,
        resources: &[(&str, Resource)],
        parameters: &T,
        groups: [u32; 3],
    ) -> Result<()> {
        let pipeline = self.pipelines.compute(key)?;
        self.pass(key.pass(), |recorder| {
            recorder.dispatch(&pipeline, resources, parameters, groups)
        })
    }

    /// Divides the rows of the image so that the pixels of each part have a ray in memory: the first row, and the one after the last.
    pub fn row_ranges(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let [width, height] = self.plan.resolution_px;
        let rows = (self.plan.rays_at_once / width).max(1);
        let starts = (0..height).step_by(rows as usize);
        starts.map(move |first| [first, height.min(first + rows)])
    }

    /// The modulation, for kernels with phasors.
    pub fn modulation(&self) -> Option<(&'static str, Resource<'_>)> {
        let buffer = self.modulation?;
        Some(("modulation", Resource::Buffer(buffer)))
    }

    /// C, local: the camera's position. For parallel rays a point behind it, so far away that a direction from the scene to it is exactly
    /// theirs, and its distance differs from that to the local origin by as much as that to the plane where they start.
    pub fn camera_position(&self) -> [f32; 3] {
        const FAR: f32 = (1 << 30) as f32;
        let camera = &self.scene.camera;
        match camera.is_orthographic() {
            true => (-FAR * camera.basis().forward.as_vec3()).to_array(),
            false => self.space.to_local(camera.position_m),
        }
    }

    /// How long the ray to the local origin is, in turns of each time-of-flight frequency.
    pub fn camera_turns(&self) -> [f32; MAX_FREQUENCIES] {
        let camera = &self.scene.camera;
        let range_m = camera.range_to(self.space.origin_m - camera.position_m);
        modulation::turns_of(self.scene, range_m)
    }
}
