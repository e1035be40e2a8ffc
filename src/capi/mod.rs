//! The C interface: `include/camlux.h` is generated from this module, and the comments here are its manual.
//!
//! Every function runs in an [`ffi_guard`](status::ffi_guard): it takes nothing on trust that can be checked, turns a panic into a status,
//! and changes nothing where it fails. Handles are keys of a table and never addresses, so that a wrong one is found out.

#![allow(
    non_camel_case_types,
    reason = "these are the names of the C interface"
)]

mod abi;
mod args;
mod device;
mod frame;
mod frame_stats;
mod handle;
mod instances;
mod light;
mod log;
mod material;
mod mesh;
mod renderer;
mod scene;
mod scene_options;
mod status;
#[cfg(test)]
mod tests;
mod texture;
mod vulkan;

pub use abi::{Field, Layout, layouts};
pub use args::*;
pub use device::*;
pub use frame::*;
pub use frame_stats::*;
pub use handle::*;
pub use instances::*;
pub use light::*;
pub use log::*;
pub use material::*;
pub use mesh::*;
pub use renderer::*;
pub use scene::*;
pub use scene_options::*;
pub use status::*;
pub use texture::*;
pub use vulkan::*;
