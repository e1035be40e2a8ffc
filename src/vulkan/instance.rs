//! The Vulkan instance and the devices that it offers.

use std::{
    ffi::{CStr, c_void},
    fmt,
    sync::{Arc, Mutex},
};

use ash::{
    ext, khr,
    vk::{
        self, DebugUtilsMessageSeverityFlagsEXT as Severity,
        DebugUtilsMessageTypeFlagsEXT as MessageType, FormatFeatureFlags as Usable,
    },
};

use super::{
    failed, host_memory, lock,
    memory::{COLOR_FORMAT, DEPTH_FORMAT},
    no_device,
    quirks::Quirks,
};
use crate::Result;

const INSTALL_DRIVER: &str = "install a Vulkan driver, on Debian: apt-get install libvulkan1 mesa-vulkan-drivers; if one is installed, set VK_LOADER_DEBUG=error,driver to see why the loader does not use it";

/// Describes a Vulkan device, and whether camlux can use it.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceInfo {
    /// Index in the loader's list.
    pub index: usize,
    pub name: String,
    /// Stays the same after a restart: 32 hexadecimal digits in groups.
    pub uuid: String,
    /// PCI address, if the driver reports it: `0000:65:00.0`.
    pub pci: Option<String>,
    pub kind: DeviceKind,
    /// Name and version of the driver.
    pub driver: String,
    /// Vulkan version that the device offers.
    pub api_version: String,
    /// Whether the device's own units can trace rays for kernels (`VK_KHR_ray_query`).
    pub has_ray_query: bool,
    pub limits: DeviceLimits,
    pub quirks: Quirks,
    /// What camlux needs and this device lacks; `None`: camlux can use it.
    pub unusable: Option<String>,
}

/// Order of preference: a discrete GPU first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    Discrete,
    Integrated,
    Virtual,
    Cpu,
    Other,
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            DeviceKind::Discrete => "discrete GPU",
            DeviceKind::Integrated => "integrated GPU",
            DeviceKind::Virtual => "virtual GPU",
            DeviceKind::Cpu => "CPU driver",
            DeviceKind::Other => "other",
        })
    }
}

/// Extensions for rays traced by the device's own units.
pub(super) const RAY_QUERY_EXTENSIONS: [&CStr; 3] = [
    khr::acceleration_structure::NAME,
    khr::deferred_host_operations::NAME,
    khr::ray_query::NAME,
];

/// The limits that bound what can be rendered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceLimits {
    /// Largest width and height of an image.
    pub max_image_px: u32,
    pub max_image_layers: u32,
    /// Largest range of a storage buffer that a shader can access.
    pub max_storage_buffer_bytes: u64,
    pub max_allocation_bytes: u64,
    /// Largest buffer.
    pub max_buffer_bytes: u64,
    /// The device's own memory, or the part of it that was free when the device was listed, if the driver reports that. For CPU drivers
    /// the host's free memory, if the system reports it.
    pub memory_bytes: u64,
    /// Storage images that one shader can access.
    pub max_storage_images: u32,
    /// Workgroup memory.
    pub shared_memory_bytes: u32,
    pub subgroup_lanes: u32,
    /// Lanes of every subgroup of a kernel, if they support broadcasts and sums. `None`: kernels do without these.
    pub broadcast_lanes: Option<u32>,
    /// The rasteriser rounds corners of triangles to 2⁻ᵇⁱᵗˢ of a pixel.
    pub sub_pixel_bits: u32,
    /// Nanoseconds of a GPU timestamp tick. `None`: there are no timestamps, and passes share the time of their submission.
    pub timestamp_period_ns: Option<f32>,
}

/// A live instance. With validation it collects the messages of the Khronos layer.
pub(super) struct Instance {
    pub raw: ash::Instance,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// On the heap and shared, because the layer holds a pointer to it.
    messages: Arc<Mutex<Vec<String>>>,
    // The loader must outlive everything that was made from it. `None`: the instance is a host's.
    entry: Option<ash::Entry>,
}

impl Instance {
    pub fn new(validation: bool) -> Result<Arc<Self>> {
        // SAFETY: loading the Vulkan loader runs its initialisers, which is its intended use.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| {
            let problem = format!("the Vulkan loader cannot be opened ({error})");
            no_device(problem, INSTALL_DRIVER)
        })?;
        let application = vk::ApplicationInfo::default()
            .engine_name(c"camlux")
            .api_version(vk::API_VERSION_1_3);
        let messages: Arc<Mutex<Vec<String>>> = Arc::default();
        let mut messenger_info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(Severity::WARNING | Severity::ERROR)
            .message_type(MessageType::VALIDATION | MessageType::PERFORMANCE)
            .pfn_user_callback(Some(collect_message))
            .user_data(Arc::as_ptr(&messages).cast_mut().cast());
        let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
        let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
        let mut extensions = Vec::new();
        let mut info = vk::InstanceCreateInfo::default().application_info(&application);
        // Drivers on top of another interface, such as MoltenVK, are listed only on request.
        // SAFETY: the loader is open.
        let offered = unsafe { entry.enumerate_instance_extension_properties(None) };
        let portability = khr::portability_enumeration::NAME;
        let offers = |offered: &vk::ExtensionProperties| {
            offered.extension_name_as_c_str() == Ok(portability)
        };
        if offered.unwrap_or_default().iter().any(offers) {
            extensions.push(portability.as_ptr());
            info = info.flags(vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR);
        }
        if validation {
            extensions.push(ext::debug_utils::NAME.as_ptr());
            extensions.push(ext::validation_features::NAME.as_ptr());
            info = info
                .enabled_layer_names(&layers)
                .push_next(&mut messenger_info)
                .push_next(&mut features);
        }
        info = info.enabled_extension_names(&extensions);
        // SAFETY: all pointers in `info` live until after the call; `messages` lives as long as the instance.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => {
                no_device("the Vulkan loader found no driver", INSTALL_DRIVER)
            }
            vk::Result::ERROR_LAYER_NOT_PRESENT => no_device(
                "the Khronos validation layer is not installed",
                "turn validation off, or on Debian: apt-get install vulkan-validationlayers",
            ),
            result => failed("vkCreateInstance")(result),
        })?;
        let mut instance = Instance {
            raw,
            messenger: None,
            messages,
            entry: Some(entry),
        };
        if let (true, Some(entry)) = (validation, &instance.entry) {
            let functions = ext::debug_utils::Instance::new(entry, &instance.raw);
            messenger_info.p_next = std::ptr::null();
            // SAFETY: the extension is enabled; the callback's data lives as long as the instance.
            let messenger =
                unsafe { functions.create_debug_utils_messenger(&messenger_info, None) }
                    .map_err(failed("vkCreateDebugUtilsMessengerEXT"))?;
            instance.messenger = Some((functions, messenger));
        }
        Ok(Arc::new(instance))
    }

    /// A host's instance, which it keeps alive and destroys.
    pub fn of_host(raw: ash::Instance) -> Arc<Self> {
        Arc::new(Instance {
            raw,
            messenger: None,
            messages: Arc::default(),
            entry: None,
        })
    }

    pub fn is_hosts(&self) -> bool {
        self.entry.is_none()
    }

    /// Messages of the validation layer so far.
    pub fn messages(&self) -> Vec<String> {
        lock(&self.messages).clone()
    }

    /// Every device with its description.
    pub fn devices(&self) -> Result<(Vec<vk::PhysicalDevice>, Vec<DeviceInfo>)> {
        // SAFETY: the instance is live.
        let found = unsafe { self.raw.enumerate_physical_devices() }
            .map_err(failed("vkEnumeratePhysicalDevices"))?;
        if found.is_empty() {
            return Err(no_device(
                "the Vulkan loader found no device",
                INSTALL_DRIVER,
            ));
        }
        let infos = found.iter().enumerate();
        let infos = infos.map(|(index, &device)| self.describe(index, device));
        Ok((found.clone(), infos.collect()))
    }

    pub fn describe(&self, index: usize, device: vk::PhysicalDevice) -> DeviceInfo {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
        let mut maintenance3 = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut vulkan13 = vk::PhysicalDeviceVulkan13Properties::default();
        let mut id = vk::PhysicalDeviceIDProperties::default();
        let mut pci = vk::PhysicalDevicePCIBusInfoPropertiesEXT::default();
        let has_pci = self.has_extension(device, ext::pci_bus_info::NAME);
        let mut properties = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut id)
            .push_next(&mut driver)
            .push_next(&mut subgroup)
            .push_next(&mut maintenance3)
            .push_next(&mut vulkan13);
        if has_pci {
            properties = properties.push_next(&mut pci);
        }
        let instance = &self.raw;
        // SAFETY: the instance is live and the device is its own.
        unsafe { instance.get_physical_device_properties2(device, &mut properties) };
        let properties = properties.properties;
        let limits = properties.limits;
        let version = properties.api_version;
        DeviceInfo {
            index,
            name: text(properties.device_name_as_c_str()),
            uuid: uuid_text(id.device_uuid),
            pci: has_pci.then(|| {
                format!(
                    "{:04x}:{:02x}:{:02x}.{:x}",
                    pci.pci_domain, pci.pci_bus, pci.pci_device, pci.pci_function
                )
            }),
            kind: match properties.device_type {
                vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
                vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
                vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
                vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
                _ => DeviceKind::Other,
            },
            driver: format!(
                "{} {}",
                text(driver.driver_name_as_c_str()),
                text(driver.driver_info_as_c_str())
            ),
            api_version: format!(
                "{}.{}.{}",
                vk::api_version_major(version),
                vk::api_version_minor(version),
                vk::api_version_patch(version)
            ),
            quirks: Quirks::of(driver.driver_id),
            has_ray_query: self.has_ray_query(device),
            limits: DeviceLimits {
                max_image_px: limits
                    .max_image_dimension2_d
                    .min(limits.max_framebuffer_width)
                    .min(limits.max_framebuffer_height),
                max_image_layers: limits.max_image_array_layers,
                max_storage_buffer_bytes: limits.max_storage_buffer_range.into(),
                max_allocation_bytes: maintenance3.max_memory_allocation_size,
                max_buffer_bytes: vulkan13.max_buffer_size,
                memory_bytes: match properties.device_type {
                    vk::PhysicalDeviceType::CPU => host_memory::available_bytes(),
                    _ => None,
                }
                .unwrap_or_else(|| self.heap_bytes(device)),
                max_storage_images: limits.max_per_stage_descriptor_storage_images,
                shared_memory_bytes: limits.max_compute_shared_memory_size,
                subgroup_lanes: subgroup.subgroup_size,
                broadcast_lanes: broadcast_lanes(&subgroup, &vulkan13),
                sub_pixel_bits: limits.sub_pixel_precision_bits,
                timestamp_period_ns: self
                    .queue_families(device)
                    .first()
                    .and_then(|&family| self.timestamp_period_ns(device, family)),
            },
            unusable: self.lacks(device, properties.api_version).map(String::from),
        }
    }

    /// Bytes of the device's largest own heap.
    fn heap_bytes(&self, device: vk::PhysicalDevice) -> u64 {
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut memory = vk::PhysicalDeviceMemoryProperties2::default();
        if self.has_extension(device, ext::memory_budget::NAME) {
            memory = memory.push_next(&mut budget);
        }
        let instance = &self.raw;
        // SAFETY: the instance is live and the device is its own.
        unsafe { instance.get_physical_device_memory_properties2(device, &mut memory) };
        let memory = memory.memory_properties;
        let heaps = memory.memory_heaps_as_slice().iter().enumerate();
        heaps
            .filter(|(_, heap)| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
            .map(|(index, heap)| match budget.heap_budget[index] {
                0 => heap.size,
                free => free.min(heap.size),
            })
            .max()
            .unwrap_or_default()
    }

    pub fn has_extension(&self, device: vk::PhysicalDevice, name: &CStr) -> bool {
        // SAFETY: the instance is live and the device is its own.
        let extensions = unsafe { self.raw.enumerate_device_extension_properties(device) };
        extensions
            .unwrap_or_default()
            .iter()
            .any(|extension| extension.extension_name_as_c_str() == Ok(name))
    }

    /// Whether the device's own units can trace rays for kernels.
    fn has_ray_query(&self, device: vk::PhysicalDevice) -> bool {
        if !RAY_QUERY_EXTENSIONS
            .iter()
            .all(|name| self.has_extension(device, name))
        {
            return false;
        }
        let mut structures = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
        let mut queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
        let mut features12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut structures)
            .push_next(&mut queries)
            .push_next(&mut features12);
        // SAFETY: the instance is live and the device is its own.
        unsafe {
            self.raw
                .get_physical_device_features2(device, &mut features)
        };
        structures.acceleration_structure != 0
            && queries.ray_query != 0
            && features12.buffer_device_address != 0
    }

    /// What camlux needs and the device lacks.
    fn lacks(&self, device: vk::PhysicalDevice, api_version: u32) -> Option<&'static str> {
        if api_version < vk::API_VERSION_1_3 {
            return Some("Vulkan 1.3");
        }
        let mut features13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut features13);
        let instance = &self.raw;
        // SAFETY: the instance is live and the device is its own.
        unsafe { instance.get_physical_device_features2(device, &mut features) };
        if features13.dynamic_rendering == 0 || features13.synchronization2 == 0 {
            return Some("dynamic rendering and synchronization2");
        }
        if self.queue_families(device).is_empty() {
            return Some("a queue for graphics and compute");
        }
        let offers = |format, wanted| {
            // SAFETY: as above.
            let found = unsafe { instance.get_physical_device_format_properties(device, format) };
            found.optimal_tiling_features.contains(wanted)
        };
        let color = Usable::COLOR_ATTACHMENT | Usable::STORAGE_IMAGE | Usable::SAMPLED_IMAGE;
        let depth = Usable::DEPTH_STENCIL_ATTACHMENT;
        let offers_both = offers(COLOR_FORMAT, color) && offers(DEPTH_FORMAT, depth);
        (!offers_both).then_some("rendering to 32-bit float images")
    }

    /// Queue families that support graphics and compute; those with timestamps come first.
    pub fn queue_families(&self, device: vk::PhysicalDevice) -> Vec<u32> {
        // SAFETY: the instance is live and the device is its own.
        let families = unsafe { self.raw.get_physical_device_queue_family_properties(device) };
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let mut fitting: Vec<usize> = (0..families.len()).collect();
        fitting.retain(|&index| families[index].queue_flags.contains(wanted));
        fitting.sort_by_key(|&index| families[index].timestamp_valid_bits == 0);
        fitting.into_iter().map(|index| index as u32).collect()
    }

    /// Nanoseconds of a timestamp tick of a queue family; `None`: it has no timestamps.
    pub fn timestamp_period_ns(&self, device: vk::PhysicalDevice, family: u32) -> Option<f32> {
        // SAFETY (both calls): the instance is live and the device is its own.
        let families = unsafe { self.raw.get_physical_device_queue_family_properties(device) };
        let limits = unsafe { self.raw.get_physical_device_properties(device) }.limits;
        let takes = families.get(family as usize)?.timestamp_valid_bits > 0;
        takes.then_some(limits.timestamp_period)
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: devices hold an `Arc` of the instance, so nothing made from it is left.
        unsafe {
            if let Some((functions, messenger)) = self.messenger.take() {
                functions.destroy_debug_utils_messenger(messenger, None);
            }
            if !self.is_hosts() {
                self.raw.destroy_instance(None);
            }
        }
    }
}

fn uuid_text(uuid: [u8; 16]) -> String {
    let digits: String = uuid.iter().map(|byte| format!("{byte:02x}")).collect();
    let groups = [0..8, 8..12, 12..16, 16..20, 20..32].map(|group| &digits[group]);
    groups.join("-")
}

fn broadcast_lanes(
    subgroup: &vk::PhysicalDeviceSubgroupProperties,
    vulkan13: &vk::PhysicalDeviceVulkan13Properties,
) -> Option<u32> {
    let operations = vk::SubgroupFeatureFlags::BALLOT | vk::SubgroupFeatureFlags::ARITHMETIC;
    let in_kernels = subgroup
        .supported_stages
        .contains(vk::ShaderStageFlags::COMPUTE);
    // Otherwise drivers choose the number of lanes for each kernel.
    let is_fixed = vulkan13.min_subgroup_size == vulkan13.max_subgroup_size;
    let fits = in_kernels && is_fixed && subgroup.supported_operations.contains(operations);
    fits.then_some(subgroup.subgroup_size)
}

fn text(name: std::result::Result<&CStr, impl fmt::Debug>) -> String {
    name.map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default()
}

/// Called by the validation layer.
unsafe extern "system" fn collect_message(
    _: Severity,
    _: MessageType,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer hands valid data, and `messages` is the instance's own list, which outlives it.
    let (data, messages) = unsafe { (&*data, &*messages.cast::<Mutex<Vec<String>>>()) };
    // SAFETY: a message is a C string that lives as long as the call.
    let text = unsafe { data.message_as_c_str() };
    if let (Some(text), Ok(mut messages)) = (text, messages.lock()) {
        messages.push(text.to_string_lossy().into_owned());
    }
    vk::FALSE
}
