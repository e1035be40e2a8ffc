//! Surface reflectance at one point.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::{Bands, Material};

/// f = k_d/π + what the lobe adds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brdf {
    /// k_d, per band, 0 to 1.
    pub kd: Bands,
    pub lobe: Lobe,
}

/// The specular lobe of modified Phong, k_s·(s+2)/(2π)·max(0, r·v)^s (Lafortune & Willems 1994).
///
/// The factor (s+2)/(2π) keeps the reflected share of any incident power at or below k_d + k_s. At normal incidence the specular part
/// reaches k_s. The formula is symmetric in l and v.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Lobe {
    /// k_s, per band, 0 to 1.
    pub ks: Bands,
    /// s, the Phong exponent, at least 0.
    pub shininess: f64,
}

impl Brdf {
    /// f(l, n, v) in 1/sr, per band, for unit vectors to the light, along the normal and to the viewer.
    ///
    /// This function does not check whether l and v are above the horizon, because the cosines that multiply f do.
    pub fn eval(&self, l: DVec3, n: DVec3, v: DVec3) -> Bands {
        let specular = self.lobe.eval(l, n, v);
        std::array::from_fn(|band| self.kd[band] / PI + specular[band])
    }
}

impl From<&Material> for Brdf {
    /// Where no texture changes it.
    fn from(material: &Material) -> Brdf {
        Brdf {
            kd: material.kd,
            lobe: Lobe {
                ks: material.ks,
                shininess: material.shininess,
            },
        }
    }
}

impl Lobe {
    /// It is 0 wherever r·v <= 0, for every s. This defines 0^0: at s = 0 the lobe is the open half space around r, so f is the limit of
    /// s → 0 and no light leaves against the mirror direction.
    fn eval(&self, l: DVec3, n: DVec3, v: DVec3) -> Bands {
        let r = 2.0 * n.dot(l) * n - l;
        let cosine = r.dot(v);
        if self.ks != [0.0; 3] && cosine > 0.0 {
            let shape = (self.shininess + 2.0) / TAU * cosine.powf(self.shininess);
            self.ks.map(|ks| ks * shape)
        } else {
            [0.0; 3]
        }
    }

    /// `LobeParameters` of `shaders/shared/brdf.wgsl`.
    pub fn texel(&self) -> [f32; 4] {
        let [r, g, b] = self.ks;
        [r, g, b, self.shininess].map(|number| number as f32)
    }

    /// The inverse of [`Lobe::texel`].
    pub fn of_texel(texel: [f32; 4]) -> Lobe {
        let [r, g, b, shininess] = texel.map(f64::from);
        Lobe {
            ks: [r, g, b],
            shininess,
        }
    }
}
