//! The way of a command buffer through the device, and what is known of it where the device is lost.

use ash::vk;

use super::Recorder;
use crate::{Error, Result};

/// GPU milliseconds of each pass, in the order of recording.
pub(crate) type PassTimes = Vec<(&'static str, f64)>;

impl Recorder<'_> {
    /// Lets the device tell the host that the last pass begins.
    pub(super) fn note_begin(&mut self) {
        let Some(begun) = &self.begun else {
            return;
        };
        let to_host = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::CLEAR)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&to_host);
        let raw = self.device.raw();
        let count = self.passes.len() as u32;
        // SAFETY: the command buffer is being recorded, and the buffer lives as long as this.
        unsafe {
            raw.cmd_fill_buffer(self.commands, begun.raw, 0, 4, count);
            raw.cmd_pipeline_barrier2(self.commands, &dependency);
        }
    }

    /// What the device has told of it.
    fn last_begun(&self) -> Option<&'static str> {
        let begun = self.begun.as_ref()?.mapped::<u32>(1).ok()?[0] as usize;
        self.passes.get(begun.checked_sub(1)?).copied()
    }

    /// Hands the work to the device and waits until it is done. What was written can then be read by the host.
    pub fn submit(mut self) -> Result<PassTimes> {
        let ticks = self.run().map_err(|error| match error {
            Error::DeviceLost { call, .. } => self.device.lose(call, self.last_begun()),
            other => other,
        })?;
        if let Some(last) = self.passes.last() {
            self.device.note_pass(last);
        }
        let period_ms = f64::from(self.device.info().limits.timestamp_period_ns) * 1e-6;
        let milliseconds = |pair: &[u64]| pair[1].saturating_sub(pair[0]) as f64 * period_ms;
        Ok(self
            .passes
            .iter()
            .copied()
            .zip(ticks.chunks_exact(2).map(milliseconds))
            .collect())
    }

    /// The timestamps: two of each pass that has them.
    fn run(&mut self) -> Result<Vec<u64>> {
        self.barrier();
        let host = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&host);
        let device = self.device.clone();
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&commands)];
        // SAFETY: the command buffer is being recorded.
        unsafe {
            device
                .raw()
                .cmd_pipeline_barrier2(self.commands, &dependency);
        }
        // SAFETY: the command buffer is complete.
        device.call("vkEndCommandBuffer", |raw| unsafe {
            raw.end_command_buffer(self.commands)
        })?;
        // SAFETY: everything that the command buffer names is alive for `'r`.
        device.call("vkQueueSubmit2", |raw| unsafe {
            raw.queue_submit2(device.queue().raw(), &submit, self.fence)
        })?;
        self.is_in_flight = true;
        // SAFETY: the fence was submitted.
        let waited = device.call("vkWaitForFences", |raw| {
            unsafe { raw.wait_for_fences(&[self.fence], true, u64::MAX) }?;
            match self.ends_in {
                None => Ok(()),
                Some(_) => Err(vk::Result::ERROR_DEVICE_LOST),
            }
        });
        waited?;
        self.is_in_flight = false;
        let timed = (2 * self.passes.len()).min(self.query_capacity as usize);
        let mut ticks = vec![0u64; timed];
        if !ticks.is_empty() {
            // SAFETY: the submission is complete, so the queries that it wrote are available.
            device.call("vkGetQueryPoolResults", |raw| unsafe {
                raw.get_query_pool_results(
                    self.queries,
                    0,
                    &mut ticks,
                    vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
                )
            })?;
        }
        Ok(ticks)
    }
}

impl Drop for Recorder<'_> {
    fn drop(&mut self) {
        let raw = self.device.raw();
        if self.is_in_flight {
            // The wait for the fence failed. Whoever owns the resources frees them next, so the device must be done.
            let _queue = self.device.queue();
            // SAFETY: the lock keeps other threads from submitting meanwhile. Where this fails too, the device is lost.
            let _ = unsafe { raw.device_wait_idle() };
        }
        // SAFETY: the work was never submitted, or is complete, or the device is lost; null handles are ignored.
        unsafe {
            raw.destroy_query_pool(self.queries, None);
            raw.destroy_fence(self.fence, None);
            raw.destroy_command_pool(self.pool, None);
        }
    }
}
