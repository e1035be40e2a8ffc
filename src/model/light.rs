//! What a light sends to a point.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::cone::{ConeIntegral, spot_falloff};
use crate::scene::{Bands, Light, PatternAxes, RadiationPattern, SpotCone};

/// I_0 in W/sr: radiant intensity of a spot light along its axis, such that ∫ I_0·s(θ) dω = P_L.
///
/// For a cone with 0 <= θ_i <= θ_o <= 180° and θ_o > 0; infinite when θ_o is 0.
pub fn axial_intensity(power_w: Bands, cone: SpotCone) -> Bands {
    let integral = ConeIntegral::new(cone);
    let effective_solid_angle_sr = TAU * integral.falloff_within(integral.outer_rad);
    power_w.map(|power_w| power_w / effective_solid_angle_sr)
}

/// I_0 in W/sr: radiant intensity of a lamp in directions where its pattern is 1, such that ∫ I_0·p dω = P_L.
pub fn peak_intensity(power_w: Bands, pattern: &RadiationPattern) -> Bands {
    let effective_solid_angle_sr = pattern.total();
    power_w.map(|power_w| power_w / effective_solid_angle_sr)
}

/// I in W/sr towards `direction` (from the light, any length but zero). `None` for a directional light: its rays are parallel, so only its
/// irradiance is finite. For an area light, the intensity of its middle, with all of its power.
pub fn radiant_intensity(light: &Light, direction: DVec3) -> Option<Bands> {
    match light {
        Light::Point { power_w, .. } => Some(power_w.map(|power_w| power_w / (4.0 * PI))),
        Light::Spot {
            direction: axis,
            cone,
            power_w,
            ..
        } => {
            let falloff = spot_falloff(angle_between(*axis, direction), *cone);
            Some(axial_intensity(*power_w, *cone).map(|intensity| intensity * falloff))
        }
        Light::Pattern {
            direction: axis,
            up,
            pattern,
            power_w,
            ..
        } => {
            let share = pattern.intensity(&PatternAxes::new(*axis, *up), direction);
            Some(peak_intensity(*power_w, pattern).map(|intensity| intensity * share))
        }
        Light::Area { .. } => radiant_intensity(&light.at_middle(), direction),
        Light::Directional { .. } => None,
    }
}

/// L_{L→P} in W/m²: irradiance of a surface at P that faces the light. I_{L→P}/d_{LP}² for point and spot lights, E_L for directional
/// lights. For an area light, as if all of its light came from its middle. 0 at the light's own position, where no direction to the light
/// exists.
pub fn irradiance_facing(light: &Light, p_m: DVec3) -> Bands {
    match *light {
        Light::Directional {
            irradiance_w_m2, ..
        } => irradiance_w_m2,
        Light::Point { position_m, .. }
        | Light::Spot { position_m, .. }
        | Light::Pattern { position_m, .. }
        | Light::Area { position_m, .. } => {
            let from_light_m = p_m - position_m;
            let distance_squared_m2 = from_light_m.length_squared();
            match radiant_intensity(light, from_light_m) {
                Some(intensity) if distance_squared_m2 > 0.0 => {
                    intensity.map(|intensity| intensity / distance_squared_m2)
                }
                _ => [0.0; 3],
            }
        }
    }
}

/// Unit vector from P to the light (PL). For a directional light it points against the direction of travel. It is zero at the light's own
/// position.
pub fn direction_to_light(light: &Light, p_m: DVec3) -> DVec3 {
    match *light {
        Light::Directional { direction, .. } => -direction.normalize_or_zero(),
        Light::Point { position_m, .. }
        | Light::Spot { position_m, .. }
        | Light::Pattern { position_m, .. }
        | Light::Area { position_m, .. } => (position_m - p_m).normalize_or_zero(),
    }
}

/// Angle between two vectors of any length, rad. Uses the arctangent, because the arccosine of a dot product loses half the digits for a
/// 10⁻³° cone.
fn angle_between(a: DVec3, b: DVec3) -> f64 {
    let (a, b) = (a.normalize_or_zero(), b.normalize_or_zero());
    a.cross(b).length().atan2(a.dot(b))
}
