//! Records one command buffer, submits it and waits for it.

use std::{mem::ManuallyDrop, slice, sync::Arc, time::Instant};

use ash::khr::acceleration_structure;
use ash::vk::{self, AccessFlags2 as Access, DescriptorType as Kind, PipelineStageFlags2 as On};
use bytemuck::Pod;

use super::{
    AccelerationStructure, Buffer, Device, Image,
    command_pool::{CommandBuffer, CommandPool, MAX_TIMED_PASSES, Upload},
    memory::Kept,
    pipeline::Pipeline,
    shaders::Binding,
};
use crate::{Error, Result};

/// GPU milliseconds of each pass, in recording order.
pub(crate) type PassTimes = Vec<(&'static str, f64)>;

/// Workgroups along an axis of a dispatch that every Vulkan device supports.
pub(crate) const MAX_GROUPS: u32 = 65_535;

/// Arranges workgroups in rows that every device supports. The last row may have surplus workgroups.
pub(crate) fn groups_in_rows(groups: u32) -> [u32; 3] {
    let per_row = groups.min(MAX_GROUPS);
    [per_row, groups.div_ceil(per_row.max(1)), 1]
}

/// The resource that a shader's binding is bound to.
#[derive(Clone, Copy)]
pub(crate) enum Resource<'r> {
    Buffer(&'r Buffer),
    Image(&'r Image),
    AccelerationStructure(&'r AccelerationStructure),
}

/// A command buffer while it is recorded. It keeps alive everything that it uses. Submitting waits for the device, so nothing is in use
/// afterwards.
pub(crate) struct Recorder {
    pub(super) device: Device,
    pub(super) home: CommandPool,
    pub(super) commands: vk::CommandBuffer,
    /// Given back on drop.
    buffer: ManuallyDrop<CommandBuffer>,
    /// All recorded passes; the first ones are timed.
    passes: Vec<&'static str>,
    /// Nanoseconds of a timestamp tick; `None` without timestamps.
    period_ns: Option<f32>,
    /// An injected fault: the last pass that runs before the device is lost.
    ends_in: Option<usize>,
    stage: Stage,
    /// Pipelines in use, each with its own descriptor set.
    bound: Vec<(Arc<Pipeline>, vk::DescriptorSet)>,
    /// The uploads copied to the device.
    pub(super) uploads: Vec<Upload>,
    /// Objects that its commands use.
    pub(super) kept: Vec<Kept>,
}

/// Progress of a command buffer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    Recorded,
    /// Submitted, not known to be complete.
    InFlight,
    Complete,
}

impl CommandPool {
    /// Begins a command buffer. It starts with the waiting uploads, and each pass starts with those added since.
    pub fn begin(&self) -> Result<Recorder> {
        let device = self.device();
        let buffer = self.take()?;
        let (commands, queries) = (buffer.raw, buffer.queries);
        // From here on, every early return gives everything back.
        let mut recorder = Recorder {
            device: device.clone(),
            home: self.clone(),
            commands,
            buffer: ManuallyDrop::new(buffer),
            passes: Vec::new(),
            period_ns: device.timestamp_period_ns(),
            ends_in: device.faults().next_submission_ends_in(),
            stage: Stage::Recorded,
            bound: Vec::new(),
            uploads: Vec::new(),
            kept: Vec::new(),
        };
        let begin = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer was made or reset just before, and the queries are its own.
        device.call("vkBeginCommandBuffer", |raw| unsafe {
            raw.begin_command_buffer(commands, &begin)?;
            raw.cmd_reset_query_pool(commands, queries, 0, 2 * MAX_TIMED_PASSES);
            Ok(())
        })?;
        recorder.copy_uploads();
        Ok(recorder)
    }
}

impl Recorder {
    /// Orders all work so far before all later work.
    pub fn barrier(&mut self) {
        let any = Access::MEMORY_READ | Access::MEMORY_WRITE;
        self.memory_barrier(
            (On::ALL_COMMANDS, Access::MEMORY_WRITE),
            (On::ALL_COMMANDS, any),
        );
    }

    fn memory_barrier(&mut self, from: (On, Access), to: (On, Access)) {
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(from.0)
            .src_access_mask(from.1)
            .dst_stage_mask(to.0)
            .dst_access_mask(to.1)];
        self.pipeline_barrier(&vk::DependencyInfo::default().memory_barriers(&barriers));
    }

    pub(super) fn pipeline_barrier(&self, dependency: &vk::DependencyInfo) {
        let raw = self.device.raw();
        // SAFETY: the command buffer is being recorded, and images are kept.
        unsafe { raw.cmd_pipeline_barrier2(self.commands, dependency) };
    }

    /// Whether another pass would still be timed.
    pub fn has_room(&self) -> bool {
        self.passes.len() < MAX_TIMED_PASSES as usize
    }

    /// Records a pass after all previous work, and times it under its name.
    pub fn pass(
        &mut self,
        name: &'static str,
        record: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        if self.ends_in.is_some_and(|last| self.passes.len() > last) {
            return Ok(());
        }
        if self.device.faults().ends_in(name) {
            self.ends_in = Some(self.passes.len());
        }
        self.copy_uploads();
        self.barrier();
        let query = 2 * self.passes.len() as u32;
        self.passes.push(name);
        self.note_begin();
        let is_timed = query < 2 * MAX_TIMED_PASSES && self.period_ns.is_some();
        if is_timed {
            self.timestamp(query);
        }
        record(self)?;
        if is_timed {
            self.timestamp(query + 1);
        }
        Ok(())
    }

    /// Makes the device report to the host that the last pass begins.
    fn note_begin(&mut self) {
        let count = self.passes.len() as u32;
        let begun = self.buffer.begun.raw;
        let raw = self.device.raw();
        // SAFETY: the command buffer is being recorded, and the buffer lives as long as this recorder.
        unsafe { raw.cmd_fill_buffer(self.commands, begun, 0, 4, count) };
        self.memory_barrier(
            (On::CLEAR, Access::TRANSFER_WRITE),
            (On::HOST, Access::HOST_READ),
        );
    }

    fn timestamp(&mut self, query: u32) {
        let queries = self.buffer.queries;
        let (raw, stage) = (self.device.raw(), On::ALL_COMMANDS);
        // SAFETY: the query is in the pool and was reset at the start of this command buffer.
        unsafe { raw.cmd_write_timestamp2(self.commands, stage, queries, query) };
        if self.device.info().quirks.timestamps_need_barriers {
            self.barrier();
        }
    }

    /// Runs `groups` workgroups. `resources` are matched by the names of the shader's bindings; this permutation ignores those that it
    /// does not have.
    pub fn dispatch<T: Pod>(
        &mut self,
        pipeline: &Arc<Pipeline>,
        resources: &[(&str, Resource)],
        immediate: &T,
        groups: [u32; 3],
    ) -> Result<()> {
        let [x, y, z] = groups;
        if x == 0 || y == 0 || z == 0 {
            return Ok(());
        }
        self.bind(vk::PipelineBindPoint::COMPUTE, pipeline, resources)?;
        self.push(pipeline, immediate);
        // SAFETY: pipeline and everything it reads are bound; the plan checked the limits.
        unsafe { self.device.raw().cmd_dispatch(self.commands, x, y, z) };
        Ok(())
    }

    /// Builds an acceleration structure. A barrier orders it after the work it depends on.
    pub(super) fn build(
        &mut self,
        functions: &acceleration_structure::Device,
        info: &vk::AccelerationStructureBuildGeometryInfoKHR,
        primitive_counts: &[u32],
    ) {
        let range = vk::AccelerationStructureBuildRangeInfoKHR::default();
        let ranges: Vec<_> = primitive_counts
            .iter()
            .map(|&count| range.primitive_count(count))
            .collect();
        // SAFETY: the command buffer is being recorded; everything in the info was made for this build and lives until the submission.
        unsafe {
            let infos = slice::from_ref(info);
            functions.cmd_build_acceleration_structures(self.commands, infos, &[&ranges]);
        }
    }

    pub(super) fn push<T: Pod>(&mut self, pipeline: &Pipeline, immediate: &T) {
        let bytes = bytemuck::bytes_of(immediate);
        let bytes = &bytes[..bytes.len().min(pipeline.immediate_bytes as usize)];
        if !bytes.is_empty() {
            let (raw, layout, stages) = (self.device.raw(), pipeline.layout, pipeline.stages);
            // SAFETY: the range is the pipeline layout's own.
            unsafe { raw.cmd_push_constants(self.commands, layout, stages, 0, bytes) };
        }
    }

    pub(super) fn bind(
        &mut self,
        point: vk::PipelineBindPoint,
        pipeline: &Arc<Pipeline>,
        resources: &[(&str, Resource)],
    ) -> Result<()> {
        let mut infos = Vec::with_capacity(pipeline.bindings.len());
        for Binding { name, kind, .. } in &pipeline.bindings {
            let fail = |what| {
                let pass = pipeline.module.name;
                Err(Error::internal(format!("{pass}: binding {name} {what}")))
            };
            let is_image = matches!(*kind, Kind::SAMPLED_IMAGE | Kind::STORAGE_IMAGE);
            let mut buffer_info = vk::DescriptorBufferInfo::default();
            let mut image_info = vk::DescriptorImageInfo::default();
            let mut structure = vk::AccelerationStructureKHR::null();
            match resources.iter().find(|(other, _)| other == name) {
                Some((_, Resource::AccelerationStructure(found)))
                    if *kind == Kind::ACCELERATION_STRUCTURE_KHR =>
                {
                    structure = found.raw();
                    self.kept.push(found.keep());
                }
                Some((_, Resource::Buffer(buffer)))
                    if matches!(*kind, Kind::UNIFORM_BUFFER | Kind::STORAGE_BUFFER) =>
                {
                    buffer_info = buffer_info.buffer(buffer.raw).range(vk::WHOLE_SIZE);
                    self.kept.push(buffer.keep());
                }
                Some((_, Resource::Image(image))) if is_image => {
                    let layout = vk::ImageLayout::GENERAL;
                    image_info = image_info.image_view(image.handles().view);
                    image_info = image_info.image_layout(layout);
                    self.kept.push(image.keep());
                }
                Some(_) => return fail("has a resource of the other kind"),
                None => return fail("has no resource"),
            }
            infos.push(([buffer_info], [image_info], [structure]));
        }
        let mut structures: Vec<_> = infos
            .iter()
            .map(|(_, _, structure)| {
                vk::WriteDescriptorSetAccelerationStructureKHR::default()
                    .acceleration_structures(structure)
            })
            .collect();
        let set = self.home.take_set(pipeline)?;
        self.bound.push((pipeline.clone(), set));
        let writes = pipeline.bindings.iter().zip(&infos).zip(&mut structures);
        let writes: Vec<_> = writes
            .map(|((binding, (buffer_info, image_info, _)), structure)| {
                // Vulkan reads only the field that matches the descriptor type.
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(set)
                    .dst_binding(binding.binding)
                    .descriptor_type(binding.kind)
                    .buffer_info(buffer_info)
                    .image_info(image_info);
                match binding.kind {
                    Kind::ACCELERATION_STRUCTURE_KHR => write.push_next(structure),
                    _ => write,
                }
            })
            .collect();
        let (raw, layout) = (self.device.raw(), pipeline.layout);
        // SAFETY: pipeline, layout and resources are kept, the writes match the layout, and no other
        // command buffer uses the set.
        unsafe {
            raw.update_descriptor_sets(&writes, &[]);
            raw.cmd_bind_pipeline(self.commands, point, pipeline.raw);
            raw.cmd_bind_descriptor_sets(self.commands, point, layout, 0, &[set], &[]);
        }
        Ok(())
    }

    /// Submits the work to the device and waits until it is done. The host can then read the results.
    pub fn submit(mut self) -> Result<PassTimes> {
        let start = Instant::now();
        let ticks = self.run().map_err(|error| match error {
            Error::DeviceLost { call, .. } => self.device.lose(call, self.last_begun()),
            other => other,
        })?;
        if let Some(last) = self.passes.last() {
            self.device.note_pass(last);
        }
        let names = self.passes.iter().copied();
        let Some(period_ns) = self.period_ns else {
            let share_ms = start.elapsed().as_secs_f64() * 1e3 / self.passes.len().max(1) as f64;
            return Ok(names.map(|name| (name, share_ms)).collect());
        };
        let milliseconds =
            |pair: &[u64]| pair[1].saturating_sub(pair[0]) as f64 * f64::from(period_ns) * 1e-6;
        Ok(names.zip(ticks.chunks_exact(2).map(milliseconds)).collect())
    }

    /// The last pass that has begun, as the device reported.
    fn last_begun(&self) -> Option<&'static str> {
        let begun = self.buffer.begun.mapped::<u32>(1).ok()?[0] as usize;
        self.passes.get(begun.checked_sub(1)?).copied()
    }

    /// Submits and waits. Returns the timestamps, two for each timed pass.
    fn run(&mut self) -> Result<Vec<u64>> {
        self.barrier();
        self.memory_barrier(
            (On::ALL_COMMANDS, Access::MEMORY_WRITE),
            (On::HOST, Access::HOST_READ),
        );
        let (device, fence, queries) = (&self.device, self.buffer.fence, self.buffer.queries);
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        // SAFETY: the command buffer is complete.
        device.call("vkEndCommandBuffer", |raw| unsafe {
            raw.end_command_buffer(self.commands)
        })?;
        // SAFETY: everything that the command buffer names is kept.
        device.call("vkQueueSubmit2", |raw| {
            device.with_queue(|queue| unsafe { raw.queue_submit2(queue, &submit, fence) })
        })?;
        self.stage = Stage::InFlight;
        // SAFETY: the fence was submitted.
        device.call("vkWaitForFences", |raw| {
            unsafe { raw.wait_for_fences(&[fence], true, u64::MAX) }?;
            match self.ends_in {
                None => Ok(()),
                Some(_) => Err(vk::Result::ERROR_DEVICE_LOST),
            }
        })?;
        self.stage = Stage::Complete;
        let timed = self.period_ns.map_or(0, |_| self.passes.len());
        let mut ticks = vec![0u64; 2 * timed.min(MAX_TIMED_PASSES as usize)];
        if !ticks.is_empty() {
            let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
            // SAFETY: the submission is complete, so the queries that it wrote are available.
            device.call("vkGetQueryPoolResults", |raw| unsafe {
                raw.get_query_pool_results(queries, 0, &mut ticks, flags)
            })?;
        }
        Ok(ticks)
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // SAFETY: it is not used again.
        let buffer = unsafe { ManuallyDrop::take(&mut self.buffer) };
        if self.stage == Stage::InFlight {
            let raw = self.device.raw();
            // The wait for the fence failed. The kept objects are freed next, so the device must be done with them.
            // SAFETY: nobody submits meanwhile. If this fails too, the device is lost.
            let _ = self
                .device
                .with_queue(|_| unsafe { raw.device_wait_idle() });
        } else {
            self.home.give_back(buffer);
        }
        if self.stage == Stage::Recorded {
            // The next command buffer makes the copies that were not made.
            for upload in self.uploads.drain(..) {
                self.home.wait_for_next(upload);
            }
        }
        for (pipeline, set) in self.bound.drain(..) {
            self.home.give_set_back(pipeline, set);
        }
    }
}
