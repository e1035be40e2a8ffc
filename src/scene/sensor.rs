//! What the camera's pixels do with the light that arrives.

use std::f64::consts::FRAC_PI_4;

use super::{
    Limits,
    parameters::{check_limits, parameters},
    validate::Part,
};
use crate::Result;

const ABOVE_ZERO: Limits = Limits::positive(f64::MAX, "give a finite value above 0");

parameters! {
    /// Converts the radiance that a pixel sees to energy: Q_C = E_C · pixel area · duty cycle · exposure time.
    pub struct Sensor {
        /// Width and height of a pixel, micrometres.
        pixel_pitch_um: [f64; 2] = [0.0; 2], Limits::between(0.01, 1e6, "give micrometres from 0.01 to 1e6, such as 10.0"); needs "pixel_pitch_um = [width, height]";
        /// Of an image, or of each phase image of time of flight, seconds.
        exposure_time_s: f64 = 0.0, ABOVE_ZERO; needs "exposure_time_s = 1.0e-3";
        /// Share of the exposure in which the signal is on.
        duty_cycle: f64 = 1.0, Limits::between(0.0, 1.0, "give a share from 0 to 1");
        /// λ of the light, nanometres. Time of flight needs it, together with `quantum_efficiency`.
        wavelength_nm: Option<f64> = None, Limits::between(1.0, 1e6, "give nanometres from 1 to 1e6");
        /// η, electrons per photon.
        quantum_efficiency: Option<f64> = None, Limits::positive(1.0, "give electrons per photon, above 0 up to 1");
        /// Focal length divided by the diameter of the aperture. Without it, E_C equals the radiance in number, as in the model.
        f_number: Option<f64> = None, ABOVE_ZERO;
    }
}

/// How a pixel converts light to electrons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Photodetector {
    /// λ
    pub wavelength_nm: f64,
    /// η, electrons per photon.
    pub quantum_efficiency: f64,
}

impl Sensor {
    /// Q_C / E_C: joules per W/m² of irradiance on the pixel.
    pub fn joule_per_irradiance(&self) -> f64 {
        let [width_um, height_um] = self.pixel_pitch_um;
        let pixel_area_m2 = width_um * height_um * 1e-12;
        pixel_area_m2 * self.duty_cycle * self.exposure_time_s
    }

    /// E_C divided by the radiance, for light at this cosine of the angle to the axis, sr: (π/4)·cos⁴θ divided by the square of the
    /// f-number.
    pub fn irradiance_per_radiance(&self, cosine: f64) -> f64 {
        match self.f_number {
            None => 1.0,
            Some(f_number) => FRAC_PI_4 * cosine.powi(4) / f_number.powi(2),
        }
    }

    /// For time of flight; `None` if wavelength or quantum efficiency are not given.
    pub fn photodetector(&self) -> Option<Photodetector> {
        Some(Photodetector {
            wavelength_nm: self.wavelength_nm?,
            quantum_efficiency: self.quantum_efficiency?,
        })
    }

    pub(crate) fn validate(&self) -> Result<()> {
        let part = Part("sensor".into());
        check_limits(&part, self)?;
        part.require(
            self.wavelength_nm.is_some() == self.quantum_efficiency.is_some(),
            "has only one of wavelength_nm and quantum_efficiency",
            "give both, such as wavelength_nm = 850.0 and quantum_efficiency = 0.8, or neither",
        )
    }
}
