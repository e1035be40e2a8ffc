//! Device memory that other interfaces can import.

use std::{ffi::c_void, ptr};

use super::*;
use crate::SharedMemory;

/// What an importer of shared memory needs to know. Initialise with CAMLUX_SHARED_MEMORY_INFO_INIT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_shared_memory_info {
    /// Set by CAMLUX_SHARED_MEMORY_INFO_INIT.
    pub struct_size: u32,
    /// Index of its memory type, for an import by Vulkan.
    pub memory_type_index: u32,
    /// Size of the allocation, at least the requested size. An import must name this size.
    pub allocation_bytes: u64,
    /// 1: Vulkan must import it as dedicated to a buffer of allocation_bytes with the usage TRANSFER_SRC, TRANSFER_DST and STORAGE_BUFFER.
    pub is_dedicated: i32,
    /// 0.
    pub reserved: u32,
    /// The first byte, for the host to read in place, if the device's memory is the host's; otherwise NULL. Valid until the memory's last release.
    pub host_data: *const c_void,
}

c_struct!(camlux_shared_memory_info, 32);

/// Allocates memory of a device that other interfaces can import, such as CUDA or another Vulkan instance. They import it once for all images.
/// camlux_frame_copy_to_shared copies images of frames to it, on the device.
///
/// \param size_bytes 16 for each pixel of an image, times the number of images that it must hold at a time.
/// \param memory receives the handle, with one reference; release it with camlux_shared_memory_release.
/// \errors CAMLUX_ERROR_NO_DEVICE if the device exports no memory as file descriptors: on Windows, and on a device that is the host's own;
/// CAMLUX_ERROR_OUT_OF_MEMORY; CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_shared_memory_create(
    device: *mut camlux_device,
    size_bytes: u64,
    memory: *mut *mut camlux_shared_memory,
) -> camlux_status {
    ffi_guard("camlux_shared_memory_create", || {
        let device = handle::get(device)?;
        if size_bytes == 0 {
            let problem = "size_bytes is 0; give 16 for each pixel of an image";
            return Err(Failure::argument(problem));
        }
        let take = || Ok(SharedMemory::new(&device.device, size_bytes)?);
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(memory, "memory", take) }
    })
}

/// Reads what an importer needs to know.
///
/// \param info initialise with CAMLUX_SHARED_MEMORY_INFO_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_shared_memory_get_info(
    memory: *mut camlux_shared_memory,
    info: *mut camlux_shared_memory_info,
) -> camlux_status {
    ffi_guard("camlux_shared_memory_get_info", || {
        let memory = handle::get(memory)?;
        let found = || {
            let info = memory.info();
            let host_data = memory.host_data();
            Ok(camlux_shared_memory_info {
                memory_type_index: info.memory_type_index,
                allocation_bytes: info.allocation_bytes,
                is_dedicated: info.is_dedicated.into(),
                host_data: host_data.map_or(ptr::null(), |data| data.as_ptr().cast_const().cast()),
                ..Default::default()
            })
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write(info, found) }
    })
}

/// Opens a file descriptor for the memory. It is opaque (VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT, cudaExternalMemoryHandleTypeOpaqueFd).
///
/// The importer must use the same device: compare the uuid of camlux_device_info. An importer such as Vulkan or CUDA takes ownership of the
/// descriptor; otherwise the host closes it. Every call opens another one. The memory stays until its last release, and until all imports are gone.
///
/// \param fd receives the file descriptor.
/// \errors CAMLUX_ERROR_VULKAN; CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_shared_memory_export_fd(
    memory: *mut camlux_shared_memory,
    fd: *mut i32,
) -> camlux_status {
    ffi_guard("camlux_shared_memory_export_fd", || {
        let memory = handle::get(memory)?;
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(fd, "fd", || Ok(memory.export_fd()?)) }
    })
}

/// Copies a layer of a frame to shared memory, on the device. The frame must have been rendered with on_device. When the call returns, the
/// copy is complete.
///
/// Rows are contiguous, from the top. A pixel has four 32-bit floats: R, G and B in the layer's unit for radiance, direct, indirect, stderr and
/// energy; X, Y and Z for normals; for positions see camlux_frame_get_vulkan_image, which also describes their unit.
///
/// \param layer CAMLUX_LAYER_RADIANCE, _DIRECT, _INDIRECT, _STDERR, _ENERGY, _POSITION or _NORMAL.
/// \param offset_bytes where the upper left pixel goes, a multiple of 16.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT, also for a layer that is not on the device or does not fit;
/// CAMLUX_ERROR_VULKAN.
/// \threads any. The host makes sure that nobody else is still reading the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_copy_to_shared(
    frame: *mut camlux_frame,
    layer: i32,
    memory: *mut camlux_shared_memory,
    offset_bytes: u64,
) -> camlux_status {
    ffi_guard("camlux_frame_copy_to_shared", || {
        let frame = handle::get(frame)?;
        let memory = handle::get(memory)?;
        let (kind, on_device) = frame.on_device(layer)?;
        let copied = on_device.copy_to(kind, &memory, offset_bytes);
        let is_there = copied.map_err(|error| match error {
            crate::Error::Input { .. } => Failure::argument(error.to_string()),
            other => other.into(),
        })?;
        match is_there {
            true => Ok(()),
            false => Err(not_on_device(kind)),
        }
    })
}
