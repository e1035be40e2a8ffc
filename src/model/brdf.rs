//! Surface reflectance at one point.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::{Bands, Material, MetallicRoughness};

/// As in `shaders/shared/brdf.wgsl`.
const BARE: f32 = 2048.0;

/// f = k_d/π + what the lobe adds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brdf {
    /// k_d, per band, 0 to 1.
    pub kd: Bands,
    pub lobe: Lobe,
}

/// The specular lobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lobe {
    /// Modified Phong, k_s·(s+2)/(2π)·max(0, r·v)^s (Lafortune & Willems 1994).
    ///
    /// The factor (s+2)/(2π) keeps the reflected share of any incident power at or below k_d + k_s. At normal incidence the specular part
    /// reaches k_s. The formula is symmetric in l and v.
    Phong {
        /// k_s, per band, 0 to 1.
        ks: Bands,
        /// s, the Phong exponent, at least 0.
        shininess: f64,
    },
    /// Microfacets, D·V·F: GGX with the height-correlated shadowing of Smith and Schlick's Fresnel term (glTF 2.0, appendix B).
    Microfacets {
        /// F_0, reflectance of a facet straight on, per band.
        f0: Bands,
        /// α, above 0 up to 1.
        alpha: f64,
    },
}

impl Default for Lobe {
    /// None.
    fn default() -> Lobe {
        Lobe::Phong {
            ks: [0.0; 3],
            shininess: 0.0,
        }
    }
}

impl Brdf {
    /// A metallic-roughness surface of this base colour. Its Lambert base gets what its facets leave straight on.
    pub fn metallic_roughness(base_color: Bands, of: &MetallicRoughness) -> Brdf {
        let dielectric = of.dielectric_reflectance();
        let f0 = |base: f64| dielectric + of.metallic * (base - dielectric);
        Brdf {
            kd: base_color.map(|base| base * (1.0 - of.metallic) * (1.0 - dielectric)),
            lobe: Lobe::Microfacets {
                f0: base_color.map(f0),
                alpha: of.roughness.powi(2),
            },
        }
    }

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
        if let Some(microfacets) = &material.microfacets {
            return Brdf::metallic_roughness(material.kd, microfacets);
        }
        Brdf {
            kd: material.kd,
            lobe: Lobe::Phong {
                ks: material.ks,
                shininess: material.shininess,
            },
        }
    }
}

impl Lobe {
    fn eval(&self, l: DVec3, n: DVec3, v: DVec3) -> Bands {
        match *self {
            Lobe::Phong { ks, shininess } => phong(ks, shininess, l, n, v),
            Lobe::Microfacets { f0, alpha } => microfacets(f0, alpha, l, n, v),
        }
    }

    /// `LobeParameters` of `shaders/shared/brdf.wgsl`.
    pub fn texel(&self) -> [f32; 4] {
        let ([r, g, b], spread) = match *self {
            Lobe::Phong { ks, shininess } => (ks, shininess),
            Lobe::Microfacets { f0, alpha } => (f0, -alpha),
        };
        [r, g, b, spread].map(|number| number as f32)
    }

    /// The inverse of [`Lobe::texel`]. Shaders also tell whether k_d is 0.
    pub fn of_texel(texel: [f32; 4]) -> Lobe {
        let [r, g, b, spread] = texel.map(f64::from);
        let is_bare = spread < -1.0;
        let spread = if is_bare {
            spread / f64::from(BARE)
        } else {
            spread
        };
        match spread < 0.0 {
            false => Lobe::Phong {
                ks: [r, g, b],
                shininess: spread,
            },
            true => Lobe::Microfacets {
                f0: [r, g, b],
                alpha: -spread,
            },
        }
    }
}

/// It is 0 wherever r·v <= 0, for every s. This defines 0^0: at s = 0 the lobe is the open half space around r, so f is the limit of
/// s → 0 and no light leaves against the mirror direction.
fn phong(ks: Bands, shininess: f64, l: DVec3, n: DVec3, v: DVec3) -> Bands {
    let r = 2.0 * n.dot(l) * n - l;
    let cosine = r.dot(v);
    if ks == [0.0; 3] || cosine <= 0.0 {
        return [0.0; 3];
    }
    let shape = (shininess + 2.0) / TAU * cosine.powf(shininess);
    ks.map(|ks| ks * shape)
}

/// It is 0 if l or v is below the horizon.
fn microfacets(f0: Bands, alpha: f64, l: DVec3, n: DVec3, v: DVec3) -> Bands {
    let (cosine_l, cosine_v) = (n.dot(l), n.dot(v));
    if cosine_l <= 0.0 || cosine_v <= 0.0 {
        return [0.0; 3];
    }
    let h = (l + v).normalize();
    let (a2, sine_squared) = (alpha * alpha, n.cross(h).length_squared());
    // (n·h)²·(α²−1) + 1 without cancellation.
    let spread = a2 * n.dot(h).powi(2) + sine_squared;
    let d = a2 / (PI * spread * spread);
    let smith = |a: f64, b: f64| a * (a2 + (1.0 - a2) * b * b).sqrt();
    let visibility = 0.5 / (smith(cosine_l, cosine_v) + smith(cosine_v, cosine_l));
    let grazing = (1.0 - h.dot(v)).clamp(0.0, 1.0).powi(5);
    let f90 = f90(f0);
    f0.map(|f0| d * visibility * (f0 + (f90 - f0) * grazing))
}

/// F_90: what reflects less than any dielectric straight on, reflects less at grazing angles, too.
fn f90(f0: Bands) -> f64 {
    (50.0 * f0.into_iter().fold(0.0, f64::max)).min(1.0)
}
