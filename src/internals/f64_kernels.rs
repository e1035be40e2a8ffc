//! The frame's kernels again, in f64: the formulas of [`model`] on what the raster passes handed to the kernels.
//!
//! The difference between a frame and what these give is the *kernel error*: rounding, and nothing else. How far the formulas
//! are from the light that arrives, the *model error*, is another question.

use std::thread;

use super::{Intermediates, LightIntermediates, SurfacePoint};
use crate::{
    Scene,
    model::{self, Receiver, Vpl},
    scene::{Bands, Light, VplSum},
};

/// L_{P→C} of one light per pixel in W/sr/m², with V = 1; 0 for the background. Row by row from the top.
pub fn unshadowed_direct(scene: &Scene, light: &Light, kept: &Intermediates) -> Vec<Bands> {
    let camera_m = scene.camera.position_m;
    let shade = |point: &Option<SurfacePoint>| {
        point.map_or([0.0; 3], |point| {
            model::direct_radiance(
                light,
                &point.brdf(),
                point.position_m,
                point.normal,
                camera_m,
            )
        })
    };
    kept.gbuffer.iter().map(shade).collect()
}

/// The VPLs of a light: one for each texel of its RSM that shows a surface and lies in the emission domain.
pub fn vpls(light: &Light, kept: &LightIntermediates) -> Vec<Vpl> {
    let total = kept.domain.total_measure();
    let texels = kept.rsm.iter().zip(&kept.domain.texels);
    texels
        .filter_map(|(seen, emission)| {
            let seen = seen.as_ref().filter(|_| emission.measure > 0.0)?;
            let intensity = kept.domain.axial_intensity;
            Some(Vpl {
                position_m: seen.point.position_m,
                normal: seen.point.normal,
                to_light: model::direction_to_light(light, seen.point.position_m),
                brdf: seen.point.brdf(),
                irradiance_facing_w_m2: intensity.map(|i| i * seen.irradiance_per_intensity),
                incident_power_w: kept.domain.incident_power_w(emission),
                domain_share: emission.measure / total,
            })
        })
        .collect()
}

/// Indirect radiance from all lights in W/sr/m², for every pixel row by row from the top; 0 for the background.
pub fn indirect(scene: &Scene, estimator: VplSum, kept: &Intermediates) -> Vec<Bands> {
    let every_pixel: Vec<usize> = (0..kept.gbuffer.len()).collect();
    indirect_at(scene, estimator, kept, &every_pixel)
}

/// Indirect radiance from all lights in W/sr/m² for some pixels, named by their index row by row from the top, in the
/// order in which they are named; 0 for the background. One value is a sum over all VPLs: a pair takes tens of ns of a
/// core, so that an image against a fine RSM would take minutes. All cores work.
pub fn indirect_at(
    scene: &Scene,
    estimator: VplSum,
    kept: &Intermediates,
    pixels: &[usize],
) -> Vec<Bands> {
    let lights = scene.lights.iter().zip(&kept.lights);
    let vpls: Vec<Vpl> = lights.flat_map(|(light, kept)| vpls(light, kept)).collect();
    let shade = |pixel: usize| {
        let Some(point) = kept.gbuffer.get(pixel).copied().flatten() else {
            return [0.0; 3];
        };
        let receiver = Receiver {
            position_m: point.position_m,
            normal: point.normal,
            to_camera: (scene.camera.position_m - point.position_m).normalize_or_zero(),
            brdf: point.brdf(),
        };
        model::indirect_radiance(estimator, &vpls, &receiver, |_| true)
    };
    let mut radiance = vec![[0.0; 3]; pixels.len()];
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let share = pixels.len().div_ceil(threads).max(1);
    thread::scope(|scope| {
        for (radiance, pixels) in radiance.chunks_mut(share).zip(pixels.chunks(share)) {
            let shade = &shade;
            scope.spawn(move || {
                for (radiance, &pixel) in radiance.iter_mut().zip(pixels) {
                    *radiance = shade(pixel);
                }
            });
        }
    });
    radiance
}
