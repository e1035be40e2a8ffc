//! The kernels that compute the same on different devices.

use crate::{
    Error, Result,
    vulkan::{DeviceInfo, DeviceKind},
};

/// What finds the triangles that rays hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tracer {
    /// The host, with all its cores. Only for devices that are the host's processor: their memory is the host's.
    Host,
    /// The device's ray tracing units (`VK_KHR_ray_query`).
    Query,
    /// A kernel that searches a ray tree. Runs on any Vulkan 1.3 device.
    Kernel,
}

impl Tracer {
    pub const ALL: [Tracer; 3] = [Tracer::Host, Tracer::Query, Tracer::Kernel];

    pub fn name(self) -> &'static str {
        match self {
            Tracer::Host => "host",
            Tracer::Query => "query",
            Tracer::Kernel => "kernel",
        }
    }

    pub fn runs_on(self, device: &DeviceInfo) -> bool {
        match self {
            Tracer::Host => device.kind == DeviceKind::Cpu,
            Tracer::Query => device.has_ray_query,
            Tracer::Kernel => true,
        }
    }

    /// This tracer, if it runs on the device.
    pub(crate) fn checked_for(self, device: &DeviceInfo) -> Result<Self> {
        if self.runs_on(device) {
            return Ok(self);
        }
        let name = &device.name;
        let problem = match self {
            Tracer::Host => {
                format!("{name} is not the host's processor, whose memory the tracer host needs")
            }
            _ => format!("{name} has no VK_KHR_ray_query, which the tracer query needs"),
        };
        Err(Error::NoDevice {
            problem,
            hint: "leave the choice to the renderer, or choose another device".into(),
        })
    }

    /// The fastest one that runs on the device.
    pub fn best_for(device: &DeviceInfo) -> Self {
        let running = Self::ALL.into_iter().find(|tracer| tracer.runs_on(device));
        running.unwrap_or(Tracer::Kernel)
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
        if self.runs_on(device) {
            return Ok(self);
        }
        let lanes = match device.limits.broadcast_lanes {
            Some(lanes) => format!("the {lanes} lanes of a subgroup"),
            None => "subgroups whose lanes do not broadcast".into(),
        };
        Err(Error::NoDevice {
            problem: format!(
                "the gather kernel {} cannot run with {lanes} of {}",
                self.name(),
                device.name
            ),
            hint: "leave the choice to the renderer, or choose another device".into(),
        })
    }

    /// The fastest kernel for the device. From workgroup memory, lavapipe does one scalar load per lane; GPUs do one load for all lanes.
    pub fn best_for(device: &DeviceInfo) -> Self {
        let running = Self::ALL.into_iter().find(|kernel| kernel.runs_on(device));
        let best = running.filter(|_| device.kind == DeviceKind::Cpu);
        best.unwrap_or(GatherKernel::Tile)
    }
}
