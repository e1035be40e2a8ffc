//! The modulation of a time-of-flight camera, for the shaders.

use std::f64::consts::PI;

use glam::DVec3;

use crate::{
    LocalSpace, Result, Scene,
    model::SPEED_OF_LIGHT_M_S,
    scene::{MAX_FREQUENCIES, TimeOfFlight},
    vulkan::{Buffer, Device, shaders},
};

/// Share of the squared noise of Z that turns its phase, if nothing is known of it.
pub(crate) const USUAL_TURNING_SHARE: f32 = 0.5;

/// Uploads the modulation for the kernels that carry phasors; `None` without time of flight.
/// `error_scales` and `turning_shares` have one value per frequency, as in the shaders.
pub(crate) fn upload(
    device: &Device,
    scene: &Scene,
    space: &LocalSpace,
    error_scales: [f32; MAX_FREQUENCIES],
    turning_shares: [f32; MAX_FREQUENCIES],
) -> Result<Option<Buffer>> {
    let Some(tof) = &scene.tof else {
        return Ok(None);
    };
    let seen: Vec<u32> = (0..3)
        .filter(|&band| tof.band_weights[band as usize] != 0.0)
        .collect();
    let parameters = shaders::Modulation {
        turns_per_unit: per_frequency(tof, |per_metre| per_metre * space.metres_per_unit),
        is_used: per_frequency(tof, |_| 1.0),
        band_weights: tof.band_weights.map(|weight| weight as f32),
        pair_count: tof.frequencies_hz.len().div_ceil(2) as u32,
        bands: std::array::from_fn(|i| seen.get(i).copied().unwrap_or_default()),
        band_count: seen.len() as u32,
        is_seen: tof
            .band_weights
            .map(|weight| if weight == 0.0 { 0.0 } else { 1.0 }),
        metres_per_radian: per_frequency(tof, |per_metre| 1.0 / (4.0 * PI * per_metre)),
        error_scales,
        turning_shares,
        ..shaders::Modulation::default()
    };
    Buffer::upload(device, "modulation", &[parameters]).map(Some)
}

/// The phase of a light at the local origin, in turns of each frequency; `None` if the light is not modulated.
pub(crate) fn origin_turns(
    scene: &Scene,
    space: &LocalSpace,
    light: usize,
) -> Option<[f32; MAX_FREQUENCIES]> {
    let is_modulated = scene.tof.as_ref()?.is_modulated(light);
    let position_m = scene.lights[light].position_m()?;
    is_modulated.then(|| turns_to_origin(scene, space, position_m))
}

/// The distance of a point from the local origin, in turns of each frequency; 0 without time of flight.
pub(super) fn turns_to_origin(
    scene: &Scene,
    space: &LocalSpace,
    point_m: DVec3,
) -> [f32; MAX_FREQUENCIES] {
    turns_of(scene, point_m.distance(space.origin_m))
}

/// A length in turns of each frequency; 0 without time of flight.
pub(super) fn turns_of(scene: &Scene, distance_m: f64) -> [f32; MAX_FREQUENCIES] {
    let turns = |per_metre: f64| (per_metre * distance_m).fract();
    scene
        .tof
        .as_ref()
        .map_or([0.0; MAX_FREQUENCIES], |tof| per_frequency(tof, turns))
}

/// A value per frequency, from its turns per metre; 0 for frequencies that are not used.
fn per_frequency(tof: &TimeOfFlight, value: impl Fn(f64) -> f64) -> [f32; MAX_FREQUENCIES] {
    std::array::from_fn(|i| {
        let frequency_hz = tof.frequencies_hz.get(i);
        frequency_hz.map_or(0.0, |hz| value(hz / SPEED_OF_LIGHT_M_S) as f32)
    })
}
