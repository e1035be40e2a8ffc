//! Light that reaches the camera from two surfaces: the single bounce, by either sum.

use std::f64::consts::PI;

use glam::DVec3;

use super::{Brdf, CompensatedSum, Phasor, SPEED_OF_LIGHT_M_S};
use crate::scene::{Bands, TimeOfFlight, VplSum};

/// A virtual point light: a lit surface point Q that stands for one texel of the reflective shadow map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vpl {
    /// Q
    pub position_m: DVec3,
    /// n_Q, on the lit side.
    pub normal: DVec3,
    /// QL, unit vector from Q to the light.
    pub to_light: DVec3,
    /// f_Q
    pub brdf: Brdf,
    /// L_{L→Q}, irradiance at Q of a surface that faces the light, W/m².
    pub irradiance_facing_w_m2: Bands,
    /// I·ΔΩ, or E_L·ΔA_perp for a directional light: power that the light sends into the texel, W.
    pub incident_power_w: Bands,
    /// |LQ|
    pub from_light_m: f64,
    /// Area of the surface that the texel shows, m².
    pub area_m2: f64,
    /// ΔΩ_Q/ΣΔΩ, the texel's share of the light's emission domain: 1/|RSM| for equal texels.
    pub domain_share: f64,
}

/// A surface point P that a pixel sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Receiver {
    /// P
    pub position_m: DVec3,
    /// n_P, on the side that the camera sees.
    pub normal: DVec3,
    /// v, unit vector from P to the camera.
    pub to_camera: DVec3,
    /// f_P
    pub brdf: Brdf,
}

/// What one VPL adds to the radiance of P towards the camera, W/sr/m², without the visibility between P and Q.
///
/// - `rsm-average` (CamSim): (ΔΩ_Q/ΣΔΩ)·f_P(PQ, n_P, v)·[f_Q(QL, n_Q, QP)·L_{L→Q}·cosθ_{Q→L}]·cosθ_{P→Q}
/// - `instant-radiosity` (Keller 1997): f_P·f_Q·I·ΔΩ·cosθ_{P→Q}·cosθ_{Q→P}/d_{PQ}²
///
/// f_Q is 0 if P is below Q's horizon. A VPL at P itself, where no direction PQ exists, adds 0.
pub fn vpl_contribution(sum: VplSum, vpl: &Vpl, receiver: &Receiver) -> Bands {
    let p_to_q_m = vpl.position_m - receiver.position_m;
    let distance_squared_m2 = p_to_q_m.length_squared();
    let to_vpl = p_to_q_m.normalize_or_zero();
    let cos_p = receiver.normal.dot(to_vpl).max(0.0);
    let cos_q = vpl.normal.dot(-to_vpl).max(0.0);
    // Also true if P = Q, because the direction is then zero.
    if cos_q <= 0.0 {
        return [0.0; 3];
    }
    let f_p = receiver
        .brdf
        .eval(to_vpl, receiver.normal, receiver.to_camera);
    let f_q = vpl.brdf.eval(vpl.to_light, vpl.normal, -to_vpl);
    match sum {
        VplSum::RsmAverage => {
            let cos_light = vpl.normal.dot(vpl.to_light).max(0.0);
            std::array::from_fn(|band| {
                let q_to_p = f_q[band] * vpl.irradiance_facing_w_m2[band] * cos_light;
                vpl.domain_share * f_p[band] * q_to_p * cos_p
            })
        }
        VplSum::InstantRadiosity => {
            let geometry_1_m2 = cos_p * cos_q / distance_squared_m2;
            std::array::from_fn(|band| {
                f_p[band] * f_q[band] * vpl.incident_power_w[band] * geometry_1_m2
            })
        }
    }
}

/// Indirect radiance of P towards the camera, W/sr/m²: the sum over the VPLs of every light.
///
/// `visible` is V(P,Q). Only `instant-radiosity` uses it: `rsm-average` has no such factor.
pub fn indirect_radiance(
    sum: VplSum,
    vpls: &[Vpl],
    receiver: &Receiver,
    visible: impl Fn(&Vpl) -> bool,
) -> Bands {
    let mut sums = [CompensatedSum::default(); 3];
    for vpl in vpls {
        if sum == VplSum::InstantRadiosity && !visible(vpl) {
            continue;
        }
        let contribution = vpl_contribution(sum, vpl, receiver);
        for (sum, value) in sums.iter_mut().zip(contribution) {
            sum.add(value);
        }
    }
    sums.map(|sum| sum.value())
}

/// The time-of-flight factor of a VPL's light at P: e^{+i·2πf·(|LQ| + |QP|)/c}, averaged over the VPL's area.
///
/// Over that area, the path length changes along the surface with a gradient of up to g = |(QL + QP)∥|. The mean over a square of edge e is
/// sinc(x), x = π·f/c·e·g, times the phasor of its centre. e^{−x²/6} matches it to fourth order, and tends to 0 where the paths of one VPL
/// cover all phases.
pub fn vpl_phasor(vpl: &Vpl, receiver: &Receiver, frequency_hz: f64) -> Phasor {
    let q_to_p_m = receiver.position_m - vpl.position_m;
    let halfway = vpl.to_light + q_to_p_m.normalize_or_zero();
    let gradient = halfway.reject_from_normalized(vpl.normal).length();
    let x = PI * frequency_hz / SPEED_OF_LIGHT_M_S * vpl.area_m2.sqrt() * gradient;
    let length_m = vpl.from_light_m + q_to_p_m.length();
    Phasor::of_path((-x * x / 6.0).exp(), length_m, frequency_hz)
}

/// Z of the indirect light as the pixels see it, without the way from P to the camera, W/sr/m²: the sum over the VPLs of modulated lights.
pub fn indirect_phasor(
    sum: VplSum,
    vpls: &[Vpl],
    receiver: &Receiver,
    tof: &TimeOfFlight,
    frequency_hz: f64,
) -> Phasor {
    let phasors = vpls.iter().map(|vpl| {
        let contribution = vpl_contribution(sum, vpl, receiver);
        vpl_phasor(vpl, receiver, frequency_hz) * tof.weighted(contribution)
    });
    phasors.sum()
}
