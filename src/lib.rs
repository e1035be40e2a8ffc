//! camlux computes how a light illuminates what a camera sees, in physical units: direct light, and one bounce of
//! indirect light through virtual point lights taken from a reflective shadow map.
//!
//! Load a scene or build one from slices, open a device, render, and read the layers:
//!
//! ```no_run
//! use camlux::{Device, DeviceOptions, RenderOptions, Renderer, Scene, output::Layer};
//!
//! let scene = Scene::load("scenes/cornell.toml".as_ref())?;
//! let device = Device::open(&DeviceOptions::default())?;
//! let frame = Renderer::new(&device)?.render(&scene, &mut RenderOptions::default())?;
//! let radiance: &[f32] = frame.values(Layer::Radiance).unwrap_or_default();
//! # Ok::<(), camlux::Error>(())
//! ```
//!
//! `docs/model.md` describes what is computed, `docs/architecture.md` how. The library never prints and never exits.

mod bounce_layers;
mod cameras;
#[cfg(feature = "capi")]
pub mod capi;
pub mod emission;
pub mod error;
mod export;
mod exr_decode;
mod frame;
mod geometry;
#[cfg(all(feature = "reference", feature = "internals"))]
pub mod hard_cases;
mod import;
#[doc(hidden)]
pub mod input_file;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod internals;
#[doc(hidden)]
pub mod keys;
mod lattice;
mod local_space;
pub mod metrics;
pub mod model;
pub mod output;
mod parallel;
mod passes;
mod plan;
mod ray_tree;
#[cfg(feature = "reference")]
pub mod reference;
mod renderer;
pub mod scene;
mod vulkan;

/// The Vulkan bindings that the interface to a host's own device uses.
pub use ash;
pub use error::{Error, Result};
pub use frame::{DeviceFrame, DeviceImage, Progress};
/// The vectors that this crate's interface uses.
pub use glam;
#[doc(hidden)]
pub use import::{ImagePoses, image_poses};
pub use local_space::LocalSpace;
pub use plan::{
    GatherKernel, GatherPlan, IndirectPlan, LightPlan, Plan, RefinementPlan, ShadowPlan, TofPlan,
    Tracer,
};
pub use renderer::{RenderOptions, Renderer};
pub use scene::Scene;
pub use vulkan::{
    Device, DeviceChoice, DeviceInfo, DeviceKind, DeviceLimits, DeviceOptions, HostVulkan,
    MemoryUse, QueueLock, Quirks, SharedMemory, SharedMemoryInfo, engine_hash,
};
#[cfg(feature = "test-hooks")]
#[doc(hidden)]
pub use vulkan::{Fault, FaultCount};
