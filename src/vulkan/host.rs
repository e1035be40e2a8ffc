//! A device that a host has made and goes on using, and what it needs to use a frame's images there.

use std::{
    ffi::CStr,
    fmt,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use ash::{khr, vk};

use super::{Device, instance::Instance};
use crate::{Error, Result};

/// A host's own Vulkan objects. They stay the host's: camlux destroys none of them.
///
/// The instance must have been made for Vulkan 1.3, and the device with
/// - the extension `VK_KHR_push_descriptor`,
/// - the features `dynamicRendering`, `synchronization2` and `timelineSemaphore`,
/// - a queue of a family that draws, computes and takes timestamps.
///
/// All of this but the instance's version is checked. Everything that came from the camlux device must be gone before the host
/// destroys its own.
pub struct HostVulkan {
    pub get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    pub instance: vk::Instance,
    pub physical_device: vk::PhysicalDevice,
    pub device: vk::Device,
    /// What the device was made with: to see which features and extensions are on.
    pub device_create_info: *const vk::DeviceCreateInfo<'static>,
    pub queue: vk::Queue,
    pub queue_family: u32,
    /// Called around every submission to the queue; `None` where the host leaves the queue alone while camlux renders.
    pub queue_lock: Option<Arc<dyn QueueLock>>,
}

/// A lock of the host's around a queue that it shares with camlux.
pub trait QueueLock: Send + Sync {
    fn lock(&self);
    fn unlock(&self);
}

/// Functions without which nothing goes.
const NEEDED_FUNCTIONS: [&CStr; 4] = [
    c"vkQueueSubmit2",
    c"vkCmdBeginRendering",
    c"vkCmdPushDescriptorSetKHR",
    c"vkGetSemaphoreCounterValue",
];

impl HostVulkan {
    /// The host's instance and device as camlux calls them.
    ///
    /// # Errors
    /// [`Error::NoDevice`] for what is missing.
    ///
    /// # Safety
    /// The handles are live and belong together, and the create info is the one that the device was made with.
    pub(super) unsafe fn load(&self) -> Result<(Arc<Instance>, ash::Device)> {
        let is_null = self.instance == vk::Instance::null()
            || self.physical_device == vk::PhysicalDevice::null()
            || self.device == vk::Device::null()
            || self.queue == vk::Queue::null()
            || self.device_create_info.is_null();
        if is_null {
            return Err(lacking("a handle is null".into()));
        }
        // SAFETY: promised by the caller.
        let enabled = unsafe { Enabled::of(&*self.device_create_info) };
        if let Some(lack) = enabled.lacks() {
            return Err(lacking(format!("it was made without {lack}")));
        }
        let static_fn = ash::StaticFn {
            get_instance_proc_addr: self.get_instance_proc_addr,
        };
        // SAFETY: promised by the caller.
        let instance = unsafe { ash::Instance::load(&static_fn, self.instance) };
        let device = unsafe { ash::Device::load(instance.fp_v1_0(), self.device) };
        for name in NEEDED_FUNCTIONS {
            // SAFETY: the device is live, and the name is a C string.
            let function = unsafe { instance.get_device_proc_addr(self.device, name.as_ptr()) };
            if function.is_none() {
                let name = name.to_string_lossy();
                return Err(lacking(format!(
                    "it has no {name}: is the instance of Vulkan 1.3?"
                )));
            }
        }
        let instance = Instance::of_host(instance);
        if instance.queue_family_lacks(self.physical_device, self.queue_family) {
            return Err(lacking(format!(
                "queue family {} does not draw, compute and take timestamps",
                self.queue_family
            )));
        }
        Ok((instance, device))
    }
}

fn lacking(problem: String) -> Error {
    Error::NoDevice {
        problem: format!("the host's device cannot be used: {problem}"),
        hint: "see the list of what it must have in the documentation of HostVulkan and of camlux_vulkan_device".into(),
    }
}

/// What of that which camlux needs is on.
#[derive(Default)]
struct Enabled {
    push_descriptor: bool,
    dynamic_rendering: bool,
    synchronization2: bool,
    timeline_semaphore: bool,
}

impl Enabled {
    /// # Safety
    /// The info is a valid one, with all that it points to.
    unsafe fn of(info: &vk::DeviceCreateInfo) -> Enabled {
        let mut enabled = Enabled::default();
        for index in 0..info.enabled_extension_count as usize {
            // SAFETY: there are as many names as the info says, each a C string.
            let name = unsafe { CStr::from_ptr(*info.pp_enabled_extension_names.add(index)) };
            enabled.push_descriptor |= name == khr::push_descriptor::NAME;
        }
        let mut next: *const vk::BaseInStructure = info.p_next.cast();
        // SAFETY: the chain is valid, and each of its structures is of the type that it says.
        while let Some(structure) = unsafe { next.as_ref() } {
            enabled.add(structure);
            next = structure.p_next;
        }
        enabled
    }

    fn add(&mut self, structure: &vk::BaseInStructure) {
        let place = std::ptr::from_ref(structure);
        // SAFETY (all below): the structure is of the type that it says.
        match structure.s_type {
            vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_3_FEATURES => {
                let of13 = unsafe { &*place.cast::<vk::PhysicalDeviceVulkan13Features>() };
                self.dynamic_rendering |= of13.dynamic_rendering != 0;
                self.synchronization2 |= of13.synchronization2 != 0;
            }
            vk::StructureType::PHYSICAL_DEVICE_DYNAMIC_RENDERING_FEATURES => {
                let of = unsafe { &*place.cast::<vk::PhysicalDeviceDynamicRenderingFeatures>() };
                self.dynamic_rendering |= of.dynamic_rendering != 0;
            }
            vk::StructureType::PHYSICAL_DEVICE_SYNCHRONIZATION_2_FEATURES => {
                let of = unsafe { &*place.cast::<vk::PhysicalDeviceSynchronization2Features>() };
                self.synchronization2 |= of.synchronization2 != 0;
            }
            vk::StructureType::PHYSICAL_DEVICE_VULKAN_1_2_FEATURES => {
                let of12 = unsafe { &*place.cast::<vk::PhysicalDeviceVulkan12Features>() };
                self.timeline_semaphore |= of12.timeline_semaphore != 0;
            }
            vk::StructureType::PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES => {
                let of = unsafe { &*place.cast::<vk::PhysicalDeviceTimelineSemaphoreFeatures>() };
                self.timeline_semaphore |= of.timeline_semaphore != 0;
            }
            _ => {}
        }
    }

    fn lacks(&self) -> Option<&'static str> {
        [
            (self.push_descriptor, "VK_KHR_push_descriptor"),
            (self.dynamic_rendering, "the feature dynamicRendering"),
            (self.synchronization2, "the feature synchronization2"),
            (self.timeline_semaphore, "the feature timelineSemaphore"),
        ]
        .into_iter()
        .find_map(|(is_on, name)| (!is_on).then_some(name))
    }
}

/// The queue, while it is submitted to.
pub(super) struct SharedQueue {
    queue: Mutex<vk::Queue>,
    host: Option<Arc<dyn QueueLock>>,
}

impl SharedQueue {
    pub fn new(queue: vk::Queue, host: Option<Arc<dyn QueueLock>>) -> Self {
        SharedQueue {
            queue: Mutex::new(queue),
            host,
        }
    }

    pub fn lock(&self) -> QueueGuard<'_> {
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(host) = &self.host {
            host.lock();
        }
        QueueGuard {
            queue,
            host: self.host.as_deref(),
        }
    }
}

/// Nobody else submits as long as it lives.
pub(super) struct QueueGuard<'q> {
    queue: MutexGuard<'q, vk::Queue>,
    host: Option<&'q dyn QueueLock>,
}

impl QueueGuard<'_> {
    pub fn raw(&self) -> vk::Queue {
        *self.queue
    }
}

impl Drop for QueueGuard<'_> {
    fn drop(&mut self) {
        if let Some(host) = self.host {
            host.unlock();
        }
    }
}

/// A timeline semaphore that rises by 1 with each frame that stays on the device.
pub(crate) struct Timeline {
    device: Device,
    raw: vk::Semaphore,
    value: Mutex<u64>,
}

impl Timeline {
    pub fn new(device: &Device) -> Result<Timeline> {
        let mut kind = vk::SemaphoreTypeCreateInfo::default()
            .semaphore_type(vk::SemaphoreType::TIMELINE)
            .initial_value(0);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: the device is live and has timeline semaphores.
        let raw = device.call("vkCreateSemaphore", |raw| unsafe {
            raw.create_semaphore(&info, None)
        })?;
        Ok(Timeline {
            device: device.clone(),
            raw,
            value: Mutex::new(0),
        })
    }

    /// Rises when everything is done that was submitted so far. Returns the value it will then have.
    pub fn rise(&self) -> Result<u64> {
        let mut value = self.value.lock().unwrap_or_else(PoisonError::into_inner);
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.raw)
            .value(*value + 1)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit = [vk::SubmitInfo2::default().signal_semaphore_infos(&signals)];
        // SAFETY: device and semaphore are live, and the value is above all that it had.
        self.device.call("vkQueueSubmit2", |raw| unsafe {
            raw.queue_submit2(self.device.queue().raw(), &submit, vk::Fence::null())
        })?;
        *value += 1;
        Ok(*value)
    }

    pub fn raw(&self) -> vk::Semaphore {
        self.raw
    }
}

impl Drop for Timeline {
    fn drop(&mut self) {
        let value = *self.value.lock().unwrap_or_else(PoisonError::into_inner);
        let semaphores = [self.raw];
        let values = [value];
        let wait = vk::SemaphoreWaitInfo::default()
            .semaphores(&semaphores)
            .values(&values);
        // SAFETY: device and semaphore are live; what was submitted to signal it is waited for. On a lost device there is
        // nothing to wait for.
        unsafe {
            let _ = self.device.raw().wait_semaphores(&wait, u64::MAX);
            self.device.raw().destroy_semaphore(self.raw, None);
        }
    }
}

impl fmt::Debug for Timeline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Timeline").field(&self.raw).finish()
    }
}

#[cfg(test)]
mod tests;
