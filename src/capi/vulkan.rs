//! The host's own Vulkan: a device that camlux uses, and frames whose images the host uses.

use std::{ffi::c_void, sync::Arc};

use ash::vk::{self, Handle};

use super::*;
use crate::{Device, DeviceFrame, HostVulkan, QueueLock, output::Layer};

/// A Vulkan function of any type: cast a PFN_vkGetInstanceProcAddr to it.
pub type camlux_vulkan_function = Option<unsafe extern "C" fn()>;

/// Locks or unlocks the host's queue; receives lock_user. It must return: no exception, no longjmp.
pub type camlux_vulkan_lock_callback = Option<unsafe extern "C" fn(user: *mut c_void)>;

/// A Vulkan device that belongs to the host. Initialise with CAMLUX_VULKAN_DEVICE_INIT. The types are those of vulkan.h, which this header
/// does not include.
///
/// The instance must be created for Vulkan 1.3, and the device with the features dynamicRendering,
/// synchronization2 and timelineSemaphore. camlux checks all of this except the instance's version.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_vulkan_device {
    /// Set by CAMLUX_VULKAN_DEVICE_INIT.
    pub struct_size: u32,
    /// The queue's family, which must support graphics and compute.
    pub queue_family: u32,
    /// (camlux_vulkan_function)vkGetInstanceProcAddr
    pub get_instance_proc_addr: camlux_vulkan_function,
    /// VkInstance
    pub instance: *mut c_void,
    /// VkPhysicalDevice
    pub physical_device: *mut c_void,
    /// VkDevice
    pub device: *mut c_void,
    /// const VkDeviceCreateInfo * with which the device was created, and everything it points to; read during the call only.
    pub device_create_info: *const c_void,
    /// VkQueue
    pub queue: *mut c_void,
    /// Called before each submission to the queue, on the thread that renders. NULL: the host does not use the queue while camlux
    /// renders; unlock_queue must then be NULL, too.
    pub lock_queue: camlux_vulkan_lock_callback,
    /// Called after each submission.
    pub unlock_queue: camlux_vulkan_lock_callback,
    /// Passed to both; camlux does not read what it points to.
    pub lock_user: *mut c_void,
}

/// An image of a frame on the device. Initialise with CAMLUX_VULKAN_IMAGE_INIT. The types are those of vulkan.h.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_vulkan_image {
    /// Set by CAMLUX_VULKAN_IMAGE_INIT.
    pub struct_size: u32,
    /// CAMLUX_LAYER_RADIANCE and so on.
    pub layer: i32,
    /// VkImage with one array layer and one mip level; usage SAMPLED, STORAGE, TRANSFER_SRC and TRANSFER_DST, sharing mode exclusive.
    pub image: u64,
    /// VkSemaphore, a timeline: the image is ready when it has reached semaphore_value.
    pub semaphore: u64,
    /// The value that the host's submission must wait for.
    pub semaphore_value: u64,
    /// VkFormat: VK_FORMAT_R32G32B32A32_SFLOAT.
    pub format: i32,
    /// VkImageLayout: VK_IMAGE_LAYOUT_GENERAL. A host that changes it must change it back.
    pub layout: i32,
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// The queue family that owns the image.
    pub queue_family: u32,
    /// 0.
    pub reserved: u32,
    /// For CAMLUX_LAYER_POSITION: a world position is origin_m + metres_per_unit * (x, y, z).
    pub origin_m: [f64; 3],
    /// See origin_m.
    pub metres_per_unit: f64,
}

c_struct!(camlux_vulkan_device, 80);

c_struct!(camlux_vulkan_image, 88, metres_per_unit: 1.0);

/// The host's callbacks.
struct HostLock {
    lock: unsafe extern "C" fn(user: *mut c_void),
    unlock: unsafe extern "C" fn(user: *mut c_void),
    user: *mut c_void,
}

// SAFETY: the pointer is only passed back to the host, which guarantees that its functions accept it on any thread.
unsafe impl Send for HostLock {}
// SAFETY: as above.
unsafe impl Sync for HostLock {}

impl QueueLock for HostLock {
    fn lock(&self) {
        // SAFETY: the host's function, of that type.
        unsafe { (self.lock)(self.user) };
    }

    fn unlock(&self) {
        // SAFETY: the host's function, of that type.
        unsafe { (self.unlock)(self.user) };
    }
}

/// Opens a device on the host's own VkDevice. The host keeps owning it: camlux destroys none of its objects.
///
/// Release everything that came from the camlux device (renderers, frames, the device itself) before the host destroys its
/// VkDevice. If a validation layer is on, it is the host's, and reports to the host.
///
/// \param vulkan initialise with CAMLUX_VULKAN_DEVICE_INIT; its objects must be valid and belong together.
/// \param device receives the handle, with one reference; release it with camlux_device_release.
/// \errors CAMLUX_ERROR_NO_DEVICE if the device lacks something that camlux needs, or was created without it;
/// CAMLUX_ERROR_VULKAN; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. lock_queue and unlock_queue are called on every thread that renders.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_create_from_vulkan(
    vulkan: *const camlux_vulkan_device,
    device: *mut *mut camlux_device,
) -> camlux_status {
    ffi_guard("camlux_device_create_from_vulkan", || {
        // SAFETY: the caller guarantees it.
        let host = unsafe { host_vulkan(&args::read(vulkan)?) }?;
        let open = || {
            // SAFETY: the caller guarantees it.
            let device = unsafe { Device::of_host(&host) }?;
            Ok(DeviceObject::new(device))
        };
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(device, "device", open) }
    })
}

/// # Safety
/// The function is vkGetInstanceProcAddr, and the lock functions have their types.
unsafe fn host_vulkan(vulkan: &camlux_vulkan_device) -> Outcome<HostVulkan> {
    let Some(function) = vulkan.get_instance_proc_addr else {
        let problem = "get_instance_proc_addr is NULL; give vkGetInstanceProcAddr";
        return Err(Failure::argument(problem));
    };
    let queue_lock: Option<Arc<dyn QueueLock>> = match (vulkan.lock_queue, vulkan.unlock_queue) {
        (Some(lock), Some(unlock)) => Some(Arc::new(HostLock {
            lock,
            unlock,
            user: vulkan.lock_user,
        })),
        (None, None) => None,
        _ => {
            let problem = "one of lock_queue and unlock_queue is NULL; give both or neither";
            return Err(Failure::argument(problem));
        }
    };
    let create_info: *const vk::DeviceCreateInfo = vulkan.device_create_info.cast();
    args::check_pointer(create_info, "device_create_info")?;
    Ok(HostVulkan {
        // SAFETY: the caller guarantees it; function pointers have one size.
        get_instance_proc_addr: unsafe {
            std::mem::transmute::<unsafe extern "C" fn(), vk::PFN_vkGetInstanceProcAddr>(function)
        },
        instance: vk::Instance::from_raw(vulkan.instance.addr() as u64),
        physical_device: vk::PhysicalDevice::from_raw(vulkan.physical_device.addr() as u64),
        device: vk::Device::from_raw(vulkan.device.addr() as u64),
        device_create_info: create_info,
        queue: vk::Queue::from_raw(vulkan.queue.addr() as u64),
        queue_family: vulkan.queue_family,
        queue_lock,
    })
}

/// Gives access to a layer of a frame on the device, for the host's own commands there. The frame must have been rendered with on_device.
///
/// The host's submission must wait for semaphore_value. Use the stage of the first access as the stage of the wait. The image
/// exists, and no other frame touches it, until the frame's last release. Do not release the frame before the
/// host's commands are done.
///
/// Radiance, direct, indirect, stderr and energy have R, G and B in the layer's unit. Normals have X, Y and Z. Positions have X, Y and Z in
/// their own unit (see camlux_vulkan_image), and 1 + the index of the instance, 0 without a surface. Other layers are computed when they are
/// copied to the host.
///
/// \param layer CAMLUX_LAYER_RADIANCE, _DIRECT, _INDIRECT, _STDERR, _ENERGY, _POSITION or _NORMAL.
/// \param image initialise with CAMLUX_VULKAN_IMAGE_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT, also for a layer that is not on the device.
/// \threads any; frames are immutable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_get_vulkan_image(
    frame: *mut camlux_frame,
    layer: i32,
    image: *mut camlux_vulkan_image,
) -> camlux_status {
    ffi_guard("camlux_frame_get_vulkan_image", || {
        let object = handle::get(frame)?;
        // SAFETY: the caller guarantees it.
        unsafe { args::write(image, || vulkan_image(&object, layer)) }
    })
}

impl FrameObject {
    /// The kind of a layer, and the frame if it was rendered with on_device.
    pub fn on_device(&self, layer: i32) -> Outcome<(Layer, &DeviceFrame)> {
        let kind = layer_of(layer)?;
        match &self.rendered {
            Rendered::OnDevice(on_device, _) => Ok((kind, on_device)),
            _ => Err(Failure::argument(
                "the frame was not rendered with on_device; set it in camlux_render_options",
            )),
        }
    }
}

pub(super) fn not_on_device(layer: Layer) -> Failure {
    Failure::argument(format!(
        "layer {} is not on the device: camlux computes it during the copy to the host, or the scene does not have it; use camlux_frame_view",
        layer.name()
    ))
}

fn vulkan_image(object: &FrameObject, layer: i32) -> Outcome<camlux_vulkan_image> {
    let (kind, on_device) = object.on_device(layer)?;
    let found = on_device.image(kind);
    let found = found.ok_or_else(|| not_on_device(kind))?;
    let (semaphore, semaphore_value) = on_device.ready();
    let space = on_device.local_space();
    Ok(camlux_vulkan_image {
        layer,
        image: found.image.as_raw(),
        semaphore: semaphore.as_raw(),
        semaphore_value,
        format: found.format.as_raw(),
        layout: vk::ImageLayout::GENERAL.as_raw(),
        width_px: found.size_px[0],
        height_px: found.size_px[1],
        queue_family: found.queue_family,
        origin_m: space.origin_m.to_array(),
        metres_per_unit: space.metres_per_unit,
        ..Default::default()
    })
}
