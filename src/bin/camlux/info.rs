//! `camlux info`: the devices, what camlux thinks of them, and which one it would take.

use std::fmt::Write;
use std::process::ExitCode;

use camlux::{Device, DeviceInfo, DeviceKind, DeviceOptions, Error};

use crate::{Failure, print};

const INSTALL: &str = "install a Vulkan driver (Debian: apt-get install mesa-vulkan-drivers)";

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
    let chosen = Device::open(&DeviceOptions::default());
    let mut text: String = devices.iter().map(describe).collect();
    let exit_code = match &chosen {
        Ok(device) => {
            let DeviceInfo { index, name, .. } = device.info();
            text += &format!("default: {index} {name}\n");
            ExitCode::SUCCESS
        }
        Err(error) => {
            text += &format!("default: none ({error})\n");
            ExitCode::FAILURE
        }
    };
    print(&text)?;
    Ok(exit_code)
}

fn describe(device: &DeviceInfo) -> String {
    let limits = &device.limits;
    let usable = match &device.unusable {
        None => "yes".to_owned(),
        Some(reason) => format!("no: {reason}"),
    };
    let rows = [
        ("usable", usable),
        ("type", kind(device.kind).to_owned()),
        ("driver", device.driver.clone()),
        ("Vulkan", device.api_version.clone()),
        (
            "largest image",
            format!(
                "{} px, {} layers",
                limits.max_image_px, limits.max_image_layers
            ),
        ),
        ("storage buffer", bytes(limits.max_storage_buffer_bytes)),
        ("allocation", bytes(limits.max_allocation_bytes)),
        ("buffer", bytes(limits.max_buffer_bytes)),
        ("memory", bytes(limits.memory_bytes)),
        ("shared memory", bytes(limits.shared_memory_bytes.into())),
        ("subgroup", format!("{} lanes", limits.subgroup_lanes)),
        (
            "timestamp period",
            format!("{} ns", limits.timestamp_period_ns),
        ),
    ];
    let mut text = format!("{} {}\n", device.index, device.name);
    for (label, value) in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {label:<17} {value}");
    }
    text
}

fn kind(kind: DeviceKind) -> &'static str {
    match kind {
        DeviceKind::Discrete => "discrete GPU",
        DeviceKind::Integrated => "integrated GPU",
        DeviceKind::Virtual => "virtual GPU",
        DeviceKind::Cpu => "CPU",
        DeviceKind::Other => "other",
    }
}

fn bytes(count: u64) -> String {
    const UNITS: [&str; 4] = ["B", "KiB", "MiB", "GiB"];
    let power = (count.max(1).ilog2() / 10).min(3);
    let value = count as f64 / f64::from(1_u32 << (10 * power));
    format!(
        "{} {}",
        (value * 10.0).round() / 10.0,
        UNITS[power as usize]
    )
}
