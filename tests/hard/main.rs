//! Hard cases, and devices that fail or have little memory.

#[path = "../common/mod.rs"]
mod common;

#[cfg(feature = "reference")]
#[macro_use]
mod cases;

mod cuda;
mod device_faults;
mod device_limits;
mod device_memory;
mod geometry;
mod host_device;
mod lamps_off;
mod lights;
mod material;
mod pipeline_files;
#[cfg(feature = "reference")]
mod reference;
mod scale;
mod sums;
mod time_of_flight;
mod torture;
mod transport;
