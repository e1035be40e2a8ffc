//! Reflectance: its value, and the sampling of directions.

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

#[derive(Debug, Clone, Copy)]
enum Lobe {
    /// k_s·(s+2)/(2π)·max(0, r·v)^s (Lafortune & Willems 1994).
    Phong { ks: DVec3, shininess: f64 },
    /// D·G·F/(4·n·l·n·v), GGX (Walter et al. 2007; Heitz 2014).
    Microfacets { f0: DVec3, alpha: f64 },
}

/// Samples directions from the cosine lobe and the specular lobe, in proportion to what they reflect.
#[derive(Debug, Clone, Copy)]
pub struct Lobes {
    normal: DVec3,
    view: DVec3,
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
        let kd = DVec3::from(material.kd) * color * value(material.kd_texture);
        let Some(of) = &material.microfacets else {
            let lobe = Lobe::Phong {
                ks: DVec3::from(material.ks) * value(material.ks_texture),
                shininess: material.shininess * value(material.shininess_texture).x,
            };
            return Brdf { kd, lobe };
        };
        let texel = value(material.metallic_roughness_texture);
        let metallic = of.metallic * texel.z;
        let roughness = (of.roughness * texel.y).clamp(0.03, 1.0);
        let straight_on = of.specular * ((1.0 - of.ior) / (1.0 + of.ior)).powi(2);
        Brdf {
            kd: kd * (1.0 - metallic) * (1.0 - straight_on),
            lobe: Lobe::Microfacets {
                f0: DVec3::splat(straight_on).lerp(kd, metallic),
                alpha: roughness * roughness,
            },
        }
    }

    pub fn is_black(&self) -> bool {
        let (Lobe::Phong { ks: factor, .. } | Lobe::Microfacets { f0: factor, .. }) = self.lobe;
        self.kd == DVec3::ZERO && factor == DVec3::ZERO
    }

    /// f(l, n, v), 1/sr; unit vectors.
    pub fn eval(&self, l: DVec3, n: DVec3, v: DVec3) -> DVec3 {
        self.kd / PI + self.lobe.eval(l, n, v)
    }

    pub fn lobes(&self, n: DVec3, v: DVec3) -> Lobes {
        let (diffuse, specular) = (self.kd.element_sum(), self.lobe.strength(n, v));
        Lobes {
            normal: n,
            view: v,
            lobe: self.lobe,
            // Also 0 for a black surface.
            specular_share: specular / (diffuse + specular).max(f64::MIN_POSITIVE),
        }
    }
}

impl Lobe {
    fn eval(&self, l: DVec3, n: DVec3, v: DVec3) -> DVec3 {
        match *self {
            Lobe::Phong {
                ks: DVec3::ZERO, ..
            } => DVec3::ZERO,
            Lobe::Phong { ks, shininess } => {
                ks * ((shininess + 2.0) / TAU * phong_shape(mirror(l, n).dot(v), shininess))
            }
            Lobe::Microfacets { f0, alpha } => {
                let (cosine_l, cosine_v) = (n.dot(l), n.dot(v));
                if cosine_l <= 0.0 || cosine_v <= 0.0 {
                    return DVec3::ZERO;
                }
                let h = (l + v).normalize();
                let masking = 1.0 / (1.0 + lambda(alpha, cosine_l) + lambda(alpha, cosine_v));
                facets(alpha, n, h) * masking * fresnel(f0, h.dot(l)) / (4.0 * cosine_l * cosine_v)
            }
        }
    }

    /// About what it reflects of all that arrives from the mirror direction, all bands together.
    fn strength(&self, n: DVec3, v: DVec3) -> f64 {
        match *self {
            Lobe::Phong { ks, .. } => ks.element_sum(),
            Lobe::Microfacets { .. } if n.dot(v) <= 0.0 => 0.0,
            Lobe::Microfacets { f0, .. } => fresnel(f0, n.dot(v)).element_sum(),
        }
    }

    /// Probability density of [`Lobe::sample`], 1/sr.
    fn density(&self, direction: DVec3, n: DVec3, v: DVec3) -> f64 {
        match *self {
            Lobe::Phong { shininess, .. } => {
                (shininess + 1.0) / TAU * phong_shape(mirror(v, n).dot(direction), shininess)
            }
            Lobe::Microfacets { alpha, .. } => {
                let h = (direction + v).normalize_or(n);
                // Facets that face away are in the direction below the surface that mirrors v at their backs.
                if n.dot(h) <= 0.0 || v.dot(h) <= 0.0 {
                    return 0.0;
                }
                let cosine = n.dot(v);
                facets(alpha, n, h) / ((1.0 + lambda(alpha, cosine)) * 4.0 * cosine)
            }
        }
    }

    fn sample(&self, n: DVec3, v: DVec3, u: [f64; 2]) -> DVec3 {
        match *self {
            Lobe::Phong { shininess, .. } => {
                let cosine = (1.0 - u[0]).powf(1.0 / (shininess + 1.0));
                around(mirror(v, n), cosine, u[1])
            }
            Lobe::Microfacets { alpha, .. } => mirror(v, visible_normal(alpha, n, v, u)),
        }
    }
}

/// max(0, cosine)^s; also 0 below the lobe's horizon for s = 0.
fn phong_shape(cosine: f64, shininess: f64) -> f64 {
    if cosine > 0.0 {
        cosine.powf(shininess)
    } else {
        0.0
    }
}

/// D, 1/sr: facets per projected area of the surface that face along h.
fn facets(alpha: f64, n: DVec3, h: DVec3) -> f64 {
    let cosine = n.dot(h);
    let tangent_squared = n.cross(h).length_squared() / (cosine * cosine);
    1.0 / (PI * (alpha * cosine * cosine * (1.0 + tangent_squared / (alpha * alpha))).powi(2))
}

/// Λ of Smith: hidden facets for each visible one.
fn lambda(alpha: f64, cosine: f64) -> f64 {
    let tangent_squared = (1.0 - cosine * cosine).max(0.0) / (cosine * cosine);
    ((1.0 + alpha * alpha * tangent_squared).sqrt() - 1.0) / 2.0
}

/// Schlick 1994. F_90 is 1, but less for what reflects less than 2 % straight on.
fn fresnel(f0: DVec3, cosine: f64) -> DVec3 {
    let at_90 = (f0.max_element() / 0.02).min(1.0);
    f0.lerp(DVec3::splat(at_90), (1.0 - cosine.min(1.0)).powi(5))
}

/// A facet that is seen from v, in proportion to its projected area (Heitz 2018): a point of the disc that a stretched hemisphere shows
/// to v.
fn visible_normal(alpha: f64, n: DVec3, v: DVec3, [u, turn]: [f64; 2]) -> DVec3 {
    let (x, y) = n.any_orthonormal_pair();
    let stretched = DVec3::new(alpha * x.dot(v), alpha * y.dot(v), n.dot(v)).normalize();
    let across = DVec3::Z.cross(stretched).normalize_or(DVec3::X);
    let along = stretched.cross(across);
    let (sine, cosine) = (TAU * turn).sin_cos();
    let right = u.sqrt() * cosine;
    // The half of the disc that is nearer to the horizon is foreshortened.
    let foreshortened = 0.5 * (1.0 + stretched.z);
    let half = (1.0 - right * right).max(0.0).sqrt();
    let up = (1.0 - foreshortened) * half + foreshortened * u.sqrt() * sine;
    let out = (1.0 - right * right - up * up).max(0.0).sqrt();
    let facet = across * right + along * up + stretched * out;
    let facet = DVec3::new(alpha * facet.x, alpha * facet.y, facet.z.max(0.0));
    (x * facet.x + y * facet.y + n * facet.z).normalize_or(n)
}

impl Lobes {
    /// A unit direction; it may point below the surface. `choice` and `u` are uniform in 0 to 1.
    pub fn sample(&self, choice: f64, u: [f64; 2]) -> DVec3 {
        if choice < self.specular_share {
            self.lobe.sample(self.normal, self.view, u)
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
        let specular = self.lobe.density(direction, self.normal, self.view);
        diffuse + self.specular_share * specular
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
