//! The C interface: `include/camlux.h` is generated from this module, and the comments here are its manual.
//!
//! Every function runs in an [`ffi_guard`]: it takes nothing on trust that can be checked, turns a panic into a status,
//! and changes nothing where it fails. Handles are keys of a table and never addresses, so that a wrong one is found out.
//!
//! # Safety
//! What cannot be checked is the caller's word, the same for all functions: a pointer is NULL, or misaligned, or points to what the
//! function's comment says. A struct has as many bytes as its `struct_size`, an array as many elements as its count, a text ends with a 0,
//! a result is writable, a callback is a function of its type for as long as it may be called.

#![allow(
    non_camel_case_types,
    clippy::missing_safety_doc,
    reason = "these are the names of the C interface, and it says once what its caller has to see to"
)]

mod abi;
mod args;
mod device;
mod frame;
mod frame_stats;
mod handle;
mod instances;
mod job;
mod light;
mod log;
mod material;
mod mesh;
mod poses;
mod renderer;
mod scene;
mod scene_options;
mod shared_memory;
mod status;
mod target;
#[cfg(test)]
mod tests;
mod texture;
mod tof;
mod vulkan;

pub use abi::*;
pub use args::*;
pub use device::*;
pub use frame::*;
pub use frame_stats::*;
pub use handle::*;
pub use instances::*;
pub use job::*;
pub use light::*;
pub use log::*;
pub use material::*;
pub use mesh::*;
pub use poses::*;
pub use renderer::*;
pub use scene::*;
pub use scene_options::*;
pub use shared_memory::*;
pub use status::*;
pub use target::*;
pub use texture::*;
pub use tof::*;
pub use vulkan::*;
