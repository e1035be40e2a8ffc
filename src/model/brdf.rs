//! Surface reflectance at one point.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::Bands;

/// Modified Phong BRDF f = k_d/π + k_s·(s+2)/(2π)·max(0, r·v)^s (Lafortune & Willems 1994).
///
/// The factor (s+2)/(2π) keeps the reflected share of any incident power at or below k_d + k_s. At normal incidence the specular part
/// reaches k_s. The formula is symmetric in l and v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brdf {
    /// k_d, per band, 0 to 1.
    pub kd: Bands,
    /// k_s, per band, 0 to 1.
    pub ks: Bands,
    /// s, the Phong exponent, at least 0.
    pub shininess: f64,
}

impl Brdf {
    /// f(l, n, v) in 1/sr, per band, for unit vectors to the light, along the normal and to the viewer.
    ///
    /// The specular term is 0 wherever r·v <= 0, for every s. This defines 0^0: at s = 0 the lobe is the open half space around r, so f is
    /// the limit of s → 0 and no light leaves against the mirror direction. This function does not check whether l and v are above the
    /// horizon, because the cosines that multiply f do.
    pub fn eval(&self, l: DVec3, n: DVec3, v: DVec3) -> Bands {
        let diffuse = self.kd.map(|kd| kd / PI);
        if self.ks == [0.0; 3] {
            return diffuse;
        }
        let r = 2.0 * n.dot(l) * n - l;
        let lobe = phong_lobe(r.dot(v), self.shininess);
        std::array::from_fn(|band| diffuse[band] + self.ks[band] * lobe)
    }
}

/// (s+2)/(2π)·max(0, r·v)^s in 1/sr.
fn phong_lobe(cos_r_v: f64, shininess: f64) -> f64 {
    if cos_r_v > 0.0 {
        (shininess + 2.0) / TAU * cos_r_v.powf(shininess)
    } else {
        0.0
    }
}
