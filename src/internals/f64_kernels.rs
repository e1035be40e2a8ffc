//! The frame's kernels in f64: the formulas of [`model`] on the same inputs that the raster passes hand to the kernels.
//!
//! The difference between a frame and these results is the *kernel error*, which is rounding only. The *model error*, the difference
//! between the formulas and the light that arrives, is a separate question.

use rayon::prelude::*;

use super::{Intermediates, LightIntermediates};
use crate::{
    Scene,
    model::{self, Phasor, Receiver, Vpl},
    scene::{Bands, Light, VplSum},
};

/// The VPLs of a light: one for each texel of its RSM that shows a surface and is in the emission domain.
pub fn vpls(light: &Light, kept: &LightIntermediates) -> Vec<Vpl> {
    let total = kept.domain.total_measure();
    let texels = kept.rsm.iter().zip(&kept.domain.texels);
    texels
        .filter_map(|(seen, emission)| {
            let seen = seen.as_ref().filter(|_| emission.measure > 0.0)?;
            let intensity = kept.domain.axial_intensity;
            let from_light_m = seen.point.position_m.distance(kept.domain.origin_m);
            let to_light = model::direction_to_light(light, seen.point.position_m);
            let facing = seen.point.normal.dot(to_light).max(emission.measure);
            Some(Vpl {
                from_light_m,
                area_m2: emission.measure * from_light_m.powi(2) / facing,
                position_m: seen.point.position_m,
                normal: seen.point.normal,
                to_light,
                brdf: seen.point.brdf,
                irradiance_facing_w_m2: intensity.map(|i| i * seen.irradiance_per_intensity),
                incident_power_w: kept.domain.incident_power_w(emission),
                domain_share: emission.measure / total,
            })
        })
        .collect()
}

/// Indirect radiance from all lights in W/sr/m², for every pixel row by row from the top; 0 for the background.
pub fn indirect(scene: &Scene, sum: VplSum, kept: &Intermediates) -> Vec<Bands> {
    let every_pixel: Vec<usize> = (0..kept.gbuffer.len()).collect();
    indirect_at(scene, sum, kept, &every_pixel)
}

/// Indirect radiance from all lights in W/sr/m² for some pixels, given by their index row by row from the top, in the given order; 0 for
/// the background. Each value is a sum over all VPLs. A pair takes tens of ns of a core, so a whole image against a fine RSM would take
/// minutes. All cores work.
pub fn indirect_at(
    scene: &Scene,
    sum: VplSum,
    kept: &Intermediates,
    pixels: &[usize],
) -> Vec<Bands> {
    let lights = scene.lights.iter().zip(&kept.lights);
    let vpls: Vec<Vpl> = lights.flat_map(|(light, kept)| vpls(light, kept)).collect();
    let shade = |&pixel: &usize| {
        let receiver = receiver(scene, kept, pixel);
        receiver.map_or([0.0; 3], |receiver| {
            model::indirect_radiance(sum, &vpls, &receiver, |_| true)
        })
    };
    pixels.par_iter().map(shade).collect()
}

/// Z of the indirect light of modulated lights, W/sr/m²; 0 in a scene without time of flight. Pixels as for [`indirect_at`].
pub fn indirect_phasors_at(
    scene: &Scene,
    sum: VplSum,
    kept: &Intermediates,
    pixels: &[usize],
    frequency_hz: f64,
) -> Vec<Phasor> {
    let Some(tof) = &scene.tof else {
        return vec![Phasor::default(); pixels.len()];
    };
    let lights = scene.lights.iter().zip(&kept.lights).enumerate();
    let modulated = lights.filter(|(light, _)| tof.is_modulated(*light));
    let vpls: Vec<Vpl> = modulated
        .flat_map(|(_, (light, kept))| vpls(light, kept))
        .collect();
    let shade = |&pixel: &usize| {
        let Some(receiver) = receiver(scene, kept, pixel) else {
            return Phasor::default();
        };
        let camera = &scene.camera;
        let to_camera_m = camera.range_to(receiver.position_m - camera.position_m);
        let way_to_camera = Phasor::of_path(1.0, to_camera_m, frequency_hz);
        model::indirect_phasor(sum, &vpls, &receiver, tof, frequency_hz) * way_to_camera
    };
    pixels.par_iter().map(shade).collect()
}

fn receiver(scene: &Scene, kept: &Intermediates, pixel: usize) -> Option<Receiver> {
    let point = kept.gbuffer.get(pixel).copied().flatten()?;
    let camera = &scene.camera;
    let to_camera = match camera.is_orthographic() {
        true => -camera.basis().forward,
        false => (camera.position_m - point.position_m).normalize_or_zero(),
    };
    Some(Receiver {
        position_m: point.position_m,
        normal: point.normal,
        to_camera,
        brdf: point.brdf,
    })
}
