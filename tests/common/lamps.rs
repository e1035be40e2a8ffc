//! A lamp with a measured pattern, and a projector. Neither has a symmetry.

use camlux::scene::{Bands, Intrinsics, Light, Pattern, ProjectedImage};
use glam::DVec3;

pub fn pattern() -> Pattern {
    let gammas_deg = [0.0, 10.0, 40.0, 75.0, 110.0];
    let planes_deg = [0.0, 60.0, 130.0, 225.0, 360.0];
    let first = [0.9, 1.0, 0.5, 0.2, 0.0];
    let planes = [
        first,
        [0.9, 0.8, 0.7, 0.1, 0.05],
        [0.9, 0.7, 0.2, 0.3, 0.1],
        [0.9, 0.6, 0.4, 0.05, 0.0],
        first,
    ];
    Pattern {
        gammas_rad: gammas_deg.map(f64::to_radians).into(),
        planes_rad: planes_deg.map(f64::to_radians).into(),
        intensities: planes.concat(),
        peak: 1.0,
    }
}

pub fn measured(position_m: DVec3, direction: DVec3, power_w: Bands) -> Light {
    Light::with_profile(
        position_m,
        direction,
        DVec3::new(0.7, 0.2, -0.5),
        pattern(),
        power_w,
    )
}

/// Five by three pixels. The optical axis passes through the second pixel of the last row.
pub fn image() -> ProjectedImage {
    ProjectedImage {
        size_px: [5, 3],
        intrinsics: Intrinsics {
            fx: 3.5,
            fy: 2.5,
            cx: 1.6,
            cy: 2.2,
            skew: 0.0,
        },
        values: vec![
            0.1, 0.9, 0.3, 1.0, 0.5, //
            0.8, 0.0, 0.7, 0.2, 0.6, //
            0.4, 1.0, 0.05, 0.9, 0.3,
        ],
    }
}

pub fn projector(position_m: DVec3, direction: DVec3, power_w: Bands) -> Light {
    Light::with_profile(
        position_m,
        direction,
        DVec3::new(0.7, 0.2, -0.5),
        image(),
        power_w,
    )
}
