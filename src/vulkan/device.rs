//! The logical device, its queue and its memory allocator.

use std::sync::{Arc, Mutex, MutexGuard};

use ash::{khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

#[cfg(feature = "test-hooks")]
use super::{Fault, FaultCount};
use super::{
    MemoryUse, failed,
    faults::Faults,
    host::{HostVulkan, QueueGuard, SharedQueue},
    instance::{DeviceInfo, Instance},
    memory::Memory,
};
use crate::{Error, Result};

/// Which device to open.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// A discrete GPU before an integrated one before a CPU driver.
    #[default]
    Best,
    /// Place in [`Device::list`].
    Index(usize),
    /// Part of the device's name, upper and lower case alike.
    Name(String),
}

/// How to open a device.
#[derive(Debug, Clone, Default)]
pub struct DeviceOptions {
    pub choice: DeviceChoice,
    /// Turn the Khronos validation layer on; read what it says with [`Device::validation_messages`]. Some of its versions (1.3.239
    /// for one) crash now and then where a device is opened or closed while another thread is at work on another one
    /// (Vulkan-ValidationLayers issue 4391).
    pub validation: bool,
}

/// An open Vulkan device. Clones share it.
#[derive(Clone)]
pub struct Device {
    shared: Arc<Shared>,
}

struct Shared {
    raw: ash::Device,
    push_descriptor: khr::push_descriptor::Device,
    queue: SharedQueue,
    queue_family: u32,
    is_hosts: bool,
    /// Taken out before the device is destroyed.
    memory: Mutex<Option<Memory>>,
    condition: Mutex<Condition>,
    faults: Faults,
    info: DeviceInfo,
    instance: Arc<Instance>,
}

/// How the device is.
#[derive(Debug, Clone, Copy)]
struct Condition {
    /// The last pass that is known to have begun.
    last_pass: &'static str,
    /// The call that told that the device is lost.
    lost_in: Option<&'static str>,
}

impl Device {
    /// Every Vulkan device of this machine, also those that camlux cannot use.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where there is no Vulkan loader, driver or device.
    pub fn list() -> Result<Vec<DeviceInfo>> {
        let devices = Instance::new(false)?.devices()?;
        Ok(devices.into_iter().map(|(_, info)| info).collect())
    }

    /// The device that [`DeviceChoice`] names in a list.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where none fits, or the one that fits lacks what camlux needs.
    pub fn choose<'l>(list: &'l [DeviceInfo], choice: &DeviceChoice) -> Result<&'l DeviceInfo> {
        let names = || {
            let name = |info: &DeviceInfo| format!("{} \"{}\"", info.index, info.name);
            let names: Vec<String> = list.iter().map(name).collect();
            format!("choose one of: {}", names.join(", "))
        };
        let none = |problem: String| Error::NoDevice {
            problem,
            hint: names(),
        };
        let chosen = match choice {
            DeviceChoice::Best => list
                .iter()
                .filter(|info| info.unusable.is_none())
                .min_by_key(|info| info.kind)
                .ok_or_else(|| Error::NoDevice {
                    problem: list
                        .iter()
                        .filter_map(|info| Some(format!("{} lacks {}", info.name, info.unusable.as_ref()?)))
                        .collect::<Vec<_>>()
                        .join(", "),
                    hint: "update the driver, or install a CPU driver, on Debian: apt-get install mesa-vulkan-drivers".into(),
                })?,
            DeviceChoice::Index(index) => list
                .iter()
                .find(|info| info.index == *index)
                .ok_or_else(|| none(format!("there is no device {index}")))?,
            DeviceChoice::Name(name) => list
                .iter()
                .find(|info| info.name.to_lowercase().contains(&name.to_lowercase()))
                .ok_or_else(|| none(format!("no device is called \"{name}\"")))?,
        };
        match &chosen.unusable {
            None => Ok(chosen),
            Some(lack) => Err(none(format!("{} lacks {lack}", chosen.name))),
        }
    }

    /// Opens a device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where none fits; [`Error::Vulkan`] where the driver fails.
    pub fn open(options: &DeviceOptions) -> Result<Device> {
        let instance = Instance::new(options.validation)?;
        let devices = instance.devices()?;
        let list: Vec<DeviceInfo> = devices.iter().map(|(_, info)| info.clone()).collect();
        let info = Device::choose(&list, &options.choice)?.clone();
        let physical = devices[info.index].0;
        let queue_family = instance
            .queue_family(physical)
            .ok_or_else(|| Error::NoDevice {
                problem: format!("{} has no queue for graphics and compute", info.name),
                hint: "choose another device".into(),
            })?;

        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(queue_family)
            .queue_priorities(&[1.0])];
        let extensions = [khr::push_descriptor::NAME.as_ptr()];
        // Of Vulkan 1.2, where every device has it.
        let mut features12 = vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true);
        let mut features13 = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .synchronization2(true);
        let create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut features12)
            .push_next(&mut features13);
        // SAFETY: extension and features were found by `Instance::lacks`; all pointers live until after the call.
        let raw = unsafe { instance.raw.create_device(physical, &create, None) }
            .map_err(failed("vkCreateDevice"))?;
        // SAFETY: one queue of this family was asked for.
        let queue = unsafe { raw.get_device_queue(queue_family, 0) };
        let queue = SharedQueue::new(queue, None);
        Device::of(instance, physical, raw, (queue, queue_family), info, false)
    }

    /// A host's device.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where the device lacks what camlux needs.
    ///
    /// # Safety
    /// The handles are live, belong together, and outlive the device that is returned and everything made from it; the
    /// create info is the one that the host's device was made with.
    pub unsafe fn of_host(host: &HostVulkan) -> Result<Device> {
        // SAFETY: promised by the caller.
        let (instance, raw) = unsafe { host.load() }?;
        let info = instance.describe(0, host.physical_device);
        if let Some(lack) = &info.unusable {
            return Err(Error::NoDevice {
                problem: format!("{} lacks {lack}", info.name),
                hint: "choose another device".into(),
            });
        }
        let queue = SharedQueue::new(host.queue, host.queue_lock.clone());
        let queue = (queue, host.queue_family);
        Device::of(instance, host.physical_device, raw, queue, info, true)
    }

    fn of(
        instance: Arc<Instance>,
        physical: vk::PhysicalDevice,
        raw: ash::Device,
        (queue, queue_family): (SharedQueue, u32),
        info: DeviceInfo,
        is_hosts: bool,
    ) -> Result<Device> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        });
        let shared = Shared {
            push_descriptor: khr::push_descriptor::Device::new(&instance.raw, &raw),
            raw,
            queue,
            queue_family,
            is_hosts,
            memory: Mutex::new(None),
            condition: Mutex::new(Condition {
                last_pass: "none",
                lost_in: None,
            }),
            faults: Faults::default(),
            info,
            instance,
        };
        let allocator = allocator.map_err(|error| Error::Memory {
            what: "the allocator".into(),
            bytes: 0,
            problem: error.to_string(),
        })?;
        *lock(&shared.memory) = Some(Memory::new(allocator));
        Ok(Device {
            shared: Arc::new(shared),
        })
    }

    /// What the device is.
    pub fn info(&self) -> &DeviceInfo {
        &self.shared.info
    }

    /// Warnings and errors of the Khronos validation layer since the device was opened; empty without it.
    pub fn validation_messages(&self) -> Vec<String> {
        self.shared.instance.messages()
    }

    /// What buffers and images hold of the device's memory. Between renders that is what renderers keep.
    pub fn memory_use(&self) -> MemoryUse {
        self.with_memory(|memory| memory.usage())
            .unwrap_or_default()
    }

    /// Asks for something to go wrong, or for nothing; counts, and takes the peak of the memory, from here on.
    #[cfg(feature = "test-hooks")]
    #[doc(hidden)]
    pub fn inject(&self, fault: Option<Fault>) {
        self.shared.faults.ask(fault);
        self.with_memory(Memory::forget_peak);
    }

    /// What there was since a fault was last asked for.
    #[cfg(feature = "test-hooks")]
    #[doc(hidden)]
    pub fn fault_count(&self) -> FaultCount {
        self.shared.faults.count()
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

    /// Of a lost device nothing more is asked.
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

    /// After a submission: the last pass that has begun, for all that is known.
    pub(super) fn note_pass(&self, pass: &'static str) {
        lock(&self.shared.condition).last_pass = pass;
    }

    /// From here on the device is lost, as `call` told.
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

    pub(super) fn push_descriptor(&self) -> &khr::push_descriptor::Device {
        &self.shared.push_descriptor
    }

    pub(super) fn queue(&self) -> QueueGuard<'_> {
        self.shared.queue.lock()
    }

    pub(crate) fn queue_family(&self) -> u32 {
        self.shared.queue_family
    }

    /// Runs `use_it` on the memory, which is there as long as the device is.
    pub(super) fn with_memory<T>(&self, use_it: impl FnOnce(&mut Memory) -> T) -> Option<T> {
        lock(&self.shared.memory).as_mut().map(use_it)
    }
}

/// A panic while the lock was held leaves nothing half done here: the guarded values are handles.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl Drop for Shared {
    fn drop(&mut self) {
        // SAFETY: buffers, images, pipelines and recorders hold a clone of the device, so none is left.
        unsafe {
            if self.is_hosts {
                // Every submission was waited for, and what else the host does is not to be waited for.
                drop(lock(&self.memory).take());
                return;
            }
            // Fails where the device is lost, which leaves nothing to wait for.
            let _ = self.raw.device_wait_idle();
            drop(lock(&self.memory).take());
            self.raw.destroy_device(None);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{path::Path, sync::Arc};

    use super::{super::Fault, Device, DeviceOptions, Instance};
    use crate::{
        RenderOptions, Renderer, Result, Scene,
        output::Frame,
        scene::{IndirectLight, VplSum},
    };

    fn open() -> Device {
        Device::open(&DeviceOptions {
            validation: true,
            ..DeviceOptions::default()
        })
        .expect("scripts/test installs a driver and the layer")
    }

    fn render(renderer: &mut Renderer) -> Result<Frame> {
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/glossy.toml");
        let mut scene = Scene::load(&scene).expect("a demo scene loads");
        scene.camera.resolution_px = [8, 8];
        scene.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 8));
        renderer.render(&scene, &mut RenderOptions::default())
    }

    /// Closes a device that nothing else holds. What was made from it and not destroyed is only told then.
    #[track_caller]
    fn assert_nothing_is_left(device: Device) {
        let instance: Arc<Instance> = device.shared.instance.clone();
        assert_eq!(Arc::strong_count(&device.shared), 1);
        drop(device);
        assert_eq!(Arc::strong_count(&instance), 1);
        assert_eq!(instance.messages(), [""; 0]);
    }

    #[test]
    fn nothing_is_left_when_the_device_closes() {
        let device = open();
        render(&mut Renderer::new(&device).expect("a renderer")).expect("the scene renders");
        assert_nothing_is_left(device);
    }

    /// No object of any kind, be it one without memory.
    #[test]
    fn nothing_is_left_when_calls_have_failed() {
        let device = open();
        let mut renderer = Renderer::new(&device).expect("a renderer");
        for call in 0.. {
            device.inject(Some(Fault::OutOfMemory {
                function: None,
                call,
            }));
            if render(&mut renderer).is_ok() {
                break;
            }
        }
        drop(renderer);
        assert_nothing_is_left(device);
    }

    #[test]
    fn nothing_is_left_when_the_device_was_lost() {
        let device = open();
        let mut renderer = Renderer::new(&device).expect("a renderer");
        device.inject(Some(Fault::DeviceLostIn { pass: "gather" }));
        render(&mut renderer).expect_err("it is lost");
        drop(renderer);
        assert_nothing_is_left(device);
    }
}
