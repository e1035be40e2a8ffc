//! `camlux info`: lists the devices, says whether camlux can use each, and marks the one it would choose.

use std::process::ExitCode;

use camlux::{Device, DeviceInfo, DeviceLimits, DeviceOptions, Error, GatherKernel, Tracer};
use indicatif::HumanBytes;

use crate::{Failure, print};

const INSTALL: &str = "install a Vulkan driver (Debian: apt-get install mesa-vulkan-drivers); if one is installed, VK_LOADER_DEBUG=error,driver shows why the loader skipped it";

/// Exit code 0 if a device can be used, else 1.
pub fn run() -> Result<ExitCode, Failure> {
    let devices = match Device::list() {
        Ok(devices) => devices,
        Err(Error::NoDevice { problem, .. }) => {
            print(&format!("no Vulkan device: {problem}; {INSTALL}\n"))?;
            return Ok(ExitCode::FAILURE);
        }
        Err(error) => return Err(error.into()),
    };
    if devices.is_empty() {
        print(&format!("no Vulkan device; {INSTALL}\n"))?;
        return Ok(ExitCode::FAILURE);
    }
    let (default, exit_code) = match Device::open(&DeviceOptions::default()) {
        Ok(device) => {
            let DeviceInfo { index, name, .. } = device.info();
            (format!("{index} {name}"), ExitCode::SUCCESS)
        }
        Err(error) => (format!("none ({error})"), ExitCode::FAILURE),
    };
    let devices: String = devices.iter().map(describe).collect();
    print(&format!("{devices}default: {default}\n"))?;
    Ok(exit_code)
}

fn describe(device: &DeviceInfo) -> String {
    let limits = &device.limits;
    let usable = match &device.unusable {
        None => "yes".to_owned(),
        Some(reason) => format!("no: {reason}"),
    };
    let image = format!(
        "{} px, {} layers",
        limits.max_image_px, limits.max_image_layers
    );
    let bytes = |count: u64| HumanBytes(count).to_string();
    let rows = [
        ("usable", usable),
        ("type", device.kind.to_string()),
        ("driver", device.driver.clone()),
        ("UUID", device.uuid.clone()),
        (
            "PCI address",
            device.pci.clone().unwrap_or("unknown".into()),
        ),
        ("Vulkan", device.api_version.clone()),
        ("largest image", image),
        ("storage buffer", bytes(limits.max_storage_buffer_bytes)),
        ("allocation", bytes(limits.max_allocation_bytes)),
        ("buffer", bytes(limits.max_buffer_bytes)),
        ("memory", bytes(limits.memory_bytes)),
        ("shared memory", bytes(limits.shared_memory_bytes.into())),
        ("subgroup", subgroup(limits)),
        ("kernels", kernels(device)),
        ("rasteriser", rasteriser(limits)),
        (
            "timestamp period",
            match limits.timestamp_period_ns {
                Some(ns) => format!("{ns} ns"),
                None => "none: the time of a submission is divided among its passes".into(),
            },
        ),
    ];
    let rows = rows.map(|(label, value)| format!("  {label:<17} {value}\n"));
    format!("{} {}\n{}", device.index, device.name, rows.concat())
}

fn subgroup(limits: &DeviceLimits) -> String {
    let lanes = limits.subgroup_lanes;
    match limits.broadcast_lanes {
        Some(_) => format!("{lanes} lanes, with broadcast"),
        None => format!("{lanes} lanes; no broadcast, or a varying number"),
    }
}

fn rasteriser(limits: &DeviceLimits) -> String {
    let steps = 1 << limits.sub_pixel_bits.min(30);
    let coarse = match limits.sub_pixel_bits {
        ..8 => ": coarse, so camlux finds visible surfaces by rays",
        _ => "",
    };
    format!("corners to 1/{steps} px{coarse}")
}

/// What camlux uses on the device, and what else it could use.
fn kernels(device: &DeviceInfo) -> String {
    let (tracer, gather) = (Tracer::best_for(device), GatherKernel::best_for(device));
    let others = Tracer::ALL
        .into_iter()
        .filter(|other| *other != tracer && other.runs_on(device));
    let others: Vec<String> = others
        .map(|other| format!("--tracer {}", other.name()))
        .collect();
    let others = match others.is_empty() {
        true => String::new(),
        false => format!(" (or {})", others.join(", ")),
    };
    format!("rays {}{others}, gather {}", tracer.name(), gather.name())
}
