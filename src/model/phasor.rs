//! Time of flight: how a path's length changes the light of a modulated source, and how phase images sample it.

use std::f64::consts::{PI, TAU};
use std::iter::Sum;
use std::ops::{Add, Mul};

use crate::scene::TimeOfFlight;

/// c, m/s.
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
/// The relative rounding error of differences that cancel, at most.
const CANCELLED: f64 = 1e-12;
/// h, J·s.
pub const PLANCK_CONSTANT_J_S: f64 = 6.626_070_15e-34;

/// Z = Σ over paths of L·e^{+i·2πf·d/c}: the light of a modulated source, with a length d for each path. In the unit of L.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Phasor {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Phasor {
    /// e^{iφ}
    pub fn of_angle(angle_rad: f64) -> Phasor {
        let (im, re) = angle_rad.sin_cos();
        Phasor { re, im }
    }

    /// L·e^{+i·2πf·d/c} of one path.
    pub fn of_path(radiance: f64, length_m: f64, frequency_hz: f64) -> Phasor {
        // Compute in turns first: with more than a thousand turns, the product with 2π has lost digits.
        let turns = frequency_hz / SPEED_OF_LIGHT_M_S * length_m;
        Phasor::of_angle(TAU * turns.fract()) * radiance
    }

    /// |Z|.
    pub fn magnitude(self) -> f64 {
        self.re.hypot(self.im)
    }

    /// arg Z from −π to π, rad; `None` where Z is 0.
    pub fn argument_rad(self) -> Option<f64> {
        (self.re.abs() + self.im.abs() > 0.0).then(|| self.im.atan2(self.re))
    }

    /// Its complex conjugate.
    pub fn conjugate(self) -> Phasor {
        Phasor {
            im: -self.im,
            ..self
        }
    }
}

impl Add for Phasor {
    type Output = Phasor;

    fn add(self, other: Phasor) -> Phasor {
        Phasor {
            re: self.re + other.re,
            im: self.im + other.im,
        }
    }
}

impl Sum for Phasor {
    fn sum<I: Iterator<Item = Phasor>>(phasors: I) -> Phasor {
        phasors.fold(Phasor::default(), Phasor::add)
    }
}

impl Mul for Phasor {
    type Output = Phasor;

    fn mul(self, other: Phasor) -> Phasor {
        Phasor {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }
}

impl Mul<f64> for Phasor {
    type Output = Phasor;

    fn mul(self, factor: f64) -> Phasor {
        Phasor {
            re: self.re * factor,
            im: self.im * factor,
        }
    }
}

/// Half the length of a phasor's paths: r = c·φ/(4πf) with φ = arg Z in [0, 2π), so from 0 to c/(2f), metres. `None` if Z is 0.
pub fn range_m(phasor: Phasor, frequency_hz: f64) -> Option<f64> {
    let phase_rad = phasor.argument_rad()?.rem_euclid(TAU);
    // A tiny negative angle is rounded to 2π.
    let phase_rad = if phase_rad < TAU { phase_rad } else { 0.0 };
    Some(SPEED_OF_LIGHT_M_S / (4.0 * PI * frequency_hz) * phase_rad)
}

/// How much farther a pixel seems to be than by its direct light alone: c/(4πf)·arg(Z·Z̄_direct), from −c/(4f) to c/(4f), metres. `None` if
/// either is 0.
pub fn multipath_error_m(total: Phasor, direct: Phasor, frequency_hz: f64) -> Option<f64> {
    let turn_rad = (total * direct.conjugate()).argument_rad()?;
    Some(SPEED_OF_LIGHT_M_S / (4.0 * PI * frequency_hz) * turn_rad)
}

/// The unambiguous range of a frequency: c/(2f), metres.
pub fn unambiguous_range_m(frequency_hz: f64) -> f64 {
    SPEED_OF_LIGHT_M_S / (2.0 * frequency_hz)
}

/// How often the phase of a path has wrapped: ⌊r/(c/2f)⌋ for half its length r.
pub fn wrap_count(half_length_m: f64, frequency_hz: f64) -> u32 {
    (half_length_m / unambiguous_range_m(frequency_hz)) as u32
}

/// Electrons that light of the energy `energy_j` frees: η·λ·E/(h·c).
pub fn electrons(energy_j: f64, wavelength_m: f64, quantum_efficiency: f64) -> f64 {
    quantum_efficiency * wavelength_m * energy_j / (PLANCK_CONSTANT_J_S * SPEED_OF_LIGHT_M_S)
}

/// How the phase images of one frequency sample a phasor. Only this type defines the sign convention.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseSampling {
    /// K, the demodulation contrast, 0 to 1.
    contrast: f64,
    /// e^{iτ_i}
    delays: Vec<Phasor>,
}

impl PhaseSampling {
    /// N = `phase_count` images, 3 or more: image i is taken at τ_i = 2πi/N.
    pub fn new(phase_count: u32, contrast: f64) -> PhaseSampling {
        let delay = |phase| Phasor::of_angle(PhaseSampling::delay_rad(phase, phase_count));
        PhaseSampling {
            contrast,
            delays: (0..phase_count).map(delay).collect(),
        }
    }

    /// The sampling of one of a camera's frequencies.
    pub fn of(tof: &TimeOfFlight, frequency: usize) -> PhaseSampling {
        PhaseSampling::new(tof.phase_count, tof.contrasts[frequency])
    }

    /// τ_i, rad.
    pub fn delay_rad(phase: u32, phase_count: u32) -> f64 {
        TAU * f64::from(phase) / f64::from(phase_count)
    }

    /// What the two taps collect in phase image i: A_i, B_i = ½(Q ± K·Re(Q_Z·e^{+iτ_i})). `energy` is Q of all light, and `phasor` is Q_Z
    /// of the modulated light, in the same unit.
    pub fn taps(&self, energy: f64, phasor: Phasor, phase: usize) -> [f64; 2] {
        let half_difference = 0.5 * self.contrast * (phasor * self.delays[phase]).re;
        [
            0.5 * energy + half_difference,
            0.5 * energy - half_difference,
        ]
    }

    /// K·Q_Z by least squares from the differences D_i = A_i − B_i of all phase images: 2/N·Σ D_i·e^{−iτ_i}. Its magnitude is the amplitude
    /// and its argument the phase. For four images, φ = atan2(D_3 − D_1, D_0 − D_2).
    pub fn demodulate(&self, differences: impl IntoIterator<Item = f64>) -> Phasor {
        let scale = 2.0 / self.delays.len() as f64;
        let mut sum = Phasor::default();
        let mut largest = 0.0;
        for (difference, delay) in differences.into_iter().zip(&self.delays) {
            sum = sum + delay.conjugate() * (scale * difference);
            largest = f64::max(largest, difference.abs());
        }
        // If the differences cancel, only the rounding of the delays is left, and its phase means nothing.
        let least = CANCELLED * largest;
        // Squares are faster, but the smallest underflow.
        let is_more = match least * least > f64::MIN_POSITIVE {
            true => sum.re * sum.re + sum.im * sum.im > least * least,
            false => sum.magnitude() > least,
        };
        match is_more {
            true => sum,
            false => Phasor::default(),
        }
    }
}
