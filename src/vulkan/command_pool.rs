//! The parts of a command buffer, which are reused by the next one, and the uploads that the next one copies to the device first.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex},
};

use ash::vk;
use bytemuck::Pod;

use super::{Buffer, BufferUse, Device, Image, lock, pipeline::Pipeline};
use crate::Result;

/// Passes of a command buffer that get timestamps. Further passes run untimed.
pub(super) const MAX_TIMED_PASSES: u32 = 128;

/// The command buffers of one thread, used one after the other. Clones share them.
#[derive(Clone)]
pub(crate) struct CommandPool {
    shared: Arc<Shared>,
}

struct Shared {
    device: Device,
    idle: Mutex<Vec<CommandBuffer>>,
    /// Unused descriptor sets of each pipeline. Other threads have their own: a version of the validation layer (1.3.239) mistakes a set that
    /// another thread writes for one that refers to what this thread destroys.
    sets: Mutex<HashMap<vk::Pipeline, FreeSets>>,
    uploads: Mutex<Vec<Upload>>,
}

/// Descriptor sets that no command buffer uses.
struct FreeSets {
    pipeline: Arc<Pipeline>,
    sets: Vec<vk::DescriptorSet>,
}

/// Host values on their way to the device.
pub(super) struct Upload {
    pub staging: Buffer,
    pub to: UploadTarget,
}

pub(super) enum UploadTarget {
    Buffer(Arc<Buffer>),
    /// A new image, whose contents are undefined before.
    Image(Arc<Image>),
}

impl CommandPool {
    pub fn new(device: &Device) -> CommandPool {
        CommandPool {
            shared: Arc::new(Shared {
                device: device.clone(),
                idle: Mutex::default(),
                sets: Mutex::default(),
                uploads: Mutex::default(),
            }),
        }
    }

    pub fn device(&self) -> &Device {
        &self.shared.device
    }

    /// A command buffer without commands.
    pub(super) fn take(&self) -> Result<CommandBuffer> {
        let idle = lock(&self.shared.idle).pop();
        match idle {
            Some(mut commands) => {
                commands.reset()?;
                Ok(commands)
            }
            None => CommandBuffer::new(&self.shared.device),
        }
    }

    /// An unused descriptor set. Repeated calls get the same one if it was given back.
    pub(super) fn take_set(&self, pipeline: &Pipeline) -> Result<vk::DescriptorSet> {
        let mut free = lock(&self.shared.sets);
        let free = free.get_mut(&pipeline.raw).map(|free| &mut free.sets);
        free.and_then(Vec::pop)
            .map_or_else(|| pipeline.take_set(), Ok)
    }

    /// Returns a set whose command buffer is done.
    pub(super) fn give_set_back(&self, pipeline: Arc<Pipeline>, set: vk::DescriptorSet) {
        let mut free = lock(&self.shared.sets);
        let of_pipeline = free.entry(pipeline.raw);
        let sets = Vec::new();
        of_pipeline
            .or_insert(FreeSets { pipeline, sets })
            .sets
            .push(set);
    }

    pub(super) fn take_uploads(&self) -> Vec<Upload> {
        std::mem::take(&mut *lock(&self.shared.uploads))
    }

    /// A buffer in the device's own memory, which the next command buffer fills.
    pub fn upload<T: Pod>(&self, what: &str, values: &[T]) -> Result<Arc<Buffer>> {
        let bytes = size_of_val(values) as u64;
        let buffer = Arc::new(Buffer::new(self.device(), what, bytes, BufferUse::Device)?);
        self.upload_to(UploadTarget::Buffer(buffer.clone()), what, values)?;
        Ok(buffer)
    }

    /// Fills a new image in the next command buffer.
    pub fn upload_image<T: Pod>(&self, what: &str, texels: &[T], image: &Arc<Image>) -> Result<()> {
        self.upload_to(UploadTarget::Image(image.clone()), what, texels)
    }

    fn upload_to<T: Pod>(&self, to: UploadTarget, what: &str, values: &[T]) -> Result<()> {
        let staging = Buffer::filled(self.device(), what, values, BufferUse::Staging)?;
        self.wait_for_next(Upload { staging, to });
        Ok(())
    }

    pub(super) fn wait_for_next(&self, upload: Upload) {
        lock(&self.shared.uploads).push(upload);
    }

    /// Returns a command buffer for reuse.
    pub(super) fn give_back(&self, commands: CommandBuffer) {
        lock(&self.shared.idle).push(commands);
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        for free in lock(&self.sets).values_mut() {
            free.pipeline.give_sets_back(&mut free.sets);
        }
    }
}

/// A command buffer, and the objects that report its progress.
pub(super) struct CommandBuffer {
    device: Device,
    pool: vk::CommandPool,
    pub raw: vk::CommandBuffer,
    pub fence: vk::Fence,
    /// Two queries for each timed pass.
    pub queries: vk::QueryPool,
    /// Number of passes that have begun. The device writes it, so that the host can read it after a device loss.
    pub begun: Buffer,
}

impl CommandBuffer {
    fn new(device: &Device) -> Result<CommandBuffer> {
        // From here on, every early return destroys what was made.
        let mut made = CommandBuffer {
            device: device.clone(),
            pool: vk::CommandPool::null(),
            raw: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            queries: vk::QueryPool::null(),
            begun: Buffer::filled(device, "passes begun", &[0u32], BufferUse::Readback)?,
        };
        let pool = vk::CommandPoolCreateInfo::default()
            .queue_family_index(device.queue_family())
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY (all calls below): the device is live, and what they take was made from it just before.
        made.pool = device.call("vkCreateCommandPool", |raw| unsafe {
            raw.create_command_pool(&pool, None)
        })?;
        let allocate = vk::CommandBufferAllocateInfo::default()
            .command_pool(made.pool)
            .command_buffer_count(1);
        // SAFETY: as above.
        let buffers = device.call("vkAllocateCommandBuffers", |raw| unsafe {
            raw.allocate_command_buffers(&allocate)
        })?;
        made.raw = buffers[0];
        // SAFETY: as above.
        made.fence = device.call("vkCreateFence", |raw| unsafe {
            raw.create_fence(&vk::FenceCreateInfo::default(), None)
        })?;
        let queries = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(2 * MAX_TIMED_PASSES);
        // SAFETY: as above.
        made.queries = device.call("vkCreateQueryPool", |raw| unsafe {
            raw.create_query_pool(&queries, None)
        })?;
        Ok(made)
    }

    /// Resets the recorded commands and the state of completion.
    fn reset(&mut self) -> Result<()> {
        self.begun.write(&[0u32])?;
        let flags = vk::CommandPoolResetFlags::empty();
        // SAFETY (both calls): the device is live, and its work on this is done.
        self.device.call("vkResetCommandPool", |raw| unsafe {
            raw.reset_command_pool(self.pool, flags)
        })?;
        // SAFETY: as above.
        self.device.call("vkResetFences", |raw| unsafe {
            raw.reset_fences(&[self.fence])
        })
    }
}

impl Drop for CommandBuffer {
    fn drop(&mut self) {
        let raw = self.device.raw();
        // SAFETY: the work was never submitted, or is complete, or the device is lost; null handles are ignored.
        unsafe {
            raw.destroy_query_pool(self.queries, None);
            raw.destroy_fence(self.fence, None);
            raw.destroy_command_pool(self.pool, None);
        }
    }
}
