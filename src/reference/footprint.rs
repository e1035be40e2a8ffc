//! The area of a pixel, for cameras that average light over it.

use std::f64::consts::TAU;

use glam::DVec3;
use sobol_burley::sample_4d;

use super::{
    path::{Arrived, Receiver, Transport},
    pixel::mix,
    view_ray::view_ray,
};
use crate::scene::PixelFilter;

/// Points of a pixel at which its direct light is computed.
pub const DIRECT_SAMPLES: u32 = 1024;
/// Seed for the random numbers of a pixel's direct light.
const DIRECT_SEED: u32 = 0x00d1_4ec7;

/// The light and depths over a pixel's area.
#[derive(Debug, Clone, Copy)]
pub struct Footprint {
    pub direct: Arrived,
    /// W/(sr·m²)
    pub emission: DVec3,
    /// Mean over the points that show a surface; infinite if none does.
    pub mean_depth_m: f64,
    pub nearest_depth_m: f64,
    /// Whether some point reflects light.
    pub has_receiver: bool,
}

/// A point of the image plane near a pixel's centre, drawn with the filter's weight as density.
pub fn drawn_px(filter: PixelFilter, centre_px: [f64; 2], [u, v]: [f64; 2]) -> [f64; 2] {
    let [x, y] = match filter {
        PixelFilter::Box => [u - 0.5, v - 0.5],
        PixelFilter::Gaussian => {
            // The share of a Gaussian within radius r is 1 − exp(−r²/2σ²), with σ = 1/2 and r up to 3/2.
            let within = |radius_squared: f64| 1.0 - (-2.0 * radius_squared).exp();
            let radius = (-(1.0 - u * within(2.25)).ln() / 2.0).sqrt();
            let (sin, cos) = (TAU * v).sin_cos();
            [radius * cos, radius * sin]
        }
    };
    [centre_px[0] + x, centre_px[1] + y]
}

/// The surface that a point of the image plane shows, and its depth, metres; `None`: background.
pub fn receiver_at(transport: &Transport, [x_px, y_px]: [f64; 2]) -> Option<(Receiver, f64)> {
    let camera = &transport.surfaces.scene.camera;
    let ray = view_ray(camera, x_px, y_px)?;
    let hit = transport.seen(&ray)?;
    let surface = transport.surfaces.at(&hit, ray.direction);
    let receiver = Receiver::new(surface, -ray.direction, hit.distance);
    let depth_m = hit.distance * transport.metres_per_unit / ray.per_depth;
    Some((receiver, depth_m))
}

impl Footprint {
    pub fn of(transport: &Transport, filter: PixelFilter, centre_px: [f64; 2]) -> Footprint {
        let seed = mix(centre_px[0] as u32, mix(centre_px[1] as u32, DIRECT_SEED));
        let (mut direct, mut emission) = (Arrived::default(), DVec3::ZERO);
        let mut depths = Vec::new();
        let mut has_receiver = false;
        for index in 0..DIRECT_SAMPLES {
            let [u, v, ..] = sample_4d(index, 0, seed).map(f64::from);
            let at_px = drawn_px(filter, centre_px, [u, v]);
            let Some((receiver, depth_m)) = receiver_at(transport, at_px) else {
                continue;
            };
            depths.push(depth_m);
            has_receiver |= !receiver.surface.brdf.is_black();
            let share = f64::from(DIRECT_SAMPLES).recip();
            let lit = transport.direct(&receiver, index..index + 1, seed);
            direct.add(&lit, share);
            emission += share * receiver.surface.emission;
        }
        let (mean_depth_m, nearest_depth_m) = match depths.len() {
            0 => (f64::INFINITY, f64::INFINITY),
            count => (
                depths.iter().sum::<f64>() / count as f64,
                depths.iter().copied().fold(f64::INFINITY, f64::min),
            ),
        };
        Footprint {
            direct,
            emission,
            mean_depth_m,
            nearest_depth_m,
            has_receiver,
        }
    }
}
