//! What lights send to a point, and rays drawn from what they emit. Lengths are local units.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::{
    brdf::around,
    rays::{NO_TRIANGLE, Ray},
};
use crate::scene::{Bands, Light, SpotCone};

/// Radius of a sphere around the local space.
const SCENE_RADIUS: f64 = 1.733;

/// Rounding of where a ray meets the surface that a lamp lies in, over the lamp's distance from the origin and the scene's
/// size: such a lamp lights both sides of its surface, which is not in its way.
const LAMP_ROUNDING: f64 = 1e-13;

/// A light, ready for sampling.
#[derive(Debug, Clone, Copy)]
pub enum Emitter {
    /// Point and spot lights.
    Cone {
        position: DVec3,
        axis: DVec3,
        /// θ_i, θ_o
        inner_rad: f64,
        outer_rad: f64,
        /// I_0 over the local unit squared: I_0/d² is W/m².
        intensity: Bands,
    },
    Parallel {
        travel: DVec3,
        irradiance: Bands,
    },
}

/// How a light reaches a point.
#[derive(Debug, Clone, Copy)]
pub struct Illumination {
    /// Unit vector to the light.
    pub to_light: DVec3,
    /// Irradiance of a surface that faces the light, W/m².
    pub facing: Bands,
    /// Density of [`Emitter::sample`] over a surface that faces the light, per square unit.
    pub density: f64,
    /// To just before the light.
    pub distance: f64,
}

impl Emitter {
    pub fn new(light: &Light, to_local: impl Fn(DVec3) -> DVec3, metres_per_unit: f64) -> Emitter {
        match *light {
            Light::Point {
                position_m,
                power_w,
            } => Emitter::Cone {
                position: to_local(position_m),
                axis: DVec3::Z,
                inner_rad: PI,
                outer_rad: PI,
                intensity: power_w
                    .map(|power| power / (4.0 * PI) / metres_per_unit / metres_per_unit),
            },
            Light::Spot {
                position_m,
                direction,
                cone,
                power_w,
            } => {
                let weighted_solid_angle = weighted_solid_angle(cone);
                Emitter::Cone {
                    position: to_local(position_m),
                    axis: direction.normalize(),
                    inner_rad: cone.inner_half_angle_deg.to_radians(),
                    outer_rad: cone.outer_half_angle_deg.to_radians(),
                    intensity: power_w.map(|power| {
                        power / weighted_solid_angle / metres_per_unit / metres_per_unit
                    }),
                }
            }
            Light::Directional {
                direction,
                irradiance_w_m2,
            } => Emitter::Parallel {
                travel: direction.normalize(),
                irradiance: irradiance_w_m2,
            },
        }
    }

    /// `None` where the light sends nothing.
    pub fn illuminate(&self, point: DVec3) -> Option<Illumination> {
        match *self {
            Emitter::Parallel { travel, irradiance } => Some(Illumination {
                to_light: -travel,
                facing: irradiance,
                density: 1.0 / (PI * SCENE_RADIUS * SCENE_RADIUS),
                distance: f64::INFINITY,
            }),
            Emitter::Cone {
                position,
                axis,
                inner_rad,
                outer_rad,
                intensity,
            } => {
                let offset = position - point;
                let distance_squared = offset.length_squared();
                let distance = distance_squared.sqrt();
                let to_light = offset / distance;
                if !to_light.is_finite() {
                    return None;
                }
                let falloff = if inner_rad >= PI {
                    1.0
                } else {
                    falloff(angle(axis, -to_light), inner_rad, outer_rad)
                };
                (falloff > 0.0).then(|| Illumination {
                    to_light,
                    facing: intensity.map(|intensity| intensity * falloff / distance_squared),
                    density: 1.0 / (cap_solid_angle(outer_rad) * distance_squared),
                    distance: distance - clearance(position),
                })
            }
        }
    }

    /// A ray that the light emits, evenly over its directions (parallel light: over a disc across the scene). `u` is uniform
    /// in 0 to 1.
    pub fn sample(&self, u: [f64; 2]) -> Ray {
        let (origin, direction) = match *self {
            Emitter::Parallel { travel, .. } => {
                let (x, y) = travel.any_orthonormal_pair();
                let (sin_turn, cos_turn) = (TAU * u[1]).sin_cos();
                let across = SCENE_RADIUS * u[0].sqrt() * (x * cos_turn + y * sin_turn);
                (across - 2.0 * SCENE_RADIUS * travel, travel)
            }
            Emitter::Cone {
                position,
                axis,
                outer_rad,
                ..
            } => {
                // 1 − cos θ is even in the solid angle. By the half angle, for narrow cones.
                let half_sine = (0.5 * outer_rad).sin();
                let versine = 2.0 * half_sine * half_sine * u[0];
                let sine = (versine * (2.0 - versine)).max(0.0).sqrt();
                let across = around(axis, 0.0, u[1]);
                let direction = axis * (1.0 - versine) + across * sine;
                (position + clearance(position) * direction, direction)
            }
        };
        Ray {
            origin,
            direction,
            end: f64::INFINITY,
            from_triangle: NO_TRIANGLE,
            to_triangle: NO_TRIANGLE,
        }
    }
}

fn clearance(lamp: DVec3) -> f64 {
    LAMP_ROUNDING * (1.0 + lamp.length())
}

/// s(θ)
fn falloff(theta_rad: f64, inner_rad: f64, outer_rad: f64) -> f64 {
    if theta_rad <= inner_rad {
        1.0
    } else if theta_rad < outer_rad {
        (FRAC_PI_2 * (theta_rad - inner_rad) / (outer_rad - inner_rad)).cos()
    } else {
        0.0
    }
}

/// Solid angle within θ of an axis, sr.
fn cap_solid_angle(theta_rad: f64) -> f64 {
    let half_sine = (0.5 * theta_rad).sin();
    4.0 * PI * half_sine * half_sine
}

/// ∫ s(θ) dω: the cap within θ_i, and the rest by Gauss-Legendre quadrature, whose integrand is smooth and keeps its digits for
/// narrow cones because it is a sum of like signs.
fn weighted_solid_angle(cone: SpotCone) -> f64 {
    // Nodes and weights of five points on −1 to 1 (Abramowitz & Stegun 25.4.30).
    const NODES: [(f64, f64); 3] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    const PARTS: usize = 32;
    let inner_rad = cone.inner_half_angle_deg.to_radians();
    let outer_rad = cone.outer_half_angle_deg.to_radians();
    let half_part = 0.5 * (outer_rad - inner_rad) / PARTS as f64;
    let ring = |theta: f64| falloff(theta, inner_rad, outer_rad) * theta.sin();
    let penumbra: f64 = (0..PARTS)
        .map(|part| {
            let middle = inner_rad + half_part * (2 * part + 1) as f64;
            let pairs = NODES[1..].iter().map(|(node, weight)| {
                weight * (ring(middle - half_part * node) + ring(middle + half_part * node))
            });
            half_part * (NODES[0].1 * ring(middle) + pairs.sum::<f64>())
        })
        .sum();
    cap_solid_angle(inner_rad) + TAU * penumbra
}

/// Angle between unit vectors, rad; also small ones keep their digits.
fn angle(a: DVec3, b: DVec3) -> f64 {
    2.0 * (a - b).length().atan2((a + b).length())
}
