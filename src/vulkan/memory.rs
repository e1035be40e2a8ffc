//! Buffers and images that free themselves when no command buffer uses them any more.

use std::{any::Any, sync::Arc};

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::{
    AllocationError, MemoryLocation,
    vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator},
};

use super::Device;
use crate::{Error, Result};

/// The purpose of a buffer, which decides the kind of memory it gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BufferUse {
    /// Written and read by shaders only.
    Device,
    /// Filled by the host once, then read by shaders: for small data.
    Upload,
    /// Filled by the host once, then copied to another buffer or an image.
    Staging,
    /// Written by the device, then read by the host.
    Readback,
}

/// An object that command buffers use, kept alive until they have run.
pub(super) type Kept = Arc<dyn Any + Send + Sync>;

/// A buffer of device memory.
pub(crate) struct Buffer {
    pub(super) raw: vk::Buffer,
    pub bytes: u64,
    owned: Arc<OwnedBuffer>,
}

struct OwnedBuffer {
    device: Device,
    raw: vk::Buffer,
    /// Taken out when freed.
    allocation: Option<Allocation>,
}

impl Buffer {
    /// A buffer of at least `bytes` bytes. It is never empty, because Vulkan has no empty buffers.
    pub fn new(device: &Device, what: &str, bytes: u64, usage: BufferUse) -> Result<Buffer> {
        let bytes = bytes.max(16);
        let mut usages = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::UNIFORM_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        if usage == BufferUse::Device && device.info().has_ray_query {
            usages |= vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS
                | vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR
                | vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR;
        }
        let info = vk::BufferCreateInfo::default()
            .size(bytes)
            .usage(usages)
            .sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: the device is live.
        let raw = device.call("vkCreateBuffer", |device| unsafe {
            device.create_buffer(&info, None)
        })?;
        // From here on, every early return destroys the buffer.
        let mut owned = OwnedBuffer {
            device: device.clone(),
            raw,
            allocation: None,
        };
        // SAFETY: device and buffer are live.
        let requirements = unsafe { device.raw().get_buffer_memory_requirements(raw) };
        let location = match usage {
            // In memory that the host can fill.
            BufferUse::Device if device.faults().poisons_memory() => MemoryLocation::CpuToGpu,
            BufferUse::Device => MemoryLocation::GpuOnly,
            BufferUse::Upload | BufferUse::Staging => MemoryLocation::CpuToGpu,
            BufferUse::Readback => MemoryLocation::GpuToCpu,
        };
        let memory = allocate(device, what, requirements, location, true)?;
        let memory = owned.allocation.insert(memory);
        // SAFETY: the memory was allocated for this buffer's requirements and is bound once.
        device.call("vkBindBufferMemory", |device| unsafe {
            device.bind_buffer_memory(raw, memory.memory(), memory.offset())
        })?;
        if device.faults().poisons_memory() {
            let mapped = memory.mapped_slice_mut();
            mapped.into_iter().for_each(|bytes| bytes.fill(0xff));
        }
        let owned = Arc::new(owned);
        Ok(Buffer { raw, bytes, owned })
    }

    /// Keeps the buffer alive after this object is dropped.
    pub(super) fn keep(&self) -> Kept {
        self.owned.clone()
    }

    /// Device address of a [`BufferUse::Device`] buffer. Only valid if the device can trace rays with its own units.
    pub(super) fn address(&self) -> u64 {
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.raw);
        // SAFETY: the buffer is live and was made with this usage.
        unsafe { self.owned.device.raw().get_buffer_device_address(&info) }
    }

    /// A buffer filled with values, for shaders to read.
    pub fn upload<T: Pod>(device: &Device, what: &str, values: &[T]) -> Result<Buffer> {
        Buffer::filled(device, what, values, BufferUse::Upload)
    }

    /// A buffer filled with values. `usage` must not be [`BufferUse::Device`].
    pub fn filled<T: Pod>(
        device: &Device,
        what: &str,
        values: &[T],
        usage: BufferUse,
    ) -> Result<Buffer> {
        let mut buffer = Buffer::new(device, what, size_of_val(values) as u64, usage)?;
        buffer.write(values)?;
        Ok(buffer)
    }

    /// Writes values to the start of a buffer that the host can access and that no command buffer uses.
    pub fn write<T: Pod>(&mut self, values: &[T]) -> Result<()> {
        self.mapped_mut(values.len())?.copy_from_slice(values);
        Ok(())
    }

    /// The first `count` values of a readback buffer. Valid after the submission that wrote them has completed.
    pub fn mapped<T: Pod>(&self, count: usize) -> Result<&[T]> {
        let allocation = self.owned.allocation.as_ref();
        allocation
            .and_then(Allocation::mapped_slice)
            .and_then(|memory| memory.get(..count * size_of::<T>()))
            .and_then(|bytes| bytemuck::try_cast_slice(bytes).ok())
            .ok_or_else(|| Error::internal("a buffer to be read back is not mapped"))
    }

    /// The same values, for the host to write. The buffer must not be in use by a command buffer.
    pub fn mapped_mut<T: Pod>(&mut self, count: usize) -> Result<&mut [T]> {
        Arc::get_mut(&mut self.owned)
            .and_then(|owned| owned.allocation.as_mut())
            .and_then(Allocation::mapped_slice_mut)
            .and_then(|memory| memory.get_mut(..count * size_of::<T>()))
            .and_then(|bytes| bytemuck::try_cast_slice_mut(bytes).ok())
            .ok_or_else(|| Error::internal("a buffer for the host is in use or not mapped"))
    }
}

impl Drop for OwnedBuffer {
    fn drop(&mut self) {
        // SAFETY: recorders keep what they name until the device is done with it.
        unsafe { self.device.raw().destroy_buffer(self.raw, None) };
        free(&self.device, self.allocation.take());
    }
}

/// Size and kind of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ImageShape {
    pub size_px: [u32; 2],
    /// `None`: a plain 2D image; `Some(n)`: an array of n layers.
    pub layers: Option<u32>,
    pub pixel: PixelKind,
}

/// The content of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PixelKind {
    /// Four floats.
    Color,
    Depth,
    /// A 32-bit word, which only shaders read.
    Word,
}

impl PixelKind {
    pub fn bytes(self) -> u64 {
        match self {
            PixelKind::Color => 16,
            PixelKind::Depth | PixelKind::Word => 4,
        }
    }
}

impl ImageShape {
    pub fn plain(size_px: [u32; 2]) -> Self {
        ImageShape {
            size_px,
            layers: None,
            pixel: PixelKind::Color,
        }
    }

    /// The same with layers.
    pub fn with_layers(self, layers: u32) -> Self {
        ImageShape {
            layers: Some(layers),
            ..self
        }
    }

    /// The depth image that all layers use one after the other.
    pub fn depth(self) -> Self {
        ImageShape {
            layers: None,
            pixel: PixelKind::Depth,
            ..self
        }
    }

    pub fn layer_count(&self) -> u32 {
        self.layers.unwrap_or(1)
    }

    /// Number of pixels of all layers.
    pub fn pixel_count(&self) -> u64 {
        let [width, height] = self.size_px.map(u64::from);
        width * height * u64::from(self.layer_count())
    }

    pub(super) fn extent(&self) -> vk::Extent3D {
        let [width, height] = self.size_px;
        vk::Extent3D {
            width,
            height,
            depth: 1,
        }
    }

    /// The subresource range of `count` layers from `first` on.
    pub(super) fn range(&self, first: u32, count: u32) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange::default()
            .aspect_mask(self.aspect())
            .level_count(1)
            .base_array_layer(first)
            .layer_count(count)
    }

    pub(super) fn aspect(&self) -> vk::ImageAspectFlags {
        match self.pixel {
            PixelKind::Depth => vk::ImageAspectFlags::DEPTH,
            PixelKind::Color | PixelKind::Word => vk::ImageAspectFlags::COLOR,
        }
    }

    pub(super) fn format(&self) -> vk::Format {
        match self.pixel {
            PixelKind::Color => COLOR_FORMAT,
            PixelKind::Depth => DEPTH_FORMAT,
            PixelKind::Word => vk::Format::R32_UINT,
        }
    }
}

/// Format of every colour image: four floats, so that a pass reads exactly what the previous one wrote.
pub(super) const COLOR_FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
pub(super) const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;

/// An image, with a view of the whole and one of each layer.
pub(crate) struct Image {
    pub shape: ImageShape,
    owned: Arc<OwnedImage>,
}

pub(super) struct OwnedImage {
    device: Device,
    pub raw: vk::Image,
    allocation: Option<Allocation>,
    pub view: vk::ImageView,
    pub layer_views: Vec<vk::ImageView>,
    shape: ImageShape,
}

impl Image {
    pub fn new(device: &Device, what: &str, shape: ImageShape) -> Result<Image> {
        let usage = match shape.pixel {
            PixelKind::Color => {
                vk::ImageUsageFlags::COLOR_ATTACHMENT
                    | vk::ImageUsageFlags::SAMPLED
                    | vk::ImageUsageFlags::STORAGE
                    | vk::ImageUsageFlags::TRANSFER_SRC
                    | vk::ImageUsageFlags::TRANSFER_DST
            }
            PixelKind::Depth => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
            PixelKind::Word => vk::ImageUsageFlags::STORAGE | vk::ImageUsageFlags::TRANSFER_DST,
        };
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(shape.format())
            .extent(shape.extent())
            .mip_levels(1)
            .array_layers(shape.layer_count())
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage)
            .sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: the device is live.
        let raw = device.call("vkCreateImage", |device| unsafe {
            device.create_image(&info, None)
        })?;
        // From here on, every early return destroys the image.
        let mut image = OwnedImage {
            device: device.clone(),
            raw,
            allocation: None,
            view: vk::ImageView::null(),
            layer_views: Vec::new(),
            shape,
        };
        // SAFETY: device and image are live.
        let requirements = unsafe { device.raw().get_image_memory_requirements(raw) };
        let memory = allocate(device, what, requirements, MemoryLocation::GpuOnly, false)?;
        let memory = image.allocation.insert(memory);
        // SAFETY: the memory was allocated for this image's requirements and is bound once.
        device.call("vkBindImageMemory", |device| unsafe {
            device.bind_image_memory(raw, memory.memory(), memory.offset())
        })?;
        let kind = match shape.layers {
            None => vk::ImageViewType::TYPE_2D,
            Some(_) => vk::ImageViewType::TYPE_2D_ARRAY,
        };
        image.view = image.make_view(kind, 0, shape.layer_count())?;
        for layer in 0..shape.layer_count() {
            let view = image.make_view(vk::ImageViewType::TYPE_2D, layer, 1)?;
            image.layer_views.push(view);
        }
        let owned = Arc::new(image);
        Ok(Image { shape, owned })
    }

    /// The Vulkan handles.
    pub(super) fn handles(&self) -> &OwnedImage {
        &self.owned
    }

    /// Keeps the image alive after this object is dropped.
    pub(super) fn keep(&self) -> Kept {
        self.owned.clone()
    }

    /// No other image has it while this one exists.
    pub(super) fn id(&self) -> u64 {
        ash::vk::Handle::as_raw(self.owned.raw)
    }

    /// The Vulkan image: four 32-bit floats a pixel, in layout GENERAL once something has been written to it.
    pub fn handle(&self) -> (vk::Image, vk::Format) {
        (self.owned.raw, self.shape.format())
    }
}

impl OwnedImage {
    fn make_view(&self, kind: vk::ImageViewType, first: u32, count: u32) -> Result<vk::ImageView> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(kind)
            .format(self.shape.format())
            .subresource_range(self.shape.range(first, count));
        // SAFETY: device and image are live, and the layers are the image's own.
        self.device.call("vkCreateImageView", |device| unsafe {
            device.create_image_view(&info, None)
        })
    }
}

impl Drop for OwnedImage {
    fn drop(&mut self) {
        // SAFETY: recorders keep what they name until the device is done with it; destroying a null handle does nothing.
        unsafe {
            for &view in self.layer_views.iter().chain([&self.view]) {
                self.device.raw().destroy_image_view(view, None);
            }
            self.device.raw().destroy_image(self.raw, None);
        }
        free(&self.device, self.allocation.take());
    }
}

fn allocate(
    device: &Device,
    what: &str,
    requirements: vk::MemoryRequirements,
    location: MemoryLocation,
    linear: bool,
) -> Result<Allocation> {
    let request = AllocationCreateDesc {
        name: what,
        requirements,
        location,
        linear,
        allocation_scheme: AllocationScheme::GpuAllocatorManaged,
    };
    device.check()?;
    let allocated = if device.faults().next_call_fails("vkAllocateMemory") {
        Err(AllocationError::OutOfMemory)
    } else {
        device.memory().allocate(&request)
    };
    allocated.map_err(|error| Error::Memory {
        what: what.into(),
        bytes: requirements.size,
        problem: error.to_string(),
    })
}

fn free(device: &Device, allocation: Option<Allocation>) {
    if let Some(allocation) = allocation {
        device.memory().free(allocation);
    }
}

/// Device memory that buffers and images hold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MemoryUse {
    /// Number of buffers and images that have memory. Between renders these are what renderers keep.
    pub allocations: usize,
    /// Their bytes.
    pub bytes: u64,
    /// Peak of the bytes since the device was opened.
    pub peak_bytes: u64,
    /// Bytes of the largest buffer or image since then.
    pub largest_bytes: u64,
}

/// A device's allocator and its statistics.
pub(super) struct Memory {
    pub allocator: Allocator,
    pub usage: MemoryUse,
}

impl Memory {
    fn allocate(
        &mut self,
        request: &AllocationCreateDesc,
    ) -> std::result::Result<Allocation, AllocationError> {
        let allocation = self.allocator.allocate(request)?;
        let usage = &mut self.usage;
        usage.allocations += 1;
        usage.bytes += allocation.size();
        usage.peak_bytes = usage.peak_bytes.max(usage.bytes);
        usage.largest_bytes = usage.largest_bytes.max(allocation.size());
        Ok(allocation)
    }

    fn free(&mut self, allocation: Allocation) {
        self.usage.allocations -= 1;
        self.usage.bytes -= allocation.size();
        // Freeing fails only for memory of another allocator.
        let _ = self.allocator.free(allocation);
    }
}
