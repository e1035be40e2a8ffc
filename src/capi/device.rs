//! Devices.

use std::{
    ffi::c_char,
    sync::atomic::{AtomicUsize, Ordering},
};

use super::*;
use crate::{Device, DeviceChoice, DeviceInfo, DeviceKind, DeviceOptions};

/// The device that the environment variable CAMLUX_DEVICE names (an index, a name, a UUID or a PCI address). If it is not set: a discrete
/// GPU before an integrated one before a CPU driver.
pub const CAMLUX_DEVICE_BEST: i32 = 0;
/// The device with an index, as in camlux_device_get_info.
pub const CAMLUX_DEVICE_INDEX: i32 = 1;
/// The first device whose name contains a text, ignoring case.
pub const CAMLUX_DEVICE_NAME: i32 = 2;
/// The device with a UUID, given with or without hyphens.
pub const CAMLUX_DEVICE_UUID: i32 = 3;
/// The device at a PCI address, such as "0000:65:00.0" or "65:00.0".
pub const CAMLUX_DEVICE_PCI: i32 = 4;

/// A discrete GPU.
pub const CAMLUX_DEVICE_KIND_DISCRETE: i32 = 0;
/// A GPU that is integrated with the CPU.
pub const CAMLUX_DEVICE_KIND_INTEGRATED: i32 = 1;
/// A GPU of a virtual machine.
pub const CAMLUX_DEVICE_KIND_VIRTUAL: i32 = 2;
/// A driver that runs on the CPU, such as Mesa's lavapipe.
pub const CAMLUX_DEVICE_KIND_CPU: i32 = 3;
/// Any other kind.
pub const CAMLUX_DEVICE_KIND_OTHER: i32 = 4;

/// Which device to open, and how. Initialise with CAMLUX_DEVICE_OPTIONS_INIT: the best device, no validation.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_device_options {
    /// Set by CAMLUX_DEVICE_OPTIONS_INIT.
    pub struct_size: u32,
    /// CAMLUX_DEVICE_BEST, CAMLUX_DEVICE_INDEX, CAMLUX_DEVICE_NAME, CAMLUX_DEVICE_UUID or CAMLUX_DEVICE_PCI.
    pub choice: i32,
    /// With CAMLUX_DEVICE_INDEX: its index, from 0 to camlux_device_count - 1.
    pub index: u32,
    /// 1 turns on the Khronos validation layer, if it is installed. Use it for debugging; it is slow. Its messages go to the
    /// log as warnings, and camlux_device_validation_count counts them. Some versions of it (such as 1.3.239) sometimes crash when
    /// a device is opened or closed while another thread works on another device.
    pub validation: i32,
    /// With CAMLUX_DEVICE_NAME: part of the device's name, UTF-8. With CAMLUX_DEVICE_UUID or CAMLUX_DEVICE_PCI: the UUID or the address.
    pub name: *const c_char,
}

/// Description of a device. Initialise with CAMLUX_DEVICE_INFO_INIT. Texts are UTF-8, cut to fit, and end with a 0.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_device_info {
    /// Set by CAMLUX_DEVICE_INFO_INIT.
    pub struct_size: u32,
    /// Its index.
    pub index: u32,
    /// CAMLUX_DEVICE_KIND_DISCRETE and so on.
    pub kind: i32,
    /// 1: camlux can use it. 0: it lacks something, see `lacks`.
    pub is_usable: i32,
    /// Largest width and height of an image, pixels.
    pub max_image_px: u32,
    /// Lanes of a subgroup.
    pub subgroup_lanes: u32,
    /// Largest single allocation of device memory, bytes.
    pub max_allocation_bytes: u64,
    /// The device's name.
    pub name: [c_char; 256],
    /// Name and version of the driver.
    pub driver: [c_char; 256],
    /// What camlux needs and the device lacks; empty for a usable device.
    pub lacks: [c_char; 256],
    /// Vulkan version that it supports, such as "1.3.230".
    pub api_version: [c_char; 32],
    /// 32 hexadecimal digits in groups; the same after a restart.
    pub uuid: [c_char; 40],
    /// PCI address, such as "0000:65:00.0"; empty if the driver does not report it.
    pub pci: [c_char; 24],
}

c_struct!(camlux_device_options, 24);

c_struct!(camlux_device_info, 896);

/// An open device.
pub(super) struct DeviceObject {
    pub device: Device,
    /// Number of messages of the validation layer that went to the log.
    logged: AtomicUsize,
}

impl DeviceObject {
    pub fn new(device: Device) -> DeviceObject {
        DeviceObject {
            device,
            logged: AtomicUsize::new(0),
        }
    }

    /// Sends new messages of the validation layer to the log.
    pub fn log_validation(&self) {
        let messages = self.device.validation_messages();
        let first_new = self.logged.fetch_max(messages.len(), Ordering::Relaxed);
        for message in messages.iter().skip(first_new) {
            log::write(CAMLUX_LOG_WARNING, || format!("validation: {message}"));
        }
    }
}

/// Counts the Vulkan devices of this machine, including those that camlux cannot use.
///
/// \errors CAMLUX_ERROR_NO_DEVICE if there is no Vulkan loader or driver; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. It queries the drivers, which takes milliseconds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_count(count: *mut u32) -> camlux_status {
    ffi_guard("camlux_device_count", || {
        let devices = || Ok(Device::list()?.len() as u32);
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(count, "count", devices) }
    })
}

/// Describes a device of this machine: what it is, whether camlux can use it, and if not, why.
///
/// \param index from 0 to camlux_device_count - 1, in the order of the Vulkan loader.
/// \param info initialise with CAMLUX_DEVICE_INFO_INIT.
/// \errors CAMLUX_ERROR_NO_DEVICE if there is no Vulkan loader or driver; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. It queries the drivers, which takes milliseconds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_get_info(
    index: u32,
    info: *mut camlux_device_info,
) -> camlux_status {
    ffi_guard("camlux_device_get_info", || {
        let found = || {
            let devices = Device::list()?;
            let found = devices.get(index as usize).map(info_of);
            found.ok_or_else(|| no_part(index, devices.len(), "device"))
        };
        // SAFETY: the caller guarantees it.
        unsafe { args::write(info, found) }
    })
}

/// Opens a device.
///
/// \param options NULL: the best device, without validation.
/// \param device receives the handle, with one reference; release it with camlux_device_release.
/// \errors CAMLUX_ERROR_NO_DEVICE if no device matches, or the matching one lacks something; CAMLUX_ERROR_VULKAN;
/// CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. Any number of threads may use the device at once, each with its own renderer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_create(
    options: *const camlux_device_options,
    device: *mut *mut camlux_device,
) -> camlux_status {
    ffi_guard("camlux_device_create", || {
        // SAFETY: the caller guarantees it.
        let options = unsafe { options_from(args::read_optional(options)?.unwrap_or_default()) }?;
        let open = || {
            let device = Device::open(&options)?;
            log::write(CAMLUX_LOG_INFO, || {
                let info = device.info();
                format!("opened {} ({}, {})", info.name, info.kind, info.driver)
            });
            Ok(DeviceObject::new(device))
        };
        // SAFETY: the caller guarantees it.
        unsafe { handle::return_handle(device, "device", open) }
    })
}

/// Describes an open device.
///
/// \param info initialise with CAMLUX_DEVICE_INFO_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_info_of(
    device: *mut camlux_device,
    info: *mut camlux_device_info,
) -> camlux_status {
    ffi_guard("camlux_device_info_of", || {
        let object = handle::get(device)?;
        // SAFETY: the caller guarantees it.
        unsafe { args::write(info, || Ok(info_of(object.device.info()))) }
    })
}

/// Counts the messages of the Khronos validation layer since the device was opened; 0 without validation. Any message is
/// a bug of camlux or of the driver.
///
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_validation_count(
    device: *mut camlux_device,
    count: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_device_validation_count", || {
        let object = handle::get(device)?;
        let messages = || Ok(object.device.validation_messages().len() as u32);
        // SAFETY: the caller guarantees it.
        unsafe { args::write_result(count, "count", messages) }
    })
}

/// # Safety
/// The name is null or a C string.
unsafe fn options_from(options: camlux_device_options) -> Outcome<DeviceOptions> {
    // SAFETY: the caller guarantees it.
    let name = unsafe { args::text(options.name, "camlux_device_options.name") }?;
    let choices = args::choices![
        CAMLUX_DEVICE_BEST => Some(DeviceChoice::Best),
        CAMLUX_DEVICE_INDEX => Some(DeviceChoice::Index(options.index as usize)),
        CAMLUX_DEVICE_NAME => name.clone().map(DeviceChoice::Name),
        CAMLUX_DEVICE_UUID => name.clone().map(DeviceChoice::Uuid),
        CAMLUX_DEVICE_PCI => name.map(DeviceChoice::Pci),
    ];
    let choice = args::one_of("choice", options.choice, &choices)?;
    let no_name = || {
        Failure::argument("choice needs a name, but name is NULL; set name, or give another choice")
    };
    Ok(DeviceOptions {
        choice: choice.ok_or_else(no_name)?,
        validation: args::flag("validation", options.validation)?,
    })
}

fn info_of(info: &DeviceInfo) -> camlux_device_info {
    camlux_device_info {
        index: info.index as u32,
        kind: match info.kind {
            DeviceKind::Discrete => CAMLUX_DEVICE_KIND_DISCRETE,
            DeviceKind::Integrated => CAMLUX_DEVICE_KIND_INTEGRATED,
            DeviceKind::Virtual => CAMLUX_DEVICE_KIND_VIRTUAL,
            DeviceKind::Cpu => CAMLUX_DEVICE_KIND_CPU,
            DeviceKind::Other => CAMLUX_DEVICE_KIND_OTHER,
        },
        is_usable: i32::from(info.unusable.is_none()),
        max_image_px: info.limits.max_image_px,
        subgroup_lanes: info.limits.subgroup_lanes,
        max_allocation_bytes: info.limits.max_allocation_bytes,
        name: fixed_text(&info.name),
        driver: fixed_text(&info.driver),
        lacks: fixed_text(info.unusable.as_deref().unwrap_or_default()),
        api_version: fixed_text(&info.api_version),
        uuid: fixed_text(&info.uuid),
        pci: fixed_text(info.pci.as_deref().unwrap_or_default()),
        ..Default::default()
    }
}

/// As much of a text as fits, cut between characters, followed by a 0.
fn fixed_text<const N: usize>(text: &str) -> [c_char; N] {
    let mut ends = (0..N.min(text.len() + 1)).rev();
    let end = ends.find(|&end| text.is_char_boundary(end));
    let bytes = &text.as_bytes()[..end.unwrap_or(0)];
    std::array::from_fn(|i| bytes.get(i).map_or(0, |&byte| byte as c_char))
}
