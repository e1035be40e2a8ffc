//! The cone of a spot light: its angular falloff and the integrals of it.

use std::f64::consts::FRAC_PI_2;

use super::{SpotCone, validate::Part};
use crate::Result;

impl SpotCone {
    /// s(θ), 0 to 1, at the angle θ from the axis: 1 up to θ_i, cos(½π·(θ−θ_i)/(θ_o−θ_i)) up to θ_o, 0 beyond.
    pub fn falloff(self, theta_rad: f64) -> f64 {
        let inner_rad = self.inner_half_angle_deg.to_radians();
        let outer_rad = self.outer_half_angle_deg.to_radians();
        if theta_rad <= inner_rad {
            1.0
        } else if theta_rad < outer_rad {
            (FRAC_PI_2 * (theta_rad - inner_rad) / (outer_rad - inner_rad)).cos()
        } else {
            0.0
        }
    }

    pub(super) fn validate(self, part: &Part) -> Result<()> {
        let (inner, outer) = (self.inner_half_angle_deg, self.outer_half_angle_deg);
        part.require(
            inner <= outer,
            format_args!(
                "inner_half_angle_deg {inner} is larger than outer_half_angle_deg {outer}"
            ),
            "make the inner cone no wider than the outer",
        )
    }
}

/// Integrals of a spot light's cone from the axis outwards, in closed form.
///
/// Values are per radian of azimuth; multiply by 2π for solid angles. The relative accuracy is that of f64, from cones of 10⁻³° and below
/// up to the whole sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConeIntegral {
    /// θ_i
    pub inner_rad: f64,
    /// θ_o
    pub outer_rad: f64,
}

impl ConeIntegral {
    /// For a cone with 0 <= θ_i <= θ_o <= 180°.
    pub fn new(cone: SpotCone) -> Self {
        ConeIntegral {
            inner_rad: cone.inner_half_angle_deg.to_radians(),
            outer_rad: cone.outer_half_angle_deg.to_radians(),
        }
    }

    /// Angles at which the falloff is not smooth.
    pub fn kinks_rad(&self) -> Vec<f64> {
        vec![self.inner_rad, self.outer_rad]
    }

    /// ∫ sin θ' dθ' from 0 to min(θ, θ_o): solid angle of the cone inside θ per radian of azimuth, sr/rad.
    pub fn solid_angle_within(&self, theta_rad: f64) -> f64 {
        versine(theta_rad.min(self.outer_rad))
    }

    /// ∫ s(θ')·sin θ' dθ' from 0 to min(θ, θ_o): that solid angle weighted by the falloff, sr/rad.
    pub fn falloff_within(&self, theta_rad: f64) -> f64 {
        let theta_rad = theta_rad.min(self.outer_rad);
        if theta_rad <= self.inner_rad {
            versine(theta_rad)
        } else {
            versine(self.inner_rad) + self.ramp_within(theta_rad)
        }
    }

    /// ∫ s·sin from θ_i to θ, for θ in (θ_i, θ_o]. With t = θ − θ_i, w = θ_o − θ_i, x = ½π·t/w the integrand is
    /// cos(½π·t'/w)·sin(θ_i + t').
    fn ramp_within(&self, theta_rad: f64) -> f64 {
        let w = self.outer_rad - self.inner_rad;
        let t = theta_rad - self.inner_rad;
        let x = FRAC_PI_2 * t / w;
        if w < 1.0 {
            // The antiderivative. Differences of cosines are written as products, so that nothing cancels for narrow cones. Its denominator
            // vanishes at w = ½π.
            let half_x_sin = (0.5 * x).sin();
            let sum = FRAC_PI_2 * w * x.sin() * theta_rad.sin()
                - 2.0
                    * w
                    * w
                    * (half_x_sin * half_x_sin * theta_rad.cos()
                        + (self.inner_rad + 0.5 * t).sin() * (0.5 * t).sin());
            sum / (FRAC_PI_2 * FRAC_PI_2 - w * w)
        } else {
            // Product to sum, then ∫₀ᵗ sin(a + b·t') dt' = t·sin(a + b·t/2)·sinc(b·t/2). This is regular at w = ½π, where b of the second
            // term is 0, but the two terms cancel for small w.
            let mean_sine = |half_turn: f64| (self.inner_rad + half_turn).sin() * sinc(half_turn);
            0.5 * t * (mean_sine(0.5 * (t + x)) + mean_sine(0.5 * (t - x)))
        }
    }
}

/// 1 − cos θ without cancellation.
fn versine(theta_rad: f64) -> f64 {
    let half_sin = (0.5 * theta_rad).sin();
    2.0 * half_sin * half_sin
}

/// sin(x)/x.
fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}
