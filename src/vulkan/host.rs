//! A device that a host made and keeps using, and what the host needs to use a frame's images on it.

use std::{
    ffi::{CStr, c_void},
    fmt::Display,
    sync::{Arc, Mutex},
};

use ash::vk;

use super::{Device, instance::Instance, lock, no_device};
use crate::{Error, Result};

/// A host's own Vulkan objects. They remain the host's: camlux destroys none of them.
///
/// The instance must be made for Vulkan 1.3, and the device with
/// - the features `dynamicRendering`, `synchronization2` and `timelineSemaphore`,
/// - a queue of a family that supports graphics and compute.
///
/// camlux checks all of this except the instance's version. Everything made from the camlux device must be gone before the host destroys
/// its own device.
pub struct HostVulkan {
    pub get_instance_proc_addr: vk::PFN_vkGetInstanceProcAddr,
    pub instance: vk::Instance,
    pub physical_device: vk::PhysicalDevice,
    pub device: vk::Device,
    /// The create info of the device. camlux reads the enabled features from it.
    pub device_create_info: *const vk::DeviceCreateInfo<'static>,
    pub queue: vk::Queue,
    pub queue_family: u32,
    /// Called around every submission to the queue; `None` if the host does not use the queue while camlux renders.
    pub queue_lock: Option<Arc<dyn QueueLock>>,
}

/// A host's lock around a queue that it shares with camlux.
pub trait QueueLock: Send + Sync {
    fn lock(&self);
    fn unlock(&self);
}

/// Functions that camlux cannot do without.
const NEEDED_FUNCTIONS: [&CStr; 3] = [
    c"vkQueueSubmit2",
    c"vkCmdBeginRendering",
    c"vkGetSemaphoreCounterValue",
];

impl HostVulkan {
    /// Loads the functions of the host's instance and device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] names what is missing.
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
            return Err(lacking("a handle is null"));
        }
        // SAFETY: promised by the caller.
        if let Some(lack) = unsafe { not_enabled(&*self.device_create_info) } {
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
                    "it has no {name}: create the instance for Vulkan 1.3"
                )));
            }
        }
        let instance = Instance::of_host(instance);
        let family = self.queue_family;
        let families = instance.queue_families(self.physical_device);
        if !families.contains(&family) {
            return Err(lacking(format!(
                "queue family {family} does not support graphics and compute"
            )));
        }
        Ok((instance, device))
    }
}

fn lacking(problem: impl Display) -> Error {
    let problem = format!("the host's device cannot be used: {problem}");
    no_device(
        problem,
        "see the requirements in the documentation of HostVulkan and camlux_vulkan_device",
    )
}

/// A feature that camlux needs and that the device was made without.
///
/// # Safety
/// The info is valid, including everything it points to.
unsafe fn not_enabled(info: &vk::DeviceCreateInfo) -> Option<&'static str> {
    let [
        mut dynamic_rendering,
        mut synchronization2,
        mut timeline_semaphore,
    ] = [vk::FALSE; 3];
    // SAFETY (all below): the chain is valid.
    unsafe {
        if let Some(of12) = find::<vk::PhysicalDeviceVulkan12Features>(info.p_next) {
            timeline_semaphore = of12.timeline_semaphore;
        }
        if let Some(of13) = find::<vk::PhysicalDeviceVulkan13Features>(info.p_next) {
            dynamic_rendering = of13.dynamic_rendering;
            synchronization2 = of13.synchronization2;
        }
        if let Some(of) = find::<vk::PhysicalDeviceTimelineSemaphoreFeatures>(info.p_next) {
            timeline_semaphore = of.timeline_semaphore;
        }
        if let Some(of) = find::<vk::PhysicalDeviceDynamicRenderingFeatures>(info.p_next) {
            dynamic_rendering = of.dynamic_rendering;
        }
        if let Some(of) = find::<vk::PhysicalDeviceSynchronization2Features>(info.p_next) {
            synchronization2 = of.synchronization2;
        }
    }
    let needed = [
        (
            dynamic_rendering != vk::FALSE,
            "the feature dynamicRendering",
        ),
        (
            synchronization2 != vk::FALSE,
            "the feature synchronization2",
        ),
        (
            timeline_semaphore != vk::FALSE,
            "the feature timelineSemaphore",
        ),
    ];
    needed
        .into_iter()
        .find_map(|(is_on, name)| (!is_on).then_some(name))
}

/// Finds the structure of this type in a chain.
///
/// # Safety
/// The chain is valid, and each of its structures has the type that it states.
unsafe fn find<'c, T: vk::TaggedStructure>(chain: *const c_void) -> Option<&'c T> {
    let mut next: *const vk::BaseInStructure = chain.cast();
    // SAFETY: promised by the caller.
    while let Some(structure) = unsafe { next.as_ref() } {
        if structure.s_type == T::STRUCTURE_TYPE {
            // SAFETY: it is of that type.
            return Some(unsafe { &*next.cast() });
        }
        next = structure.p_next;
    }
    None
}

/// A timeline semaphore whose value rises by 1 with each frame that stays on the device.
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

    /// Lets the value rise when all work submitted so far is done. Returns the value it then has.
    pub fn rise(&self) -> Result<u64> {
        let mut value = lock(&self.value);
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.raw)
            .value(*value + 1)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit = [vk::SubmitInfo2::default().signal_semaphore_infos(&signals)];
        // SAFETY: device and semaphore are live, and the value is greater than all previous ones.
        self.device.call("vkQueueSubmit2", |raw| {
            let fence = vk::Fence::null();
            self.device
                .with_queue(|queue| unsafe { raw.queue_submit2(queue, &submit, fence) })
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
        let semaphores = [self.raw];
        let values = [*lock(&self.value)];
        let wait = vk::SemaphoreWaitInfo::default()
            .semaphores(&semaphores)
            .values(&values);
        // SAFETY: device and semaphore are live, and this waits for the submissions that signal the semaphore. On a lost device there is
        // nothing to wait for.
        unsafe {
            let _ = self.device.raw().wait_semaphores(&wait, u64::MAX);
            self.device.raw().destroy_semaphore(self.raw, None);
        }
    }
}
