//! Device memory that other programs and interfaces, such as CUDA, import. If it is the host's own memory, the host reads it in place.

use std::{
    ffi::{c_int, c_void},
    ptr::NonNull,
    sync::Arc,
};

use ash::vk;

use super::{Device, DeviceKind, Image, no_device};
use crate::{Error, Result};

const HANDLE: vk::ExternalMemoryHandleTypeFlags = vk::ExternalMemoryHandleTypeFlags::OPAQUE_FD;
/// Usage of the buffer that covers the memory.
const USAGE: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::TRANSFER_SRC.as_raw()
        | vk::BufferUsageFlags::TRANSFER_DST.as_raw()
        | vk::BufferUsageFlags::STORAGE_BUFFER.as_raw(),
);
/// Bytes of a pixel: four 32-bit floats.
const PIXEL_BYTES: u64 = 16;

/// Device memory that receives copies of a frame's images and that others import once. Clones share it.
#[derive(Clone)]
pub struct SharedMemory {
    owned: Arc<Owned>,
}

struct Owned {
    device: Device,
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    host_data: Option<NonNull<u8>>,
    info: SharedMemoryInfo,
}

// SAFETY: the pointer is to mapped memory that lives as long as the object, and the object only hands it out.
unsafe impl Send for Owned {}
// SAFETY: as above.
unsafe impl Sync for Owned {}

/// What an importer needs to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SharedMemoryInfo {
    /// Bytes of the allocation, at least the requested number.
    pub allocation_bytes: u64,
    /// Index of its memory type. A Vulkan importer uses the same type.
    pub memory_type_index: u32,
    /// Whether the allocation is dedicated to its buffer. A Vulkan importer does the same.
    pub is_dedicated: bool,
}

impl SharedMemory {
    /// Allocates this many bytes on a device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if the device exports no memory as file descriptors, as on Windows and for a host's own device;
    /// [`Error::Memory`] if there is not enough memory.
    pub fn new(device: &Device, bytes: u64) -> Result<SharedMemory> {
        let lacking = |what: &str| {
            let problem = format!("{} {what}", device.info().name);
            no_device(problem, "copy layers to the host instead")
        };
        if device.external_memory_fd().is_none() {
            return Err(lacking("was opened without VK_KHR_external_memory_fd"));
        }
        let features = device.exported_buffer_features(USAGE, HANDLE);
        if !features.contains(vk::ExternalMemoryFeatureFlags::EXPORTABLE) {
            return Err(lacking("cannot export the memory of buffers"));
        }
        let is_dedicated = features.contains(vk::ExternalMemoryFeatureFlags::DEDICATED_ONLY);
        let mut external = vk::ExternalMemoryBufferCreateInfo::default().handle_types(HANDLE);
        let info = vk::BufferCreateInfo::default()
            .size(bytes.max(PIXEL_BYTES))
            .usage(USAGE)
            .sharing_mode(vk::SharingMode::EXCLUSIVE)
            .push_next(&mut external);
        // SAFETY: the device is live.
        let buffer = device.call("vkCreateBuffer", |raw| unsafe {
            raw.create_buffer(&info, None)
        })?;
        // From here on, every early return destroys everything.
        let mut owned = Owned {
            device: device.clone(),
            buffer,
            memory: vk::DeviceMemory::null(),
            host_data: None,
            info: SharedMemoryInfo {
                allocation_bytes: 0,
                memory_type_index: 0,
                is_dedicated,
            },
        };
        owned.allocate()?;
        Ok(SharedMemory {
            owned: Arc::new(owned),
        })
    }

    pub fn info(&self) -> SharedMemoryInfo {
        self.owned.info
    }

    /// A new file descriptor of the memory, of the type `OPAQUE_FD`. The caller closes it or hands it to the importer. The memory also
    /// lives until the last descriptor is closed.
    ///
    /// # Errors
    /// [`Error::Vulkan`] if the process has too many open descriptors.
    pub fn export_fd(&self) -> Result<c_int> {
        let device = &self.owned.device;
        let exporter = device.external_memory_fd();
        let exporter = exporter.ok_or_else(|| Error::internal("memory that is not exported"))?;
        let info = vk::MemoryGetFdInfoKHR::default()
            .memory(self.owned.memory)
            .handle_type(HANDLE);
        // SAFETY: the memory is live and was allocated for this.
        device.call("vkGetMemoryFdKHR", |_| unsafe {
            exporter.get_memory_fd(&info)
        })
    }

    /// The first byte, if the device's memory is the host's. Valid as long as the memory.
    pub fn host_data(&self) -> Option<NonNull<u8>> {
        self.owned.host_data
    }

    pub(super) fn buffer(&self) -> vk::Buffer {
        self.owned.buffer
    }

    /// Refuses an image that does not fit, or that is on another device.
    pub(super) fn check(&self, device: &Device, image: &Image, offset_bytes: u64) -> Result<()> {
        let bytes = image.shape.pixel_count() * PIXEL_BYTES;
        let allocated = self.owned.info.allocation_bytes;
        let end = offset_bytes.checked_add(bytes);
        let problem = if !device.is_same(&self.owned.device) {
            "it is on another device than the frame".into()
        } else if !offset_bytes.is_multiple_of(PIXEL_BYTES) {
            format!("the offset is {offset_bytes}, which is not a multiple of {PIXEL_BYTES}")
        } else if end.is_none_or(|end| end > allocated) {
            format!("{bytes} bytes at offset {offset_bytes} do not fit in its {allocated} bytes")
        } else {
            return Ok(());
        };
        Err(Error::Input {
            at: "shared memory".into(),
            problem,
            hint: "create it on the frame's device, with 16 bytes for each pixel".into(),
        })
    }
}

impl Owned {
    fn allocate(&mut self) -> Result<()> {
        let (device, buffer) = (self.device.clone(), self.buffer);
        // SAFETY: device and buffer are live.
        let requirements = unsafe { device.raw().get_buffer_memory_requirements(buffer) };
        let is_hosts = matches!(device.info().kind, DeviceKind::Cpu | DeviceKind::Integrated);
        let visible =
            vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
        let wanted = match is_hosts {
            true => vk::MemoryPropertyFlags::DEVICE_LOCAL | visible,
            false => vk::MemoryPropertyFlags::DEVICE_LOCAL,
        };
        let types = device.memory_types();
        let allowed = (0..types.len()).filter(|&i| requirements.memory_type_bits >> i & 1 == 1);
        // The first type with most of the wanted properties.
        let chosen = allowed.min_by_key(|&i| {
            let lacking = wanted & !types[i];
            lacking.as_raw().count_ones()
        });
        let chosen = chosen.ok_or_else(|| Error::internal("a buffer that fits in no memory"))?;
        let mut export = vk::ExportMemoryAllocateInfo::default().handle_types(HANDLE);
        let mut dedicated = vk::MemoryDedicatedAllocateInfo::default().buffer(buffer);
        let mut info = vk::MemoryAllocateInfo::default()
            .allocation_size(requirements.size)
            .memory_type_index(chosen as u32)
            .push_next(&mut export);
        if self.info.is_dedicated {
            info = info.push_next(&mut dedicated);
        }
        self.info.allocation_bytes = requirements.size;
        self.info.memory_type_index = chosen as u32;
        // SAFETY: the device is live, and the memory type is one of its own.
        let memory = device.call("vkAllocateMemory", |raw| unsafe {
            raw.allocate_memory(&info, None)
        });
        self.memory = memory.map_err(|error| match error {
            Error::Vulkan { result, .. } => Error::Memory {
                what: "shared memory".into(),
                bytes: requirements.size,
                problem: result.to_string(),
            },
            other => other,
        })?;
        // SAFETY: the memory was allocated for this buffer's requirements and is bound once.
        device.call("vkBindBufferMemory", |raw| unsafe {
            raw.bind_buffer_memory(buffer, self.memory, 0)
        })?;
        if is_hosts && types[chosen].contains(visible) {
            // SAFETY: the memory is visible, and mapped once, until it is freed.
            let data: *mut c_void = device.call("vkMapMemory", |raw| unsafe {
                raw.map_memory(self.memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty())
            })?;
            self.host_data = NonNull::new(data.cast());
        }
        Ok(())
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        // SAFETY: every copy to it was waited for; null handles are ignored.
        unsafe {
            self.device.raw().destroy_buffer(self.buffer, None);
            self.device.raw().free_memory(self.memory, None);
        }
    }
}
