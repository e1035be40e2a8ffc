//! One command buffer: recorded, submitted, waited for.

mod submission;

use std::{any::Any, marker::PhantomData, sync::Arc};

use ash::vk;

use super::{
    Buffer, BufferUse, ComputePipeline, Device, Image, RasterPipeline,
    pipeline::Parts,
    shaders::{BindingKind, Plain, bytes_of},
};
use crate::{Error, Result};

pub(crate) use submission::PassTimes;

/// Workgroups along an axis of a dispatch that every Vulkan device takes.
pub(crate) const MAX_GROUPS: u32 = 65_535;

/// So many workgroups, in rows that every device takes; the last row may have more than there are.
pub(crate) fn groups_in_rows(groups: u32) -> [u32; 3] {
    let per_row = groups.min(MAX_GROUPS);
    [per_row, groups.div_ceil(per_row.max(1)), 1]
}

/// What a shader's binding is bound to.
#[derive(Clone, Copy)]
pub(crate) enum Resource<'r> {
    Buffer(&'r Buffer),
    Image(&'r Image),
}

/// What a draw writes to.
pub(crate) struct Target<'t, 'r> {
    pub colors: &'t [&'r Image],
    /// Scratch, without layers.
    pub depth: &'r Image,
    /// Layer of the colour images.
    pub layer: u32,
    /// What the pixels without a surface hold, per colour image.
    pub clear: &'t [[f32; 4]],
}

/// A command buffer while it is recorded. Everything that it names must live until it was submitted (`'r`); submitting
/// waits for the device, so nothing is in use afterwards.
pub(crate) struct Recorder<'r> {
    device: Device,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    queries: vk::QueryPool,
    query_capacity: u32,
    /// All that were recorded; the first of them are timed.
    passes: Vec<&'static str>,
    /// How many of the passes have begun: written by the device, so that it can be read when that is lost.
    begun: Option<Buffer>,
    /// A fault asked for: the last pass that runs before the device is lost.
    ends_in: Option<usize>,
    /// Submitted, and not known to be complete.
    is_in_flight: bool,
    /// Pipelines in use.
    pipelines: Vec<Arc<dyn Any + Send + Sync>>,
    resources: PhantomData<&'r ()>,
}

impl<'r> Recorder<'r> {
    /// A command buffer in which up to `pass_capacity` passes are timed; further ones run untimed.
    pub fn new(device: &Device, pass_capacity: u32) -> Result<Self> {
        // From here on what was made is destroyed on every way out.
        let mut recorder = Recorder {
            device: device.clone(),
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            queries: vk::QueryPool::null(),
            query_capacity: 2 * pass_capacity.max(1),
            passes: Vec::new(),
            begun: None,
            ends_in: device.faults().next_submission_ends_in(),
            is_in_flight: false,
            pipelines: Vec::new(),
            resources: PhantomData,
        };
        let pool = vk::CommandPoolCreateInfo::default()
            .queue_family_index(device.queue_family())
            .flags(vk::CommandPoolCreateFlags::TRANSIENT);
        // SAFETY (all calls below): the device is live, and what they take was made from it just before.
        recorder.pool = device.call("vkCreateCommandPool", |raw| unsafe {
            raw.create_command_pool(&pool, None)
        })?;
        let allocate = vk::CommandBufferAllocateInfo::default()
            .command_pool(recorder.pool)
            .command_buffer_count(1);
        // SAFETY: as above.
        let buffers = device.call("vkAllocateCommandBuffers", |raw| unsafe {
            raw.allocate_command_buffers(&allocate)
        })?;
        recorder.commands = buffers.first().copied().unwrap_or_default();
        // SAFETY: as above.
        recorder.fence = device.call("vkCreateFence", |raw| unsafe {
            raw.create_fence(&vk::FenceCreateInfo::default(), None)
        })?;
        let queries = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::TIMESTAMP)
            .query_count(recorder.query_capacity);
        // SAFETY: as above.
        recorder.queries = device.call("vkCreateQueryPool", |raw| unsafe {
            raw.create_query_pool(&queries, None)
        })?;
        let mut begun = Buffer::new(device, "passes begun", 4, BufferUse::Readback)?;
        begun.fill(&[0u32])?;
        recorder.begun = Some(begun);
        let begin = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: as above.
        device.call("vkBeginCommandBuffer", |raw| unsafe {
            raw.begin_command_buffer(recorder.commands, &begin)
        })?;
        // SAFETY: as above.
        unsafe {
            device.raw().cmd_reset_query_pool(
                recorder.commands,
                recorder.queries,
                0,
                recorder.query_capacity,
            );
        }
        Ok(recorder)
    }

    /// Brings new images into the layout that they keep. Their contents are undefined.
    pub fn prepare_images(&mut self, images: &[&'r Image]) {
        for image in images {
            self.transition(image, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
        }
    }

    /// Changes an image's layout, after all work before and ahead of all work behind.
    fn transition(&mut self, image: &'r Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let barriers = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(all)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(all)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(from)
            .new_layout(to)
            .image(image.raw)
            .subresource_range(whole(image))];
        let dependency = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        // SAFETY: the command buffer is being recorded and the image lives until it was submitted.
        unsafe {
            self.device
                .raw()
                .cmd_pipeline_barrier2(self.commands, &dependency);
        }
    }

    /// Sets every pixel to zero. By rendering nothing, for CPU drivers clear for a rendering on all their threads.
    pub fn clear_image(&mut self, image: &'r Image) {
        for &view in &image.layer_views {
            let color = [cleared(view, [0.0; 4])];
            self.begin_rendering(image.shape.size_px, &color, None);
            self.end_rendering();
        }
    }

    /// All work so far comes before all work from here on.
    pub fn barrier(&mut self) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(all)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(all)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barriers);
        // SAFETY: the command buffer is being recorded.
        unsafe {
            self.device
                .raw()
                .cmd_pipeline_barrier2(self.commands, &dependency);
        }
    }

    /// Records a pass: after what came before it, timed under its name.
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
        self.barrier();
        let query = 2 * self.passes.len() as u32;
        self.passes.push(name);
        self.note_begin();
        let is_timed = query < self.query_capacity;
        if is_timed {
            self.timestamp(query);
        }
        record(self)?;
        if is_timed {
            self.timestamp(query + 1);
        }
        Ok(())
    }

    fn timestamp(&mut self, query: u32) {
        // SAFETY: the query lies in the pool and was reset at the start of this command buffer.
        unsafe {
            self.device.raw().cmd_write_timestamp2(
                self.commands,
                vk::PipelineStageFlags2::ALL_COMMANDS,
                self.queries,
                query,
            );
        }
        // lavapipe takes the time when it next flushes, which a barrier makes it do.
        self.barrier();
    }

    /// Runs `groups` workgroups. `resources` are taken by the names of the shader's bindings; those that this
    /// permutation does not have are left out.
    pub fn dispatch<T: Plain>(
        &mut self,
        pipeline: &Arc<ComputePipeline>,
        resources: &[(&str, Resource<'r>)],
        immediate: &T,
        groups: [u32; 3],
    ) -> Result<()> {
        let [x, y, z] = groups;
        if x == 0 || y == 0 || z == 0 {
            return Ok(());
        }
        let point = vk::PipelineBindPoint::COMPUTE;
        self.pipelines.push(pipeline.clone());
        self.bind(point, &pipeline.parts, resources)?;
        self.push(&pipeline.parts, immediate);
        // SAFETY: pipeline and everything it reads are bound; the limits were checked by the plan.
        unsafe { self.device.raw().cmd_dispatch(self.commands, x, y, z) };
        Ok(())
    }

    /// Clears the target and draws into it what `record` draws.
    pub fn render(
        &mut self,
        target: &Target<'_, 'r>,
        record: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        // The rendering before may have used the same depth image.
        self.barrier();
        let [width, height] = target.depth.shape.size_px;
        let colors: Vec<_> = target
            .colors
            .iter()
            .zip(target.clear)
            .map(|(image, &clear)| cleared(image.layer_views[target.layer as usize], clear))
            .collect();
        // Reversed depth: 0 is infinitely far.
        let depth = cleared(target.depth.view, [0.0; 4]);
        self.begin_rendering([width, height], &colors, Some(&depth));
        let viewport = vk::Viewport {
            width: width as f32,
            height: height as f32,
            max_depth: 1.0,
            ..vk::Viewport::default()
        };
        let raw = self.device.raw();
        // SAFETY: the command buffer is being recorded.
        unsafe {
            raw.cmd_set_viewport(self.commands, 0, &[viewport]);
            raw.cmd_set_scissor(self.commands, 0, &[area([width, height])]);
        }
        let result = record(self);
        self.end_rendering();
        result
    }

    fn begin_rendering(
        &mut self,
        size_px: [u32; 2],
        colors: &[vk::RenderingAttachmentInfo],
        depth: Option<&vk::RenderingAttachmentInfo>,
    ) {
        let mut rendering = vk::RenderingInfo::default()
            .render_area(area(size_px))
            .layer_count(1)
            .color_attachments(colors);
        if let Some(depth) = depth {
            rendering = rendering.depth_attachment(depth);
        }
        // SAFETY: the command buffer is being recorded and the images live until it was submitted.
        unsafe {
            self.device
                .raw()
                .cmd_begin_rendering(self.commands, &rendering);
        }
    }

    fn end_rendering(&mut self) {
        // SAFETY: rendering was begun.
        unsafe { self.device.raw().cmd_end_rendering(self.commands) };
    }

    /// Binds a raster pipeline and its resources for the draws that follow.
    pub fn bind_raster(
        &mut self,
        pipeline: &Arc<RasterPipeline>,
        resources: &[(&str, Resource<'r>)],
    ) -> Result<()> {
        self.pipelines.push(pipeline.clone());
        self.bind(vk::PipelineBindPoint::GRAPHICS, &pipeline.parts, resources)
    }

    /// Draws triangles of the bound index buffer, three corners each.
    pub fn draw<T: Plain>(
        &mut self,
        pipeline: &RasterPipeline,
        immediate: &T,
        first_triangle: u32,
        triangle_count: u32,
    ) {
        self.push(&pipeline.parts, immediate);
        // SAFETY: called between `bind_raster` and the end of the rendering.
        unsafe {
            self.device
                .raw()
                .cmd_draw(self.commands, 3 * triangle_count, 1, 3 * first_triangle, 0);
        }
    }

    /// Copies a buffer's first bytes into the whole of a new image and brings that into its layout.
    pub fn copy_to_image(&mut self, from: &'r Buffer, to: &'r Image) {
        let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        self.transition(to, vk::ImageLayout::UNDEFINED, layout);
        // SAFETY: the buffer holds as many pixels as the image, both live until the submission.
        unsafe {
            self.device.raw().cmd_copy_buffer_to_image(
                self.commands,
                from.raw,
                to.raw,
                layout,
                &[image_copy(to)],
            );
        }
        self.transition(to, layout, vk::ImageLayout::GENERAL);
    }

    /// Copies the whole of an image to the start of a buffer.
    pub fn copy_from_image(&mut self, from: &'r Image, to: &'r Buffer) {
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        self.transition(from, vk::ImageLayout::GENERAL, layout);
        // SAFETY: the buffer was made for the image's pixels, both live until the submission.
        unsafe {
            self.device.raw().cmd_copy_image_to_buffer(
                self.commands,
                from.raw,
                layout,
                to.raw,
                &[image_copy(from)],
            );
        }
        self.transition(from, layout, vk::ImageLayout::GENERAL);
    }

    /// Copies the first `bytes` bytes of a buffer to the start of another.
    pub fn copy_buffer(&mut self, from: &'r Buffer, to: &'r Buffer, bytes: u64) {
        let region = vk::BufferCopy {
            src_offset: 0,
            dst_offset: 0,
            size: bytes,
        };
        // SAFETY: both ranges lie in their buffers, which live until the submission.
        unsafe {
            self.device
                .raw()
                .cmd_copy_buffer(self.commands, from.raw, to.raw, &[region]);
        }
    }

    fn push<T: Plain>(&mut self, parts: &Parts, immediate: &T) {
        let bytes = bytes_of(std::slice::from_ref(immediate));
        let bytes = &bytes[..bytes.len().min(parts.immediate_bytes as usize)];
        if !bytes.is_empty() {
            // SAFETY: the range is the pipeline layout's own.
            unsafe {
                self.device.raw().cmd_push_constants(
                    self.commands,
                    parts.layout,
                    parts.stages,
                    0,
                    bytes,
                );
            }
        }
    }

    fn bind(
        &mut self,
        point: vk::PipelineBindPoint,
        parts: &Parts,
        resources: &[(&str, Resource<'r>)],
    ) -> Result<()> {
        let mut buffers = Vec::with_capacity(parts.bindings.len());
        let mut images = Vec::with_capacity(parts.bindings.len());
        for binding in &parts.bindings {
            let resource = resources.iter().find(|(name, _)| *name == binding.name);
            let fail = |what| {
                let (pass, name) = (parts.name, binding.name);
                Err(Error::internal(format!("{pass}: binding {name} {what}")))
            };
            let is_image = matches!(
                binding.kind,
                BindingKind::SampledImage | BindingKind::StorageImage
            );
            match (resource, is_image) {
                (Some((_, Resource::Image(image))), true) => {
                    images.push([vk::DescriptorImageInfo::default()
                        .image_view(image.view)
                        .image_layout(vk::ImageLayout::GENERAL)]);
                }
                (Some((_, Resource::Buffer(buffer))), false) => {
                    buffers.push([vk::DescriptorBufferInfo::default()
                        .buffer(buffer.raw)
                        .range(vk::WHOLE_SIZE)]);
                }
                (Some(_), _) => return fail("has a resource of the other kind"),
                (None, _) => return fail("has no resource"),
            }
        }
        let (mut buffers, mut images) = (buffers.iter(), images.iter());
        let writes: Vec<_> = parts
            .bindings
            .iter()
            .map(|binding| {
                let write = vk::WriteDescriptorSet::default()
                    .dst_binding(binding.binding)
                    .descriptor_type(binding.kind.descriptor_type());
                match binding.kind {
                    BindingKind::SampledImage | BindingKind::StorageImage => {
                        write.image_info(images.next().map_or(&[], |info| info))
                    }
                    _ => write.buffer_info(buffers.next().map_or(&[], |info| info)),
                }
            })
            .collect();
        let raw = self.device.raw();
        // SAFETY: pipeline, layout and resources are live until the submission, and the writes match the layout.
        unsafe {
            raw.cmd_bind_pipeline(self.commands, point, parts.raw);
            self.device.push_descriptor().cmd_push_descriptor_set(
                self.commands,
                point,
                parts.layout,
                0,
                &writes,
            );
        }
        Ok(())
    }
}

/// An attachment that holds the same in every pixel before something is drawn; a depth takes the first value.
fn cleared(view: vk::ImageView, float32: [f32; 4]) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(view)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(vk::AttachmentLoadOp::CLEAR)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(vk::ClearValue {
            color: vk::ClearColorValue { float32 },
        })
}

fn area([width, height]: [u32; 2]) -> vk::Rect2D {
    vk::Rect2D {
        offset: vk::Offset2D::default(),
        extent: vk::Extent2D { width, height },
    }
}

fn whole(image: &Image) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: image.shape.aspect(),
        base_mip_level: 0,
        level_count: 1,
        base_array_layer: 0,
        layer_count: image.shape.layer_count(),
    }
}

fn image_copy(image: &Image) -> vk::BufferImageCopy {
    let [width, height] = image.shape.size_px;
    vk::BufferImageCopy::default()
        .image_subresource(vk::ImageSubresourceLayers {
            aspect_mask: image.shape.aspect(),
            mip_level: 0,
            base_array_layer: 0,
            layer_count: image.shape.layer_count(),
        })
        .image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        })
}
