//! Modified Phong reflectance: its value, and the sampling of directions.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// f = k_d/π + k_s·(s+2)/(2π)·max(0, r·v)^s (Lafortune & Willems 1994).
#[derive(Debug, Clone, Copy)]
pub struct Brdf {
    /// Per band, like all light here.
    pub kd: DVec3,
    pub ks: DVec3,
    pub shininess: f64,
}

/// Samples directions from the cosine lobe and the Phong lobe, in proportion to what they reflect.
#[derive(Debug, Clone, Copy)]
pub struct Lobes {
    normal: DVec3,
    /// The view mirrored about the normal: r·v = l·mirror.
    mirror: DVec3,
    shininess: f64,
    /// Probability of the Phong lobe.
    specular_share: f64,
}

impl Brdf {
    pub fn is_black(&self) -> bool {
        self.kd == DVec3::ZERO && self.ks == DVec3::ZERO
    }

    /// f(l, n, v), 1/sr; unit vectors.
    pub fn eval(&self, l: DVec3, n: DVec3, v: DVec3) -> DVec3 {
        let diffuse = self.kd / PI;
        if self.ks == DVec3::ZERO {
            return diffuse;
        }
        let lobe = (self.shininess + 2.0) / TAU * phong(mirror(l, n).dot(v), self.shininess);
        diffuse + self.ks * lobe
    }

    pub fn lobes(&self, n: DVec3, v: DVec3) -> Lobes {
        let (diffuse, specular) = (self.kd.element_sum(), self.ks.element_sum());
        Lobes {
            normal: n,
            mirror: mirror(v, n),
            shininess: self.shininess,
            // Also 0 for a black surface.
            specular_share: specular / (diffuse + specular).max(f64::MIN_POSITIVE),
        }
    }
}

impl Lobes {
    /// A unit direction; it may point below the surface. `choice` and `u` are uniform in 0 to 1.
    pub fn sample(&self, choice: f64, u: [f64; 2]) -> DVec3 {
        if choice < self.specular_share {
            let cosine = (1.0 - u[0]).powf(1.0 / (self.shininess + 1.0));
            around(self.mirror, cosine, u[1])
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
        let lobe = phong(self.mirror.dot(direction), self.shininess);
        diffuse + self.specular_share * (self.shininess + 1.0) / TAU * lobe
    }
}

/// max(0, cosine)^s; also 0 below the lobe's horizon for s = 0.
fn phong(cosine: f64, shininess: f64) -> f64 {
    if cosine > 0.0 {
        cosine.powf(shininess)
    } else {
        0.0
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
