//! Surface reflectance at one point.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::Bands;

/// Modified Phong BRDF f = k_d/π + k_s·(s+2)/(2π)·max(0, r·v)^s (Lafortune & Willems 1994).
///
/// The factor (s+2)/(2π) keeps the reflected share of any incident power at or below k_d + k_s, and reaches k_s for the
/// specular part at normal incidence. The formula is symmetric in l and v.
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
    /// The specular term is 0 wherever r·v <= 0, for every s. This settles 0^0: at s = 0 the lobe is the open half space
    /// around r, so that f is the limit of s → 0 and no light leaves against the mirror direction. Whether l and v lie
    /// above the horizon is not looked at: the cosines that f is multiplied by see to that.
    pub fn eval(&self, l: DVec3, n: DVec3, v: DVec3) -> Bands {
        let r = 2.0 * n.dot(l) * n - l;
        let lobe = phong_lobe(r.dot(v), self.shininess);
        std::array::from_fn(|band| self.kd[band] / PI + self.ks[band] * lobe)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponent_zero_is_a_half_space() {
        let brdf = Brdf {
            kd: [0.0; 3],
            ks: [1.0; 3],
            shininess: 0.0,
        };
        let at = |v| brdf.eval(DVec3::Z, DVec3::Z, v)[0];
        assert_eq!(at(DVec3::new(0.8, 0.0, 0.6)), 1.0 / PI);
        assert_eq!(at(DVec3::X), 0.0, "r·v = 0");
        assert_eq!(at(DVec3::NEG_Z), 0.0, "r·v < 0");
    }

    #[test]
    fn the_lobe_peaks_in_the_mirror_direction() {
        let brdf = Brdf {
            kd: [0.1, 0.2, 0.3],
            ks: [0.5, 0.25, 0.0],
            shininess: 10.0,
        };
        let f = brdf.eval(
            DVec3::new(0.6, 0.0, 0.8),
            DVec3::Z,
            DVec3::new(-0.6, 0.0, 0.8),
        );
        // (s+2)/(2π) = 6/π; three roundings.
        let expected = [3.1 / PI, 1.7 / PI, 0.3 / PI];
        for band in 0..3 {
            assert!((f[band] - expected[band]).abs() < 1e-14);
        }
    }
}
