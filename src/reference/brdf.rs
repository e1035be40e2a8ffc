//! Modified Phong reflectance: its value, and the sampling of directions.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::texture::Place;
use crate::scene::Material;

/// f = k_d/π + what the lobe adds.
#[derive(Debug, Clone, Copy)]
pub struct Brdf {
    /// Per band, like all light here.
    kd: DVec3,
    lobe: Lobe,
}

/// k_s·(s+2)/(2π)·max(0, r·v)^s (Lafortune & Willems 1994).
#[derive(Debug, Clone, Copy)]
struct Lobe {
    ks: DVec3,
    shininess: f64,
}

/// Samples directions from the cosine lobe and the specular lobe, in proportion to what they reflect.
#[derive(Debug, Clone, Copy)]
pub struct Lobes {
    normal: DVec3,
    /// The view mirrored about the normal: r·v = l·mirror.
    mirror: DVec3,
    lobe: Lobe,
    /// Probability of the specular lobe.
    specular_share: f64,
}

impl Brdf {
    /// What the material, its textures and the vertices' colours give.
    pub fn at(place: &Place, material: &Material) -> Brdf {
        let value = |lookup| place.value(lookup).unwrap_or(DVec3::ONE);
        let colors = &place.mesh.colors;
        let color = match colors[..] {
            [] => DVec3::ONE,
            _ => place.blend(|vertex| DVec3::from(colors[vertex].map(f64::from))),
        };
        Brdf {
            kd: DVec3::from(material.kd) * color * value(material.kd_texture),
            lobe: Lobe {
                ks: DVec3::from(material.ks) * value(material.ks_texture),
                shininess: material.shininess * value(material.shininess_texture).x,
            },
        }
    }

    pub fn is_black(&self) -> bool {
        self.kd == DVec3::ZERO && self.lobe.ks == DVec3::ZERO
    }

    /// f(l, n, v), 1/sr; unit vectors.
    pub fn eval(&self, l: DVec3, n: DVec3, v: DVec3) -> DVec3 {
        self.kd / PI + self.lobe.eval(mirror(l, n), v)
    }

    pub fn lobes(&self, n: DVec3, v: DVec3) -> Lobes {
        let (diffuse, specular) = (self.kd.element_sum(), self.lobe.ks.element_sum());
        Lobes {
            normal: n,
            mirror: mirror(v, n),
            lobe: self.lobe,
            // Also 0 for a black surface.
            specular_share: specular / (diffuse + specular).max(f64::MIN_POSITIVE),
        }
    }
}

impl Lobe {
    fn eval(&self, mirror: DVec3, v: DVec3) -> DVec3 {
        if self.ks == DVec3::ZERO {
            return DVec3::ZERO;
        }
        self.ks * ((self.shininess + 2.0) / TAU * self.shape(mirror.dot(v)))
    }

    /// Probability density of [`Lobe::sample`], 1/sr, times its share of the samples.
    fn density(&self, share: f64, mirror: DVec3, direction: DVec3) -> f64 {
        share * (self.shininess + 1.0) / TAU * self.shape(mirror.dot(direction))
    }

    fn sample(&self, mirror: DVec3, u: [f64; 2]) -> DVec3 {
        let cosine = (1.0 - u[0]).powf(1.0 / (self.shininess + 1.0));
        around(mirror, cosine, u[1])
    }

    /// max(0, cosine)^s; also 0 below the lobe's horizon for s = 0.
    fn shape(&self, cosine: f64) -> f64 {
        if cosine > 0.0 {
            cosine.powf(self.shininess)
        } else {
            0.0
        }
    }
}

impl Lobes {
    /// A unit direction; it may point below the surface. `choice` and `u` are uniform in 0 to 1.
    pub fn sample(&self, choice: f64, u: [f64; 2]) -> DVec3 {
        if choice < self.specular_share {
            self.lobe.sample(self.mirror, u)
        } else {
            around(self.normal, (1.0 - u[0]).sqrt(), u[1])
        }
    }

    /// Probability density of [`Lobes::sample`], 1/sr.
    pub fn density(&self, direction: DVec3) -> f64 {
        let diffuse = (1.0 - self.specular_share) * self.normal.dot(direction).max(0.0) / PI;
        if self.specular_share == 0.0 {
            return diffuse;
        }
        diffuse
            + self
                .lobe
                .density(self.specular_share, self.mirror, direction)
    }
}

fn mirror(direction: DVec3, normal: DVec3) -> DVec3 {
    2.0 * normal.dot(direction) * normal - direction
}

/// The unit vector at an angle from a unit axis, rotated about it by `turn` of a whole turn.
pub fn around(axis: DVec3, cosine: f64, turn: f64) -> DVec3 {
    let (x, y) = axis.any_orthonormal_pair();
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (sin_turn, cos_turn) = (TAU * turn).sin_cos();
    (x * cos_turn + y * sin_turn) * sine + axis * cosine
}
