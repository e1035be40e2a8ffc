//! What the camera's pixels do with the light that arrives.

use std::f64::consts::FRAC_PI_4;

use super::{
    Bands, Limits, ParameterKind, ParameterValue, SensorNoise,
    parameters::{ParameterType, check_limits, parameters},
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
        /// λ of the light, nanometres. Electrons are counted with it and `quantum_efficiency`: time of flight and `noise` need both.
        wavelength_nm: Option<f64> = None, Limits::between(1.0, 1e6, "give nanometres from 1 to 1e6");
        /// η, electrons per photon.
        quantum_efficiency: Option<f64> = None, Limits::positive(1.0, "give electrons per photon, above 0 up to 1");
        /// Focal length divided by the diameter of the aperture. Without it, E_C equals the radiance in number, as in the model.
        f_number: Option<f64> = None, ABOVE_ZERO;
        /// k1, k2 and k3 of the measured vignetting, in place of cos⁴: 1 + k1·r² + k2·r⁴ + k3·r⁶, where r is the distance of a pixel's centre from the principal point over half the diagonal of the image, both in pixels. With an `f_number`.
        vignetting: Option<Vignetting> = None, Limits::between(-1e4, 1e4, "give finite coefficients, as fitted to a flat field");
        /// Factors of `quantum_efficiency` for light in the bands R, G and B. Time of flight has its own.
        band_weights: Bands = [1.0; 3], Limits::between(0.0, 1e6, "give a weight from 0 to 1e6 for each band");
        /// Colour filters of the pixels, row by row from the upper left one: each pixel then counts the electrons of one band.
        bayer: Option<BayerPattern> = None;
        /// Whether a pixel counts the electrons of all bands together.
        monochrome: bool = false;
    }
    with {
        /// How electrons are counted: shot noise, dark current, read noise, full well, gain and bits. `None`: layers hold expected values.
        noise: Option<SensorNoise>;
    }
}

/// Relative illumination of a lens, measured: coefficients of r², r⁴ and r⁶, Lensfun's model "pa".
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Vignetting(pub [f64; 3]);

impl Vignetting {
    /// Light at the square of r, over that at the principal point.
    pub fn at(self, square: f64) -> f64 {
        let [k1, k2, k3] = self.0;
        1.0 + square * (k1 + square * (k2 + square * k3))
    }

    /// The square of r with the least light, from one square of r to another.
    pub(super) fn darkest(self, least: f64, most: f64) -> f64 {
        let [k1, k2, k3] = self.0;
        // Where the slope, k1 + 2·k2·r² + 3·k3·r⁴, is 0. Neither solution cancels, and either may be without end.
        let half = -(k2 + k2.signum() * (k2 * k2 - 3.0 * k1 * k3).max(0.0).sqrt());
        let level = [half / (3.0 * k3), k1 / half];
        let inside = level.into_iter().filter(|at| (least..most).contains(at));
        let all = [least, most].into_iter().chain(inside);
        let darker = |a: f64, b: f64| if self.at(b) < self.at(a) { b } else { a };
        all.reduce(darker).unwrap_or(least)
    }
}

impl ParameterType for Vignetting {
    const KIND: ParameterKind = ParameterKind::Coefficients;

    fn get(&self) -> Option<ParameterValue> {
        Some(ParameterValue::Coefficients(self.0))
    }

    fn set(&mut self, value: ParameterValue) {
        if let ParameterValue::Coefficients(coefficients) = value {
            self.0 = coefficients;
        }
    }
}

/// The colour filters of four pixels: the upper two, then the lower two.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum BayerPattern {
    #[default]
    Rggb,
    Grbg,
    Gbrg,
    Bggr,
}

impl BayerPattern {
    /// All patterns, in the order of the documentation.
    pub const ALL: [BayerPattern; 4] = [
        BayerPattern::Rggb,
        BayerPattern::Grbg,
        BayerPattern::Gbrg,
        BayerPattern::Bggr,
    ];
    const NAMES: [&str; 4] = ["RGGB", "GRBG", "GBRG", "BGGR"];

    /// The name in scene files.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The band that the filter of a pixel lets through, by its column and row.
    pub fn band(self, [x, y]: [usize; 2]) -> usize {
        match self.name().as_bytes()[2 * (y % 2) + x % 2] {
            b'R' => 0,
            b'G' => 1,
            _ => 2,
        }
    }
}

impl ParameterType for BayerPattern {
    const KIND: ParameterKind = ParameterKind::Name(&Self::NAMES);

    fn get(&self) -> Option<ParameterValue> {
        Some(ParameterValue::Name(self.name()))
    }

    fn set(&mut self, value: ParameterValue) {
        let mut patterns = Self::ALL.into_iter();
        let is_named = |pattern: &Self| value == ParameterValue::Name(pattern.name());
        *self = patterns.find(is_named).unwrap_or(*self);
    }
}

/// What the pixels of a sensor count, without time of flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CountedElectrons {
    /// Whether a pixel has one value for all bands.
    pub is_raw: bool,
    pub has_noise: bool,
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

    /// E_C divided by the radiance, sr: (π/4) divided by the square of the f-number, times this share of the light on the axis.
    pub fn irradiance_per_radiance(&self, share: f64) -> f64 {
        match self.f_number {
            None => 1.0,
            Some(f_number) => FRAC_PI_4 * share / f_number.powi(2),
        }
    }

    /// The names of those that are the lens's, in scene files and in headers of images.
    pub(crate) const OF_LENS: [&str; 2] = ["f_number", "vignetting"];

    /// For time of flight; `None` if wavelength or quantum efficiency are not given.
    pub fn photodetector(&self) -> Option<Photodetector> {
        Some(Photodetector {
            wavelength_nm: self.wavelength_nm?,
            quantum_efficiency: self.quantum_efficiency?,
        })
    }

    /// `None` if frames have the energy of the pixels only.
    pub fn counted_electrons(&self) -> Option<CountedElectrons> {
        let counted = CountedElectrons {
            is_raw: self.bayer.is_some() || self.monochrome,
            has_noise: self.noise.is_some(),
        };
        (counted.is_raw || counted.has_noise).then_some(counted)
    }

    pub(crate) fn validate(&self) -> Result<()> {
        let part = Part("sensor".into());
        check_limits(&part, self)?;
        part.require(
            self.wavelength_nm.is_some() == self.quantum_efficiency.is_some(),
            "has only one of wavelength_nm and quantum_efficiency",
            "give both, such as wavelength_nm = 850.0 and quantum_efficiency = 0.8, or neither",
        )?;
        part.require(
            self.vignetting.is_none() || self.f_number.is_some(),
            "vignetting is given without an f_number",
            "give f_number, too: vignetting only tells how much darker the corners are",
        )?;
        part.require(
            !(self.bayer.is_some() && self.monochrome),
            "has both bayer and monochrome",
            "give one of them: a monochrome sensor has no colour filters",
        )?;
        part.require(
            self.counted_electrons().is_none() || self.photodetector().is_some(),
            "counts electrons, but its quantum efficiency is not known",
            "give a wavelength_nm and a quantum_efficiency, such as 550.0 and 0.6",
        )?;
        self.noise
            .map_or(Ok(()), |noise| noise.validate("sensor noise"))
    }
}
