//! Code that several test programs share.

#![allow(
    dead_code,
    unused_imports,
    unused_macros,
    reason = "each program uses its own part"
)]

pub mod calibrations;
pub mod direct;
pub mod gather;
pub mod gltf_file;
pub mod gpu;
pub mod instances;
pub mod lamps;
pub mod quadrature;
pub mod ray_caster;
#[cfg(feature = "reference")]
pub mod reference_frame;
pub mod rmse;
#[cfg(feature = "reference")]
pub mod rooms;
pub mod rows;
pub mod scene_folder;
#[cfg(feature = "reference")]
pub mod shadows;
pub mod texels;
pub mod truth;
