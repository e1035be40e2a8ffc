//! The illumination model in f64, one formula at a time. The GPU kernels are tested against it.
//!
//! Symbols: light L, surface point P seen by a pixel (normal n_P), lit surface point Q that acts as a virtual point light (normal n_Q),
//! camera C. Direction arguments are unit vectors that point away from the surface. Normals are on the side that is seen or lit: surfaces
//! are two-sided, and the caller turns the normal. Source: "CamSim illumination model", after Lambers et al. 2015 and Bulczak et al. 2018.
//! The last step, from the irradiance of a pixel to its energy, is in [`Sensor`](crate::scene::Sensor).

mod brdf;
mod direct;
mod indirect;
mod light;
mod phasor;
mod sensor_noise;
mod solid_angle;
mod sum;

pub use brdf::{Brdf, Lobe};
pub use direct::direct_radiance;
pub use indirect::{
    Receiver, Vpl, indirect_phasor, indirect_radiance, vpl_contribution, vpl_phasor,
};
pub use light::{direction_to_light, irradiance_facing, peak_intensity, radiant_intensity};
pub use phasor::{
    PLANCK_CONSTANT_J_S, PhaseSampling, Phasor, SPEED_OF_LIGHT_M_S, electrons, multipath_error_m,
    range_m, unambiguous_range_m, wrap_count,
};
pub use sensor_noise::{FrameKey, Reading};
pub use solid_angle::{rectangle_solid_angle, triangle_solid_angle};
pub use sum::CompensatedSum;
