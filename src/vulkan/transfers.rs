//! Copies and clears of a command buffer, and the image layouts that they need.

use ash::vk::{self, AccessFlags2 as Access, PipelineStageFlags2 as On};

use super::{
    Buffer, CommandPool, Device, Image, PixelKind, Recorder, SharedMemory,
    command_pool::UploadTarget, raster::cleared,
};
use crate::Result;

impl Recorder {
    /// Copies the waiting uploads. All later work can use them.
    pub(super) fn copy_uploads(&mut self) {
        for upload in self.home.take_uploads() {
            match &upload.to {
                UploadTarget::Buffer(to) => {
                    let bytes = upload.staging.bytes.min(to.bytes);
                    self.copy_buffer(&upload.staging, to, bytes);
                }
                UploadTarget::Image(to) => self.copy_to_image(&upload.staging, to),
            }
            self.uploads.push(upload);
        }
    }

    /// Transitions new images to the layout that they keep. Their contents are undefined.
    pub fn prepare_images(&mut self, images: &[&Image]) {
        for image in images {
            self.transition(image, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
            if self.device.faults().poisons_memory() && image.shape.pixel == PixelKind::Color {
                self.fill(image, f32::NAN);
            }
        }
    }

    /// Changes an image's layout, after all previous and before all later work.
    fn transition(&mut self, image: &Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        self.kept.push(image.keep());
        let barriers = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(On::ALL_COMMANDS)
            .src_access_mask(Access::MEMORY_WRITE)
            .dst_stage_mask(On::ALL_COMMANDS)
            .dst_access_mask(Access::MEMORY_READ | Access::MEMORY_WRITE)
            .old_layout(from)
            .new_layout(to)
            .image(image.handles().raw)
            .subresource_range(image.shape.range(0, image.shape.layer_count()))];
        self.pipeline_barrier(&vk::DependencyInfo::default().image_memory_barriers(&barriers));
    }

    /// Fills an image with a value, after all previous and before all later work.
    fn fill(&mut self, image: &Image, value: f32) {
        let color = vk::ClearColorValue {
            float32: [value; 4],
        };
        let all = [image.shape.range(0, image.shape.layer_count())];
        self.barrier();
        let (raw, layout) = (self.device.raw(), vk::ImageLayout::GENERAL);
        let image = image.handles().raw;
        // SAFETY: the command buffer is being recorded, and the image, which the transition has kept, is in this layout.
        unsafe { raw.cmd_clear_color_image(self.commands, image, layout, &color, &all) };
        self.barrier();
    }

    /// Sets every pixel of a new image to zero. It renders nothing to clear, because CPU drivers clear a rendering's images on all their threads.
    pub fn clear_image(&mut self, image: &Image) {
        self.prepare_images(&[image]);
        for &view in &image.handles().layer_views {
            let color = [cleared(view, [0.0; 4])];
            self.begin_rendering(image.shape.size_px, &color, None);
            self.end_rendering();
        }
    }

    /// Sets the first words of a buffer, after all previous work.
    pub fn fill_words(&mut self, buffer: &Buffer, count: u32, word: u32) {
        self.kept.push(buffer.keep());
        self.barrier();
        let (raw, bytes) = (self.device.raw(), 4 * u64::from(count.max(1)));
        // SAFETY: the command buffer is being recorded, and the buffer, which is kept, has as many words and is never empty.
        unsafe { raw.cmd_fill_buffer(self.commands, buffer.raw, 0, bytes, word) };
    }

    /// Overwrites a whole image with a buffer's first bytes and transitions it to its layout.
    pub fn copy_to_image(&mut self, from: &Buffer, to: &Image) {
        let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        self.transition(to, vk::ImageLayout::UNDEFINED, layout);
        self.copy_region(from, to, image_copy(to));
        self.transition(to, layout, vk::ImageLayout::GENERAL);
    }

    /// Copies a buffer's first bytes into a layer of an image. The layers must be filled in order, and only by this function.
    pub fn copy_to_layer(&mut self, from: &Buffer, to: &Image, layer: u32) {
        let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        if layer == 0 {
            self.transition(to, vk::ImageLayout::UNDEFINED, layout);
        }
        let mut region = image_copy(to);
        region.image_subresource.base_array_layer = layer;
        region.image_subresource.layer_count = 1;
        self.copy_region(from, to, region);
        if layer + 1 == to.shape.layer_count() {
            self.transition(to, layout, vk::ImageLayout::GENERAL);
        }
    }

    /// Copies a buffer's first bytes into a region of an image that is in the transfer layout.
    fn copy_region(&mut self, from: &Buffer, to: &Image, region: vk::BufferImageCopy) {
        self.kept.extend([from.keep(), to.keep()]);
        let (raw, layout) = (self.device.raw(), vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        let (from, to) = (from.raw, to.handles().raw);
        // SAFETY: the buffer holds the region's number of pixels, and both are kept.
        unsafe { raw.cmd_copy_buffer_to_image(self.commands, from, to, layout, &[region]) };
    }

    /// Copies the whole of an image to a buffer, from this byte on.
    pub fn copy_from_image(&mut self, from: &Image, to: &Buffer, first_byte: u64) {
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        self.transition(from, vk::ImageLayout::GENERAL, layout);
        self.kept.push(to.keep());
        let (raw, regions) = (
            self.device.raw(),
            [image_copy(from).buffer_offset(first_byte)],
        );
        let image = from.handles().raw;
        // SAFETY: the buffer was made for the image's pixels, and both are kept.
        unsafe { raw.cmd_copy_image_to_buffer(self.commands, image, layout, to.raw, &regions) };
        self.transition(from, layout, vk::ImageLayout::GENERAL);
    }

    /// Copies a whole image to shared memory that is large enough, and releases the memory to its importers.
    fn copy_to_shared(&mut self, from: &Image, to: &SharedMemory, offset_bytes: u64) {
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        self.transition(from, vk::ImageLayout::GENERAL, layout);
        let (raw, image) = (self.device.raw(), from.handles().raw);
        let regions = [image_copy(from).buffer_offset(offset_bytes)];
        // SAFETY: the pixels fit, and the image is kept; the caller keeps the memory and waits for the submission.
        unsafe {
            raw.cmd_copy_image_to_buffer(self.commands, image, layout, to.buffer(), &regions);
        };
        self.transition(from, layout, vk::ImageLayout::GENERAL);
        let handed_over = [vk::BufferMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .src_queue_family_index(self.device.queue_family())
            .dst_queue_family_index(vk::QUEUE_FAMILY_EXTERNAL)
            .buffer(to.buffer())
            .size(vk::WHOLE_SIZE)];
        let dependency = vk::DependencyInfo::default().buffer_memory_barriers(&handed_over);
        self.pipeline_barrier(&dependency);
    }

    /// Copies a whole image to one of the same shape.
    pub fn copy_image(&mut self, from: &Image, to: &Image) {
        let layout = vk::ImageLayout::GENERAL;
        let from_layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        let to_layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        self.transition(from, layout, from_layout);
        self.transition(to, layout, to_layout);
        let all = image_copy(from).image_subresource;
        let regions = [vk::ImageCopy::default()
            .src_subresource(all)
            .dst_subresource(all)
            .extent(from.shape.extent())];
        let (raw, source, target) = (self.device.raw(), from.handles().raw, to.handles().raw);
        // SAFETY: the images have the same shape and these layouts, and the transitions have kept both.
        unsafe {
            raw.cmd_copy_image(
                self.commands,
                source,
                from_layout,
                target,
                to_layout,
                &regions,
            )
        };
        self.transition(from, from_layout, layout);
        self.transition(to, to_layout, layout);
    }

    /// Copies the first `bytes` bytes of a buffer to the start of another.
    pub fn copy_buffer(&mut self, from: &Buffer, to: &Buffer, bytes: u64) {
        self.kept.extend([from.keep(), to.keep()]);
        let regions = [vk::BufferCopy::default().size(bytes)];
        let raw = self.device.raw();
        // SAFETY: both ranges are in their buffers, which are kept.
        unsafe { raw.cmd_copy_buffer(self.commands, from.raw, to.raw, &regions) };
    }
}

/// Copies a whole image to shared memory, and waits for the copy.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if it does not fit.
pub(crate) fn copy_to_shared(
    device: &Device,
    from: &Image,
    to: &SharedMemory,
    offset_bytes: u64,
) -> Result<()> {
    to.check(device, from, offset_bytes)?;
    let commands = CommandPool::new(device);
    let mut recorder = commands.begin()?;
    recorder.barrier();
    recorder.copy_to_shared(from, to, offset_bytes);
    recorder.submit()?;
    Ok(())
}

fn image_copy(image: &Image) -> vk::BufferImageCopy {
    let all = vk::ImageSubresourceLayers::default()
        .aspect_mask(image.shape.aspect())
        .layer_count(image.shape.layer_count());
    vk::BufferImageCopy::default()
        .image_subresource(all)
        .image_extent(image.shape.extent())
}
