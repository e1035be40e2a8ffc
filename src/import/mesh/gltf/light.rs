//! Lights of `KHR_lights_punctual`.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DMat4, DVec3};

use super::document::{Punctual, PunctualKind};
use crate::scene::{Light, SpotCone};

/// Lumens per watt at 555 nm. Converts candela, lux and nit to watts, as exporting programs do.
pub(super) const LUMEN_PER_WATT: f64 = 683.0;

/// A light at the place of its node; it shines along -z. Its range is ignored, because light has none.
pub(super) fn of_node(light: &Punctual, to_world: DMat4) -> Light {
    let position_m = to_world.transform_point3(DVec3::ZERO);
    let direction = to_world.transform_vector3(DVec3::NEG_Z);
    let direction = direction.try_normalize().unwrap_or(DVec3::NEG_Z);
    let intensity = light.intensity / LUMEN_PER_WATT;
    let bands = |factor: f64| light.color.map(|band| factor * band);
    match light.kind {
        PunctualKind::Directional => Light::directional(direction, bands(intensity)),
        PunctualKind::Point => Light::point(position_m, bands(2.0 * TAU * intensity)),
        PunctualKind::Spot {
            inner_rad,
            outer_rad,
        } => {
            let cone = SpotCone {
                inner_half_angle_deg: inner_rad.to_degrees(),
                outer_half_angle_deg: outer_rad.to_degrees().min(180.0),
            };
            let power_w = bands(intensity * solid_angle_sr(&cone));
            Light::spot(position_m, direction, cone, power_w)
        }
    }
}

/// Integral of a cone's falloff over all directions.
fn solid_angle_sr(cone: &SpotCone) -> f64 {
    const INTERVALS: u32 = 512;
    let inner_rad = cone.inner_half_angle_deg.to_radians();
    let width_rad = cone.outer_half_angle_deg.to_radians() - inner_rad;
    // Simpson's rule.
    let term = |i: u32| {
        let share = f64::from(i) / f64::from(INTERVALS);
        let weight = match i {
            0 | INTERVALS => 1.0,
            _ => f64::from(2 + 2 * (i % 2)),
        };
        weight * (FRAC_PI_2 * share).cos() * (inner_rad + share * width_rad).sin()
    };
    let ramp = (0..=INTERVALS).map(term).sum::<f64>() * width_rad / f64::from(3 * INTERVALS);
    TAU * (1.0 - inner_rad.cos() + ramp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ConeIntegral;

    #[test]
    fn a_cone_integrates_to_what_the_model_has() {
        for (inner, outer) in [(0.0, 45.0), (20.0, 30.0), (30.0, 30.0), (0.0, 180.0)] {
            let cone = SpotCone {
                inner_half_angle_deg: inner,
                outer_half_angle_deg: outer,
            };
            let exact = TAU * ConeIntegral::new(cone).falloff_within(f64::INFINITY);
            assert!(
                (solid_angle_sr(&cone) / exact - 1.0).abs() < 1e-9,
                "{cone:?}"
            );
        }
    }
}
