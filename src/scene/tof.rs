//! A time-of-flight camera and what its pixels detect.

use super::{Bands, PlacedLight, Sensor, SensorNoise, validate::Part};
use crate::Result;

/// Maximum number of modulation frequencies of a scene.
pub const MAX_FREQUENCIES: usize = 4;
/// The lowest modulation frequency. A lower one is a frequency in MHz in the place of one in Hz: it does not wrap within 150 km.
const LOWEST_HZ: f64 = 1e3;
/// The valid numbers of phase images per frequency.
pub const PHASE_COUNTS: std::ops::RangeInclusive<u32> = 3..=MAX_PHASES as u32;
pub(crate) const MAX_PHASES: usize = 8;

/// A camera whose pixels correlate light with the modulation of its source (AMCW).
#[derive(Debug, Clone, PartialEq)]
pub struct TimeOfFlight {
    /// One to [`MAX_FREQUENCIES`].
    pub frequencies_hz: Vec<f64>,
    /// N, within [`PHASE_COUNTS`]: phase image i is taken at 2πi/N.
    pub phase_count: u32,
    /// K of each frequency, 0 to 1.
    pub contrasts: Vec<f64>,
    /// The weight of each band in what the pixels see. It applies to the arriving light.
    pub band_weights: Bands,
    /// Added to every measured phase.
    pub phase_offset_deg: f64,
    /// Indices into [`Scene::lights`](crate::Scene::lights) of the lights that are not modulated. All directional lights must be among
    /// them: a path of parallel light has no length.
    pub ambient_lights: Vec<usize>,
    /// The unit of the taps' charges.
    pub output: ChargeUnit,
    /// `None`: layers hold expected values.
    pub noise: Option<SensorNoise>,
}

/// The unit of charges.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ChargeUnit {
    #[default]
    Electrons,
    /// Digital numbers, which need a [`SensorNoise`] for gain, black level and bits.
    DigitalNumbers,
}

impl ChargeUnit {
    /// Both units, in the order of the documentation.
    pub const ALL: [ChargeUnit; 2] = [ChargeUnit::Electrons, ChargeUnit::DigitalNumbers];

    /// The name used in scene files.
    pub fn name(self) -> &'static str {
        match self {
            ChargeUnit::Electrons => "electrons",
            ChargeUnit::DigitalNumbers => "dn",
        }
    }
}

impl TimeOfFlight {
    pub(crate) const DEFAULT_CONTRAST: f64 = 1.0;
    pub(crate) const DEFAULT_BAND_WEIGHTS: Bands = [1.0, 0.0, 0.0];
    pub(crate) const DEFAULT_PHASE_COUNT: u32 = 4;

    /// Keeps only the frequency with this index.
    pub fn keep_frequency(&mut self, frequency: usize) {
        let only =
            |values: &mut Vec<f64>| *values = values.get(frequency).copied().into_iter().collect();
        only(&mut self.frequencies_hz);
        only(&mut self.contrasts);
    }

    /// Whether a light of the scene is modulated.
    pub fn is_modulated(&self, light: usize) -> bool {
        !self.ambient_lights.contains(&light)
    }

    /// The sum over the bands, weighted as the pixels see them.
    pub fn weighted(&self, bands: Bands) -> f64 {
        let bands = bands.iter().zip(&self.band_weights);
        bands.map(|(value, weight)| value * weight).sum()
    }

    /// Checks what does not depend on the rest of the scene.
    pub(crate) fn validate(&self) -> Result<()> {
        let part = Part("tof".into());
        let count = self.frequencies_hz.len();
        part.require(
            (1..=MAX_FREQUENCIES).contains(&count),
            format_args!("there are {count} frequencies"),
            format!("give 1 to {MAX_FREQUENCIES}; for more, render twice"),
        )?;
        part.require_each(
            &self.frequencies_hz,
            |hz| (LOWEST_HZ..=1e12).contains(hz),
            |i, hz| format!("frequency {i} is {hz} Hz"),
            "give 1 kHz to 1 THz; 20 MHz are 20e6 Hz",
        )?;
        let (least, most) = PHASE_COUNTS.into_inner();
        part.require(
            PHASE_COUNTS.contains(&self.phase_count),
            format_args!("phase_count is {}", self.phase_count),
            format!("give {least} to {most} phase images"),
        )?;
        part.require(
            self.contrasts.len() == count,
            format_args!(
                "there are {} contrasts for {count} frequencies",
                self.contrasts.len()
            ),
            "give one for each frequency",
        )?;
        part.require_each(
            &self.contrasts,
            |contrast| (0.0..=1.0).contains(contrast),
            |i, contrast| format!("contrast {i} is {contrast}"),
            "give a share from 0 to 1",
        )?;
        let weights = self.band_weights;
        part.require(
            weights.iter().all(|weight| (0.0..=1e6).contains(weight)) && weights != [0.0; 3],
            format_args!("the weights of the bands are {weights:?}"),
            "give weights from 0 to 1e6, one of them above 0",
        )?;
        part.require(
            self.phase_offset_deg.abs() <= 1e6,
            format_args!("phase_offset_deg is {}", self.phase_offset_deg),
            "give degrees within 1e6 of 0",
        )?;
        let is_in_electrons = self.output == ChargeUnit::Electrons;
        part.require(
            is_in_electrons || self.noise.is_some(),
            "output is \"dn\", and there is no gain",
            "give the time of flight its noise, which has gain, black level and bits",
        )?;
        self.noise
            .map_or(Ok(()), |noise| noise.validate("tof noise"))
    }

    /// Checks whether it goes together with the rest of the scene.
    pub(super) fn validate_with(
        &self,
        lights: &[PlacedLight],
        sensor: Option<&Sensor>,
    ) -> Result<()> {
        let part = Part("tof".into());
        part.require(
            sensor.is_some_and(|sensor| sensor.photodetector().is_some()),
            "the quantum efficiency of the pixels is not known",
            "give the sensor a wavelength_nm and a quantum_efficiency",
        )?;
        part.require_each(
            &self.ambient_lights,
            |&light| light < lights.len(),
            |_, light| format!("ambient light {light} is not in the scene"),
            "give indices of lights",
        )?;
        for (i, light) in lights.iter().enumerate() {
            part.require(
                light.position_m().is_some() || !self.is_modulated(i),
                format_args!(
                    "light {i} ({}) is modulated, but has no position: its paths have no length",
                    light.kind()
                ),
                "list it in ambient_lights, or take a point or a spot light",
            )?;
        }
        Ok(())
    }
}
