//! What the device computes, against the model in f64, against rays in f64 and against path-traced truth.

#[path = "../common/mod.rs"]
mod common;

mod adaptive_sum;
mod bounce;
#[cfg(feature = "reference")]
mod direct;
mod geometry;
#[cfg(feature = "reference")]
mod instant_radiosity;
mod kernels;
mod rays;
#[cfg(feature = "reference")]
mod reference;
#[cfg(feature = "reference")]
mod reference_mesh;
#[cfg(feature = "reference")]
mod reference_truth;
mod shadow_rays;
mod shadows;
mod truth;
