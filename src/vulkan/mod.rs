//! The Vulkan layer: device, memory, pipelines and command recording. It contains all of the engine's `unsafe` and knows nothing of scenes
//! or passes.
//!
//! Conventions that keep it small: one queue; every image stays in layout GENERAL; full memory barriers separate passes; resources are
//! bound by the names that the shaders give their bindings.

mod acceleration_structure;
mod allocate;
mod command_pool;
mod device;
mod device_choice;
#[cfg(feature = "test-hooks")]
mod faults;
#[cfg(not(feature = "test-hooks"))]
#[path = "no_faults.rs"]
mod faults;
mod host;
mod host_memory;
mod instance;
mod keys;
mod memory;
mod pipeline;
mod pipeline_cache;
mod pipeline_file;
mod quirks;
mod raster;
mod readback;
mod recorder;
pub(crate) mod shaders;
mod shared_memory;
mod specialise;
mod texel_list;
mod transfers;
mod word_list;

pub(crate) use acceleration_structure::{AccelerationStructure, InstancedTriangles};
pub(crate) use allocate::{Allocate, Declarations, GrowsWith, Requirements};
pub(crate) use command_pool::CommandPool;
pub use device::{Device, DeviceOptions};
pub use device_choice::DeviceChoice;
#[cfg(feature = "test-hooks")]
#[doc(hidden)]
pub use faults::{Fault, FaultCount};
pub(crate) use host::Timeline;
pub use host::{HostVulkan, QueueLock};
pub use instance::{DeviceInfo, DeviceKind, DeviceLimits};
pub use memory::MemoryUse;
pub(crate) use memory::{Buffer, BufferUse, Image, ImageShape, PixelKind};
pub(crate) use pipeline::Pipelines;
pub use quirks::Quirks;
pub(crate) use raster::Target;
pub(crate) use readback::Readback;
pub(crate) use recorder::{MAX_GROUPS, PassTimes, Recorder, Resource, groups_in_rows};

pub use shaders::engine_hash;
pub use shared_memory::{SharedMemory, SharedMemoryInfo};
pub(crate) use texel_list::TexelList;
pub(crate) use transfers::copy_to_shared;
pub(crate) use word_list::WordList;

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::Error;

/// Locks a mutex even after a panic elsewhere: the guarded data is never left inconsistent.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn no_device(problem: impl Into<String>, hint: impl Into<String>) -> Error {
    Error::NoDevice {
        problem: problem.into(),
        hint: hint.into(),
    }
}

/// Turns a Vulkan result into the library's error. `call` is the Vulkan function's name.
fn failed(call: &'static str) -> impl FnOnce(ash::vk::Result) -> Error {
    use ash::vk::Result as Vk;
    move |result| Error::Vulkan {
        call,
        result,
        hint: match result {
            Vk::ERROR_DEVICE_LOST => "the driver lost the device while it was opened: try again",
            Vk::ERROR_OUT_OF_DEVICE_MEMORY | Vk::ERROR_OUT_OF_HOST_MEMORY => {
                "render a smaller image or RSM, or choose another device"
            }
            _ => "update the driver, or choose another device",
        },
    }
}
