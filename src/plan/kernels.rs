//! The kernels that do the same on different devices.

use crate::{
    Error, Result,
    vulkan::{DeviceInfo, DeviceKind},
};

/// How rays find triangles. Large ones stand alone in two of these, and each lane goes by itself through a tree over the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayKernel {
    /// The rays of a subgroup together, for which it takes eight lanes: each works one triangle out and broadcasts it.
    Packet,
    /// The rays of each lane by themselves: any device of Vulkan 1.3.
    Single,
    /// By units of the device's own (`VK_KHR_ray_query`), each ray by itself, among all triangles.
    Query,
}

impl RayKernel {
    pub const ALL: [RayKernel; 3] = [RayKernel::Packet, RayKernel::Single, RayKernel::Query];

    /// The word of the shader permutation.
    pub fn name(self) -> &'static str {
        match self {
            RayKernel::Packet => "packet",
            RayKernel::Single => "single",
            RayKernel::Query => "query",
        }
    }

    /// Whether the kernel gives right results on the device: a packet is that of eight lanes.
    pub fn runs_on(self, device: &DeviceInfo) -> bool {
        match self {
            RayKernel::Packet => device.limits.broadcast_lanes == Some(8),
            RayKernel::Single => true,
            RayKernel::Query => device.has_ray_query,
        }
    }

    /// This kernel, if it runs on the device.
    pub(crate) fn checked_for(self, device: &DeviceInfo) -> Result<Self> {
        if self == RayKernel::Query && !device.has_ray_query {
            return Err(Error::NoDevice {
                problem: format!(
                    "{} has no VK_KHR_ray_query for the tracer query",
                    device.name
                ),
                hint: "leave the choice to the renderer, or choose another device".into(),
            });
        }
        fitting(self, self.runs_on(device), "ray", self.name(), device)
    }

    /// The fastest one of those that run on the device: what a GPU has units for, but CPU drivers do without those.
    pub fn best_for(device: &DeviceInfo) -> Self {
        let own = [RayKernel::Query, RayKernel::Packet, RayKernel::Single];
        let first = usize::from(device.kind == DeviceKind::Cpu);
        let running = own[first..].iter().find(|kernel| kernel.runs_on(device));
        running.copied().unwrap_or(RayKernel::Single)
    }
}

/// How the gather hands VPLs to its lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GatherKernel {
    /// Each of 8 lanes loads a VPL and broadcasts it: CPU drivers of 256 bits.
    Broadcast8,
    /// The same with 4 lanes: CPU drivers of 128 bits.
    Broadcast4,
    /// Tiles in workgroup memory: GPUs.
    Tile,
}

impl GatherKernel {
    pub const ALL: [GatherKernel; 3] = [
        GatherKernel::Broadcast8,
        GatherKernel::Broadcast4,
        GatherKernel::Tile,
    ];

    /// The word of the shader permutation.
    pub fn name(self) -> &'static str {
        match self {
            GatherKernel::Broadcast8 => "broadcast8",
            GatherKernel::Broadcast4 => "broadcast4",
            GatherKernel::Tile => "tile",
        }
    }

    /// Whether the kernel gives right results on the device: a broadcast counts on the number of lanes.
    pub fn runs_on(self, device: &DeviceInfo) -> bool {
        match self {
            GatherKernel::Broadcast8 => device.limits.broadcast_lanes == Some(8),
            GatherKernel::Broadcast4 => device.limits.broadcast_lanes == Some(4),
            GatherKernel::Tile => true,
        }
    }

    /// This kernel, if it runs on the device.
    pub(crate) fn checked_for(self, device: &DeviceInfo) -> Result<Self> {
        fitting(self, self.runs_on(device), "gather", self.name(), device)
    }

    /// The fastest kernel for the device: lavapipe does one scalar load per lane from workgroup memory, GPUs do one for all.
    pub fn best_for(device: &DeviceInfo) -> Self {
        let running = Self::ALL.into_iter().find(|kernel| kernel.runs_on(device));
        let best = running.filter(|_| device.kind == DeviceKind::Cpu);
        best.unwrap_or(GatherKernel::Tile)
    }
}

fn fitting<K>(kernel: K, runs: bool, what: &str, name: &str, device: &DeviceInfo) -> Result<K> {
    if runs {
        return Ok(kernel);
    }
    let lanes = match device.limits.broadcast_lanes {
        Some(lanes) => format!("the {lanes} lanes of a subgroup"),
        None => "subgroups whose lanes do not broadcast".into(),
    };
    Err(Error::NoDevice {
        problem: format!(
            "the {what} kernel {name} does not fit {lanes} of {}",
            device.name
        ),
        hint: "leave the choice to the renderer, or choose another device".into(),
    })
}
