//! The C interface. `include/camlux.h` is generated from this module; the comments here are its manual.
//!
//! Every function runs in an [`ffi_guard`]. It checks everything that can be checked, turns a panic into a status,
//! and changes nothing if it fails. Handles are keys of a table, never addresses, so that a wrong handle is detected.
//!
//! # Safety
//! The caller of every function guarantees what cannot be checked: a pointer is NULL, or misaligned, or points to what the
//! function's comment says. A struct has as many bytes as its `struct_size`, an array as many elements as its count. A text ends with a 0.
//! A result is writable. A callback is a function of its type for as long as it may be called.

#![allow(
    non_camel_case_types,
    clippy::missing_safety_doc,
    reason = "these are the names of the C interface, and it says once what its caller has to see to"
)]

mod abi;
mod args;
mod camera;
mod device;
mod frame;
mod frame_stats;
mod handle;
mod indirect;
mod instances;
mod job;
mod layers;
mod light;
mod log;
mod material;
mod mesh;
mod pattern;
mod poses;
mod render_options;
mod renderer;
mod scene;
mod shared_memory;
mod status;
mod target;
#[cfg(test)]
mod tests;
mod texture;
mod tof;
mod vulkan;
mod words;

pub use abi::*;
pub use args::*;
pub use camera::*;
pub use device::*;
pub use frame::*;
pub use frame_stats::*;
pub use handle::*;
pub use indirect::*;
pub use instances::*;
pub use job::*;
pub use layers::*;
pub use light::*;
pub use log::*;
pub use material::*;
pub use mesh::*;
pub use pattern::*;
pub use poses::*;
pub use render_options::*;
pub use renderer::*;
pub use scene::*;
pub use shared_memory::*;
pub use status::*;
pub use target::*;
pub use texture::*;
pub use tof::*;
pub use vulkan::*;
