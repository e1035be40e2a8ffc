//! Light that reaches the camera from one surface.

use glam::DVec3;

use super::{Brdf, direction_to_light, irradiance_facing};
use crate::scene::{Bands, Light};

/// L_{P→C} in W/sr/m² = f_P(l, n_P, v)·L_{L→P}·cosθ_{P→L}: direct radiance of one light, without the visibility V(L,P). The caller applies
/// that factor of 0 or 1.
pub fn direct_radiance(
    light: &Light,
    brdf: &Brdf,
    p_m: DVec3,
    n_p: DVec3,
    camera_position_m: DVec3,
) -> Bands {
    let to_light = direction_to_light(light, p_m);
    let to_camera = (camera_position_m - p_m).normalize_or_zero();
    let cos_light = n_p.dot(to_light).max(0.0);
    let f_p = brdf.eval(to_light, n_p, to_camera);
    let irradiance = irradiance_facing(light, p_m);
    std::array::from_fn(|band| f_p[band] * irradiance[band] * cos_light)
}
