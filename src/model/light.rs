//! What a light sends to a point.

use glam::DVec3;

use crate::scene::{Bands, Lamp, Light};

/// I_0 in W/sr: radiant intensity of a lamp in directions where the profile of its points is 1, such that ∫ I_0·s dω = P_L.
///
/// For a cone with 0 <= θ_i <= θ_o <= 180° and θ_o > 0; infinite when θ_o is 0.
pub fn peak_intensity(lamp: &Lamp) -> Bands {
    let effective_solid_angle_sr = lamp.profile_of_points().total();
    lamp.power_w
        .map(|power_w| power_w / effective_solid_angle_sr)
}

/// I in W/sr towards `direction` (from the light, any length but zero). `None` for a directional light: its rays are parallel, so only its
/// irradiance is finite. For an area light, the intensity of its middle, with all of its power.
pub fn radiant_intensity(light: &Light, direction: DVec3) -> Option<Bands> {
    let lamp = light.lamp()?;
    let share = lamp.profile_of_points().intensity(&lamp.axes(), direction);
    Some(peak_intensity(lamp).map(|intensity| intensity * share))
}

/// L_{L→P} in W/m²: irradiance of a surface at P that faces the light. I_{L→P}/d_{LP}² for point and spot lights, E_L for directional
/// lights. For an area light, as if all of its light came from its middle. 0 at the light's own position, where no direction to the light
/// exists.
pub fn irradiance_facing(light: &Light, p_m: DVec3) -> Bands {
    let Some(position_m) = light.position_m() else {
        return light.emission();
    };
    let from_light_m = p_m - position_m;
    let distance_squared_m2 = from_light_m.length_squared();
    match radiant_intensity(light, from_light_m) {
        Some(intensity) if distance_squared_m2 > 0.0 => {
            intensity.map(|intensity| intensity / distance_squared_m2)
        }
        _ => [0.0; 3],
    }
}

/// Unit vector from P to the light (PL). For a directional light it points against the direction of travel. It is zero at the light's own
/// position.
pub fn direction_to_light(light: &Light, p_m: DVec3) -> DVec3 {
    match light {
        Light::Lamp(lamp) => (lamp.position_m - p_m).normalize_or_zero(),
        Light::Directional { direction, .. } => -direction.normalize_or_zero(),
    }
}
