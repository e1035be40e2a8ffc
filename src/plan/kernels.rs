//! The kernels that compute the same on different devices.

use crate::{
    Error, Result,
    vulkan::{DeviceInfo, DeviceKind},
};

/// How rays find triangles. `Packet` and `Single` test large triangles separately; each lane traverses a tree over the others on its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RayKernel {
    /// Traces the rays of a subgroup of eight lanes together: each lane prepares one triangle and broadcasts it.
    Packet,
    /// Traces the rays of each lane separately. Runs on any Vulkan 1.3 device.
    Single,
    /// Uses the device's ray tracing units (`VK_KHR_ray_query`): each ray separately, among all triangles.
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

    /// Whether the kernel gives right results on the device. `Packet` needs eight lanes.
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
                    "{} has no VK_KHR_ray_query, which the tracer query needs",
                    device.name
                ),
                hint: "leave the choice to the renderer, or choose another device".into(),
            });
        }
        fitting(self, self.runs_on(device), "ray", self.name(), device)
    }

    /// The fastest kernel that runs on the device. `Query` is skipped on CPU drivers, which have no ray tracing units.
    pub fn best_for(device: &DeviceInfo) -> Self {
        let own = [RayKernel::Query, RayKernel::Packet, RayKernel::Single];
        let first = usize::from(device.kind == DeviceKind::Cpu);
        let running = own[first..].iter().find(|kernel| kernel.runs_on(device));
        running.copied().unwrap_or(RayKernel::Single)
    }
}

/// How the gather distributes VPLs to its lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GatherKernel {
    /// Each of 8 lanes loads a VPL and broadcasts it. For CPU drivers with 256-bit vectors.
    Broadcast8,
    /// The same with 4 lanes. For CPU drivers with 128-bit vectors.
    Broadcast4,
    /// Tiles in workgroup memory. For GPUs.
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

    /// Whether the kernel gives right results on the device. A broadcast depends on the number of lanes.
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

    /// The fastest kernel for the device. From workgroup memory, lavapipe does one scalar load per lane; GPUs do one load for all lanes.
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
            "the {what} kernel {name} cannot run with {lanes} of {}",
            device.name
        ),
        hint: "leave the choice to the renderer, or choose another device".into(),
    })
}
