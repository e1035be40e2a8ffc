//! The logical device, its queue and its memory allocator.

use std::{
    any::Any,
    ffi::CStr,
    mem::ManuallyDrop,
    sync::{Arc, Mutex, MutexGuard, Weak},
};

use ash::{khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

#[cfg(feature = "test-hooks")]
use super::{Fault, FaultCount};
use super::{
    MemoryUse,
    device_choice::DeviceChoice,
    failed,
    faults::Faults,
    host::{HostVulkan, QueueLock},
    instance::{DeviceInfo, Instance, RAY_QUERY_EXTENSIONS},
    lock,
    memory::Memory,
    no_device,
    pipeline::Pipelines,
};
use crate::{Error, Result};

/// How to open a device.
#[derive(Debug, Clone, Default)]
pub struct DeviceOptions {
    pub choice: DeviceChoice,
    /// Enables the Khronos validation layer. Read its messages with [`Device::validation_messages`]. Some versions (such as 1.3.239)
    /// occasionally crash when a device is opened or closed while another thread uses another one (Vulkan-ValidationLayers issue 4391).
    pub validation: bool,
}

/// An open Vulkan device. Clones share it.
#[derive(Clone)]
pub struct Device {
    shared: Arc<Shared>,
}

struct Shared {
    raw: ash::Device,
    /// Locked during a submission.
    queue: Mutex<vk::Queue>,
    queue_family: u32,
    /// The host's lock around its queue.
    queue_lock: Option<Arc<dyn QueueLock>>,
    /// Dropped before the device is destroyed.
    memory: ManuallyDrop<Mutex<Memory>>,
    condition: Mutex<Condition>,
    /// Those that its users hold.
    pipelines: Mutex<Weak<Pipelines>>,
    shared_by_renderers: Mutex<Option<Weak<dyn Any + Send + Sync>>>,
    faults: Faults,
    info: DeviceInfo,
    /// Present if the device's own units can trace rays.
    acceleration_structures: Option<khr::acceleration_structure::Device>,
    /// Present if memory can be exported.
    external_memory_fd: Option<khr::external_memory_fd::Device>,
    physical: vk::PhysicalDevice,
    instance: Arc<Instance>,
}

/// The state of the device.
#[derive(Debug, Clone, Copy)]
struct Condition {
    /// The last pass known to have begun.
    last_pass: &'static str,
    /// The call that reported the device loss.
    lost_in: Option<&'static str>,
}

impl Device {
    /// Every Vulkan device of this machine, including those that camlux cannot use.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if there is no Vulkan loader, driver or device.
    pub fn list() -> Result<Vec<DeviceInfo>> {
        let (_, list) = Instance::new(false)?.devices()?;
        Ok(list)
    }

    /// Opens a device. For [`DeviceChoice::Best`], the environment variable `CAMLUX_DEVICE` chooses if it is set: an index, a name, a UUID
    /// or a PCI address.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if no device matches; [`Error::Vulkan`] if the driver fails.
    pub fn open(options: &DeviceOptions) -> Result<Device> {
        let instance = Instance::new(options.validation)?;
        let (physical, list) = instance.devices()?;
        let of_environment = std::env::var("CAMLUX_DEVICE")
            .ok()
            .filter(|text| options.choice == DeviceChoice::Best && !text.is_empty());
        let info = match of_environment {
            None => options.choice.among(&list)?,
            Some(text) => {
                let choice = DeviceChoice::from(text.as_str());
                choice.among(&list).map_err(|error| match error {
                    Error::NoDevice { problem, hint } => {
                        no_device(format!("CAMLUX_DEVICE is {text:?}: {problem}"), hint)
                    }
                    other => other,
                })?
            }
        }
        .clone();
        let physical = physical[info.index];
        let queue_family = *instance
            .queue_families(physical)
            .first()
            .ok_or_else(|| Error::internal("a device without a queue was chosen"))?;
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(queue_family)
            .queue_priorities(&[1.0])];
        // Every device with Vulkan 1.2 supports timeline semaphores.
        let mut features12 = vk::PhysicalDeviceVulkan12Features::default()
            .timeline_semaphore(true)
            .buffer_device_address(info.has_ray_query);
        let mut features13 = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .synchronization2(true);
        let mut structures = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default()
            .acceleration_structure(true);
        let mut queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
        // Enabled if available. The first one is present on devices that lack some part of Vulkan 1.3.
        let wherever_it_is = [khr::portability_subset::NAME, khr::external_memory_fd::NAME];
        let mut extensions: Vec<_> = wherever_it_is
            .iter()
            .filter(|name| instance.has_extension(physical, name))
            .map(|name| name.as_ptr())
            .collect();
        if info.has_ray_query {
            extensions.extend(RAY_QUERY_EXTENSIONS.map(CStr::as_ptr));
        }
        let mut create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut features12)
            .push_next(&mut features13);
        if info.has_ray_query {
            create = create.push_next(&mut structures).push_next(&mut queries);
        }
        // SAFETY: `Instance::lacks` found the features present; all pointers live until after the call.
        let raw = unsafe { instance.raw.create_device(physical, &create, None) }
            .map_err(failed("vkCreateDevice"))?;
        // SAFETY: one queue of this family was requested.
        let queue = unsafe { raw.get_device_queue(queue_family, 0) };
        Device::new(instance, physical, raw, queue, queue_family, None, info)
    }

    /// Uses a host's device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if the device lacks something camlux needs.
    ///
    /// # Safety
    /// The handles are live, belong together, and outlive the device that is returned and everything made from it; the
    /// create info is the one that the host's device was made with.
    pub unsafe fn of_host(host: &HostVulkan) -> Result<Device> {
        // SAFETY: promised by the caller.
        let (instance, raw) = unsafe { host.load() }?;
        let mut info = instance.describe(0, host.physical_device);
        // The host may not have enabled it.
        info.has_ray_query = false;
        info.limits.timestamp_period_ns =
            instance.timestamp_period_ns(host.physical_device, host.queue_family);
        if let Some(lack) = &info.unusable {
            let problem = format!("{} lacks {lack}", info.name);
            return Err(no_device(problem, "choose another device"));
        }
        let HostVulkan {
            physical_device,
            queue,
            queue_family,
            ..
        } = *host;
        let queue_lock = host.queue_lock.clone();
        Device::new(
            instance,
            physical_device,
            raw,
            queue,
            queue_family,
            queue_lock,
            info,
        )
    }

    fn new(
        instance: Arc<Instance>,
        physical: vk::PhysicalDevice,
        raw: ash::Device,
        queue: vk::Queue,
        queue_family: u32,
        queue_lock: Option<Arc<dyn QueueLock>>,
        info: DeviceInfo,
    ) -> Result<Device> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: info.has_ray_query,
            allocation_sizes: Default::default(),
        });
        let allocator = allocator.map_err(|error| {
            if !instance.is_hosts() {
                // SAFETY: nothing was made from the device.
                unsafe { raw.destroy_device(None) };
            }
            Error::Memory {
                what: "the allocator".into(),
                bytes: 0,
                problem: error.to_string(),
            }
        })?;
        let has_external_memory =
            !instance.is_hosts() && instance.has_extension(physical, khr::external_memory_fd::NAME);
        let external_memory_fd =
            has_external_memory.then(|| khr::external_memory_fd::Device::new(&instance.raw, &raw));
        let acceleration_structures = info
            .has_ray_query
            .then(|| khr::acceleration_structure::Device::new(&instance.raw, &raw));
        let shared = Shared {
            raw,
            acceleration_structures,
            external_memory_fd,
            physical,
            queue: Mutex::new(queue),
            queue_family,
            queue_lock,
            memory: ManuallyDrop::new(Mutex::new(Memory {
                allocator,
                usage: MemoryUse::default(),
            })),
            pipelines: Mutex::default(),
            shared_by_renderers: Mutex::default(),
            condition: Mutex::new(Condition {
                last_pass: "none",
                lost_in: None,
            }),
            faults: Faults::default(),
            info,
            instance,
        };
        Ok(Device {
            shared: Arc::new(shared),
        })
    }

    /// Describes the device.
    pub fn info(&self) -> &DeviceInfo {
        &self.shared.info
    }

    /// Warnings and errors of the Khronos validation layer since the device was opened; empty without the layer.
    pub fn validation_messages(&self) -> Vec<String> {
        self.shared.instance.messages()
    }

    /// Device memory held by buffers and images. Between renders this is what renderers keep.
    pub fn memory_use(&self) -> MemoryUse {
        self.memory().usage
    }

    /// Injects a fault, or none. Restarts the counts and the peak of the memory.
    #[cfg(feature = "test-hooks")]
    #[doc(hidden)]
    pub fn inject(&self, fault: Option<Fault>) {
        self.shared.faults.ask(fault);
        let usage = &mut self.memory().usage;
        (usage.peak_bytes, usage.largest_bytes) = (usage.bytes, 0);
    }

    /// Fills new buffers and images with NaN from here on, so that tests find reads of memory that was never written.
    #[cfg(feature = "test-hooks")]
    #[doc(hidden)]
    pub fn poison_memory(&self) {
        self.shared.faults.poison_memory();
    }

    /// Counts since the last call of `inject`.
    #[cfg(feature = "test-hooks")]
    #[doc(hidden)]
    pub fn fault_count(&self) -> FaultCount {
        self.shared.faults.count()
    }

    /// Closes the device and returns the validation layer's messages, including those about objects that were never destroyed. Returns
    /// `None` if something still holds the device.
    #[cfg(feature = "test-hooks")]
    #[doc(hidden)]
    pub fn close(self) -> Option<Vec<String>> {
        let instance = self.shared.instance.clone();
        drop(Arc::into_inner(self.shared)?);
        Some(instance.messages())
    }

    /// `None`: single passes cannot be timed.
    pub(super) fn timestamp_period_ns(&self) -> Option<f32> {
        let period_ns = self.info().limits.timestamp_period_ns;
        period_ns.filter(|_| !self.shared.faults.has_no_timestamps())
    }

    pub(super) fn faults(&self) -> &Faults {
        &self.shared.faults
    }

    /// Calls a Vulkan function that can fail.
    pub(super) fn call<T>(
        &self,
        name: &'static str,
        call: impl FnOnce(&ash::Device) -> ash::prelude::VkResult<T>,
    ) -> Result<T> {
        self.check()?;
        let result = if self.shared.faults.next_call_fails(name) {
            Err(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY)
        } else {
            call(&self.shared.raw)
        };
        result.map_err(|result| match result {
            vk::Result::ERROR_DEVICE_LOST => self.lose(name, None),
            other => failed(name)(other),
        })
    }

    /// The pipelines of the device, which all that render on it share. They stay as long as someone holds them.
    pub(crate) fn pipelines(&self) -> Arc<Pipelines> {
        let mut held = lock(&self.shared.pipelines);
        held.upgrade().unwrap_or_else(|| {
            let made = Arc::new(Pipelines::new(self));
            *held = Arc::downgrade(&made);
            made
        })
    }

    /// What all renderers of the device share, of a type of theirs. It stays as long as someone holds it.
    pub(crate) fn shared_by_renderers<T: Default + Send + Sync + 'static>(&self) -> Arc<T> {
        let mut held = lock(&self.shared.shared_by_renderers);
        let kept = held.as_ref().and_then(Weak::upgrade);
        kept.and_then(|kept| kept.downcast().ok())
            .unwrap_or_else(|| {
                let made = Arc::<T>::default();
                let any: Arc<dyn Any + Send + Sync> = made.clone();
                *held = Some(Arc::downgrade(&any));
                made
            })
    }

    /// Fails on a lost device, so that nothing more is called on it.
    pub(crate) fn check(&self) -> Result<()> {
        let condition = *lock(&self.shared.condition);
        match condition.lost_in {
            None => Ok(()),
            Some(call) => Err(Error::DeviceLost {
                pass: condition.last_pass,
                call,
            }),
        }
    }

    /// Records, after a submission, the last pass known to have begun.
    pub(super) fn note_pass(&self, pass: &'static str) {
        lock(&self.shared.condition).last_pass = pass;
    }

    /// Marks the device as lost, as `call` reported.
    pub(super) fn lose(&self, call: &'static str, last_pass: Option<&'static str>) -> Error {
        let mut condition = lock(&self.shared.condition);
        condition.lost_in = Some(call);
        condition.last_pass = last_pass.unwrap_or(condition.last_pass);
        Error::DeviceLost {
            pass: condition.last_pass,
            call,
        }
    }

    pub(super) fn raw(&self) -> &ash::Device {
        &self.shared.raw
    }

    /// `None` if the device cannot trace rays with its own units.
    pub(super) fn acceleration_structures(&self) -> Option<&khr::acceleration_structure::Device> {
        self.shared.acceleration_structures.as_ref()
    }

    /// `None` if the device exports no memory.
    pub(super) fn external_memory_fd(&self) -> Option<&khr::external_memory_fd::Device> {
        self.shared.external_memory_fd.as_ref()
    }

    /// What other devices and interfaces can do with the memory of such buffers.
    pub(super) fn exported_buffer_features(
        &self,
        usage: vk::BufferUsageFlags,
        handle: vk::ExternalMemoryHandleTypeFlags,
    ) -> vk::ExternalMemoryFeatureFlags {
        let info = vk::PhysicalDeviceExternalBufferInfo::default()
            .usage(usage)
            .handle_type(handle);
        let mut found = vk::ExternalBufferProperties::default();
        let Shared {
            instance, physical, ..
        } = &*self.shared;
        // SAFETY: the instance is live and the device is its own.
        unsafe {
            let raw = &instance.raw;
            raw.get_physical_device_external_buffer_properties(*physical, &info, &mut found);
        }
        found.external_memory_properties.external_memory_features
    }

    /// What the driver says of the device.
    pub(super) fn properties(&self) -> vk::PhysicalDeviceProperties {
        let Shared {
            instance, physical, ..
        } = &*self.shared;
        // SAFETY: the instance is live and the device is its own.
        unsafe { instance.raw.get_physical_device_properties(*physical) }
    }

    /// The properties of each memory type.
    pub(super) fn memory_types(&self) -> Vec<vk::MemoryPropertyFlags> {
        let Shared {
            instance, physical, ..
        } = &*self.shared;
        // SAFETY: the instance is live and the device is its own.
        let found = unsafe {
            instance
                .raw
                .get_physical_device_memory_properties(*physical)
        };
        let types = found.memory_types_as_slice().iter();
        types.map(|of| of.property_flags).collect()
    }

    /// Whether both are the same device.
    pub(super) fn is_same(&self, other: &Device) -> bool {
        Arc::ptr_eq(&self.shared, &other.shared)
    }

    /// Runs `submit` on the queue and locks out other users meanwhile.
    pub(super) fn with_queue<T>(&self, submit: impl FnOnce(vk::Queue) -> T) -> T {
        let queue = lock(&self.shared.queue);
        let host = self.shared.queue_lock.as_deref();
        if let Some(host) = host {
            host.lock();
        }
        let result = submit(*queue);
        if let Some(host) = host {
            host.unlock();
        }
        result
    }

    pub(crate) fn queue_family(&self) -> u32 {
        self.shared.queue_family
    }

    pub(super) fn memory(&self) -> MutexGuard<'_, Memory> {
        lock(&self.shared.memory)
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // SAFETY: buffers, images, pipelines and recorders hold a clone of the device, so none is left, and the memory is not
        // used again.
        unsafe {
            // camlux has waited for each of its submissions, and it does not wait for a host's other work. The call fails only on a lost
            // device, where nothing is left to wait for.
            if !self.instance.is_hosts() {
                let _ = self.raw.device_wait_idle();
            }
            ManuallyDrop::drop(&mut self.memory);
            if !self.instance.is_hosts() {
                self.raw.destroy_device(None);
            }
        }
    }
}
