//! Direct light in f64, at the points of a frame's own G-buffer.

use camlux::{
    Scene,
    internals::{Intermediates, SurfacePoint},
    model,
    scene::{Bands, Light},
};

/// L_{P→C} of one light per pixel in W/sr/m², with V = 1; 0 for the background. Row by row from the top.
pub fn unshadowed_direct(scene: &Scene, light: &Light, kept: &Intermediates) -> Vec<Bands> {
    let shade = |point: &SurfacePoint| {
        let camera_m = scene.camera.position_m;
        model::direct_radiance(light, &point.brdf, point.position_m, point.normal, camera_m)
    };
    let points = kept.gbuffer.iter();
    points
        .map(|point| point.as_ref().map_or([0.0; 3], shade))
        .collect()
}
