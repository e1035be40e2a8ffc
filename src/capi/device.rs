//! Devices.

use std::{
    ffi::c_char,
    sync::atomic::{AtomicUsize, Ordering},
};

use super::*;
use crate::{Device, DeviceChoice, DeviceInfo, DeviceKind, DeviceOptions};

/// What the environment variable CAMLUX_DEVICE names (an index, a name, a UUID or a PCI address); where it is not set, a discrete GPU before
/// an integrated one before a CPU driver.
pub const CAMLUX_DEVICE_BEST: i32 = 0;
/// The device of a number, as in camlux_device_get_info.
pub const CAMLUX_DEVICE_INDEX: i32 = 1;
/// The first device whose name contains a text, upper and lower case alike.
pub const CAMLUX_DEVICE_NAME: i32 = 2;
/// The device of a UUID, with or without hyphens.
pub const CAMLUX_DEVICE_UUID: i32 = 3;
/// The device at a PCI address, such as "0000:65:00.0" or "65:00.0".
pub const CAMLUX_DEVICE_PCI: i32 = 4;

/// A GPU of its own.
pub const CAMLUX_DEVICE_KIND_DISCRETE: i32 = 0;
/// A GPU beside the CPU.
pub const CAMLUX_DEVICE_KIND_INTEGRATED: i32 = 1;
/// A GPU of a virtual machine.
pub const CAMLUX_DEVICE_KIND_VIRTUAL: i32 = 2;
/// A driver that runs on the CPU, such as Mesa's lavapipe.
pub const CAMLUX_DEVICE_KIND_CPU: i32 = 3;
/// None of the others.
pub const CAMLUX_DEVICE_KIND_OTHER: i32 = 4;

/// Which device to open, and how. Begin with CAMLUX_DEVICE_OPTIONS_INIT: the best device, no validation.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_device_options {
    /// sizeof(camlux_device_options)
    pub struct_size: u32,
    /// CAMLUX_DEVICE_BEST, CAMLUX_DEVICE_INDEX, CAMLUX_DEVICE_NAME, CAMLUX_DEVICE_UUID or CAMLUX_DEVICE_PCI.
    pub choice: i32,
    /// With CAMLUX_DEVICE_INDEX: its number, from 0 to below camlux_device_count.
    pub index: u32,
    /// 1 turns the Khronos validation layer on, if it is installed: for debugging, for it is slow. What it says goes to the
    /// log as warnings, and is counted by camlux_device_validation_count. Some of its versions (1.3.239 for one) crash now and then where
    /// a device is opened or closed while another thread is at work on another one.
    pub validation: i32,
    /// With CAMLUX_DEVICE_NAME: part of the device's name, UTF-8. With CAMLUX_DEVICE_UUID and CAMLUX_DEVICE_PCI: that.
    pub name: *const c_char,
}

/// What a device is. Begin with CAMLUX_DEVICE_INFO_INIT. Texts are UTF-8, cut to fit, and end with a 0.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_device_info {
    /// sizeof(camlux_device_info)
    pub struct_size: u32,
    /// Its number.
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
    /// What camlux needs and the device does not have; empty for a usable one.
    pub lacks: [c_char; 256],
    /// Vulkan version that it offers, such as "1.3.230".
    pub api_version: [c_char; 32],
    /// 32 hexadecimal digits in groups: the same after a restart.
    pub uuid: [c_char; 40],
    /// Where it is plugged in, such as "0000:65:00.0"; empty where the driver does not tell.
    pub pci: [c_char; 24],
}

c_struct!(camlux_device_options, 24);

c_struct!(camlux_device_info, 896);

/// An open device.
pub(super) struct DeviceObject {
    pub device: Device,
    /// Messages of the validation layer that the log has had.
    logged: AtomicUsize,
}

impl DeviceObject {
    pub fn new(device: Device) -> DeviceObject {
        DeviceObject {
            device,
            logged: AtomicUsize::new(0),
        }
    }

    /// Sends what the validation layer has said since to the log.
    pub fn log_validation(&self) {
        let messages = self.device.validation_messages();
        let first_new = self.logged.fetch_max(messages.len(), Ordering::Relaxed);
        for message in messages.iter().skip(first_new) {
            log::write(CAMLUX_LOG_WARNING, || format!("validation: {message}"));
        }
    }
}

/// The number of Vulkan devices of this machine, those included that camlux cannot use.
///
/// \errors CAMLUX_ERROR_NO_DEVICE where there is no Vulkan loader or driver; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. It asks the drivers, which takes milliseconds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_count(count: *mut u32) -> camlux_status {
    ffi_guard("camlux_device_count", || {
        let devices = || Ok(Device::list()?.len() as u32);
        // SAFETY: the caller's word.
        unsafe { args::write_result(count, "count", devices) }
    })
}

/// What a device of this machine is, whether it can be used, and if not why.
///
/// \param index from 0 to below camlux_device_count; the order is the Vulkan loader's.
/// \param info begin with CAMLUX_DEVICE_INFO_INIT.
/// \errors CAMLUX_ERROR_NO_DEVICE where there is no Vulkan loader or driver; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. It asks the drivers, which takes milliseconds.
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
        // SAFETY: the caller's word.
        unsafe { args::write(info, found) }
    })
}

/// Opens a device.
///
/// \param options NULL: the best device, without validation.
/// \param device receives the handle, with one reference: give it back by camlux_device_release.
/// \errors CAMLUX_ERROR_NO_DEVICE where none fits or the one that fits lacks something; CAMLUX_ERROR_VULKAN;
/// CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any. The device may be used by any number of threads at once, with a renderer each.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_create(
    options: *const camlux_device_options,
    device: *mut *mut camlux_device,
) -> camlux_status {
    ffi_guard("camlux_device_create", || {
        // SAFETY: the caller's word.
        let options = unsafe { options_from(args::read_optional(options)?.unwrap_or_default()) }?;
        let open = || {
            let device = Device::open(&options)?;
            log::write(CAMLUX_LOG_INFO, || {
                let info = device.info();
                format!("opened {} ({}, {})", info.name, info.kind, info.driver)
            });
            Ok(DeviceObject::new(device))
        };
        // SAFETY: the caller's word.
        unsafe { handle::return_handle(device, "device", open) }
    })
}

/// What an open device is.
///
/// \param info begin with CAMLUX_DEVICE_INFO_INIT.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_device_info_of(
    device: *mut camlux_device,
    info: *mut camlux_device_info,
) -> camlux_status {
    ffi_guard("camlux_device_info_of", || {
        let object = handle::get(device)?;
        // SAFETY: the caller's word.
        unsafe { args::write(info, || Ok(info_of(object.device.info()))) }
    })
}

/// How many messages the Khronos validation layer has had since the device was opened; 0 without validation. Anything but 0
/// is a bug of camlux, or of the driver.
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
        // SAFETY: the caller's word.
        unsafe { args::write_result(count, "count", messages) }
    })
}

/// # Safety
/// The name is null or a C string.
unsafe fn options_from(options: camlux_device_options) -> Outcome<DeviceOptions> {
    // SAFETY: the caller's word.
    let name = unsafe { args::text(options.name, "name") }?;
    let choices = args::choices![
        CAMLUX_DEVICE_BEST => Some(DeviceChoice::Best),
        CAMLUX_DEVICE_INDEX => Some(DeviceChoice::Index(options.index as usize)),
        CAMLUX_DEVICE_NAME => name.clone().map(DeviceChoice::Name),
        CAMLUX_DEVICE_UUID => name.clone().map(DeviceChoice::Uuid),
        CAMLUX_DEVICE_PCI => name.map(DeviceChoice::Pci),
    ];
    let choice = args::one_of("choice", options.choice, &choices)?;
    let no_name = || Failure::argument("choice takes a name, but name is NULL");
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

/// As much of a text as fits, cut between characters, with a 0 behind it.
fn fixed_text<const N: usize>(text: &str) -> [c_char; N] {
    let mut ends = (0..N.min(text.len() + 1)).rev();
    let end = ends.find(|&end| text.is_char_boundary(end));
    let bytes = &text.as_bytes()[..end.unwrap_or(0)];
    std::array::from_fn(|i| bytes.get(i).map_or(0, |&byte| byte as c_char))
}
