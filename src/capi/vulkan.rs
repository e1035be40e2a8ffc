//! The host's own Vulkan: a device that it lends, and frames whose images it uses there.

use std::{ffi::c_void, sync::Arc};

use ash::vk::{self, Handle};

use super::*;
use crate::{Device, DeviceFrame, HostVulkan, QueueLock, output::Layer};

/// A function of Vulkan's, whatever its type: a PFN_vkGetInstanceProcAddr goes here by a cast.
pub type camlux_vulkan_function = Option<unsafe extern "C" fn()>;

/// Locks or unlocks the host's queue; receives lock_user. It must return: no exception, no longjmp.
pub type camlux_vulkan_lock_callback = Option<unsafe extern "C" fn(user: *mut c_void)>;

/// A Vulkan device of the host's. Begin with CAMLUX_VULKAN_DEVICE_INIT. The types are those of vulkan.h, which this header does not
/// include.
///
/// The instance must have been made for Vulkan 1.3, and the device with the features dynamicRendering,
/// synchronization2 and timelineSemaphore. All of this but the instance's version is checked.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_vulkan_device {
    /// sizeof(camlux_vulkan_device)
    pub struct_size: u32,
    /// The queue's family: one that draws and computes.
    pub queue_family: u32,
    /// (camlux_vulkan_function)vkGetInstanceProcAddr
    pub get_instance_proc_addr: camlux_vulkan_function,
    /// VkInstance
    pub instance: *mut c_void,
    /// VkPhysicalDevice
    pub physical_device: *mut c_void,
    /// VkDevice
    pub device: *mut c_void,
    /// const VkDeviceCreateInfo *: what the device was made with, with all that it points to; read during the call only.
    pub device_create_info: *const c_void,
    /// VkQueue
    pub queue: *mut c_void,
    /// Called before each submission to the queue, on the thread that renders. NULL: the host leaves the queue alone while camlux
    /// renders, and unlock_queue is NULL, too.
    pub lock_queue: camlux_vulkan_lock_callback,
    /// Called after it.
    pub unlock_queue: camlux_vulkan_lock_callback,
    /// Handed to both; camlux never looks at what it points to.
    pub lock_user: *mut c_void,
}

/// An image of a frame on the device. Begin with CAMLUX_VULKAN_IMAGE_INIT. The types are those of vulkan.h.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_vulkan_image {
    /// sizeof(camlux_vulkan_image)
    pub struct_size: u32,
    /// CAMLUX_LAYER_RADIANCE and so on.
    pub layer: i32,
    /// VkImage, of one layer and one level; usage SAMPLED, STORAGE, TRANSFER_SRC and TRANSFER_DST, sharing mode exclusive.
    pub image: u64,
    /// VkSemaphore, a timeline: the image is ready when it has come to semaphore_value.
    pub semaphore: u64,
    /// What the host's submission has to wait for.
    pub semaphore_value: u64,
    /// VkFormat: VK_FORMAT_R32G32B32A32_SFLOAT.
    pub format: i32,
    /// VkImageLayout: VK_IMAGE_LAYOUT_GENERAL. A host that changes it changes it back.
    pub layout: i32,
    /// Pixels of a row.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// The family that the image belongs to.
    pub queue_family: u32,
    /// 0.
    pub reserved: u32,
    /// Of CAMLUX_LAYER_POSITION: a world position is origin_m + metres_per_unit * (x, y, z).
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

// SAFETY: the pointer is only handed back to the host, which promises that its functions take it on any thread.
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

/// Opens a device on the host's own VkDevice, which stays the host's: camlux destroys none of its objects.
///
/// What came from the camlux device (renderers, frames, the device itself) has to be released before the host destroys its
/// VkDevice. The validation layer, where it is on, is the host's, and tells the host.
///
/// \param vulkan begin with CAMLUX_VULKAN_DEVICE_INIT; its objects are live and belong together.
/// \param device receives the handle, with one reference: give it back by camlux_device_release.
/// \errors CAMLUX_ERROR_NO_DEVICE where the device lacks something that camlux needs, or was made without it;
/// CAMLUX_ERROR_VULKAN; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. lock_queue and unlock_queue are called on every thread that renders.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_create_from_vulkan(
    vulkan: *const camlux_vulkan_device,
    device: *mut *mut camlux_device,
) -> camlux_status {
    ffi_guard("camlux_device_create_from_vulkan", || {
        // SAFETY: the caller's word.
        let host = unsafe { host_vulkan(&args::read(vulkan)?) }?;
        let open = || {
            // SAFETY: the caller's word.
            let device = unsafe { Device::of_host(&host) }?;
            Ok(DeviceObject::new(device))
        };
        // SAFETY: the caller's word.
        unsafe { handle::return_handle(device, "device", open) }
    })
}

/// # Safety
/// The function is vkGetInstanceProcAddr, and the locks are of their type.
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
        // SAFETY: the caller's word; function pointers have one size.
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

/// A layer of a frame on the device, for the host's own commands there; of a frame that was rendered with on_device.
///
/// The host's submission waits for semaphore_value, and orders its accesses after it: the stage of the wait is that of the first
/// access. The image is there, and no other frame touches it, until the frame's last release, which must not be before the
/// host's commands are done.
///
/// Radiance, direct, indirect, stderr and energy have R, G and B in the layer's unit; normals X, Y and Z; positions X, Y and Z in units of
/// their own (see camlux_vulkan_image) and 1 + the index of the instance, 0 without a surface. Other layers are made on the way
/// to the host.
///
/// \param layer CAMLUX_LAYER_RADIANCE, _DIRECT, _INDIRECT, _STDERR, _ENERGY, _POSITION or _NORMAL.
/// \param image begin with CAMLUX_VULKAN_IMAGE_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT, also for a layer that is not on the device.
/// \threads any; frames do not change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_frame_get_vulkan_image(
    frame: *mut camlux_frame,
    layer: i32,
    image: *mut camlux_vulkan_image,
) -> camlux_status {
    ffi_guard("camlux_frame_get_vulkan_image", || {
        let object = handle::get(frame)?;
        // SAFETY: the caller's word.
        unsafe { args::write(image, || vulkan_image(&object, layer)) }
    })
}

impl FrameObject {
    /// The frame, if it was rendered to stay on the device, and a layer's kind.
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
        "layer {} is not on the device; it is made on the way to the host, or the scene does not have it: see camlux_frame_view",
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
