//! The frame's kernels again, in f64 by the formulas of `camlux::model`, from what the raster passes handed to them.

#![allow(dead_code, reason = "each test uses its own part")]

use camlux::{
    Scene,
    intermediates::{Intermediates, LightIntermediates, SurfacePoint},
    model::{self, Brdf, Receiver, Vpl},
    scene::{Bands, Estimator, Light},
};

pub fn brdf(point: &SurfacePoint) -> Brdf {
    Brdf {
        kd: point.kd,
        ks: point.ks,
        shininess: point.shininess,
    }
}

/// L_{P→C} of one light per pixel, with V = 1; 0 for the background.
pub fn unshadowed_direct(scene: &Scene, light: &Light, kept: &Intermediates) -> Vec<Bands> {
    let shade = |point: &Option<SurfacePoint>| {
        point.map_or([0.0; 3], |point| {
            model::direct_radiance(
                light,
                &brdf(&point),
                point.position_m,
                point.normal,
                scene.camera.position_m,
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
                brdf: brdf(&seen.point),
                irradiance_facing_w_m2: intensity.map(|i| i * seen.irradiance_per_intensity),
                incident_power_w: kept.domain.incident_power_w(emission),
                domain_share: emission.measure / total,
            })
        })
        .collect()
}

/// Indirect radiance per pixel from all lights; 0 for the background.
pub fn indirect(scene: &Scene, estimator: Estimator, kept: &Intermediates) -> Vec<Bands> {
    let lists: Vec<Vec<Vpl>> = scene
        .lights
        .iter()
        .zip(&kept.lights)
        .map(|(light, kept)| vpls(light, kept))
        .collect();
    let vpls: Vec<Vpl> = lists.concat();
    let shade = |point: &Option<SurfacePoint>| {
        point.map_or([0.0; 3], |point| {
            let receiver = Receiver {
                position_m: point.position_m,
                normal: point.normal,
                to_camera: (scene.camera.position_m - point.position_m).normalize(),
                brdf: brdf(&point),
            };
            model::indirect_radiance(estimator, &vpls, &receiver, |_| true)
        })
    };
    kept.gbuffer.iter().map(shade).collect()
}

/// sqrt(Σ(x−t)²/Σt²) over all pixels and bands.
pub fn relative_rmse(image: &[f32], truth: &[Bands]) -> f64 {
    let truth = truth.as_flattened();
    assert_eq!(image.len(), truth.len());
    let error: f64 = image
        .iter()
        .zip(truth)
        .map(|(&x, t)| (f64::from(x) - t).powi(2))
        .sum();
    let scale: f64 = truth.iter().map(|t| t * t).sum();
    assert!(scale > 0.0, "the truth is black");
    (error / scale).sqrt()
}
