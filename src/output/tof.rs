//! What a time-of-flight camera makes of the phasors of its pixels. In f64: of a phase, f32 keeps 1e-7 turns.

use super::{Layer, LayerData, TofQuantity, per_pixel};
use crate::{
    model::{PhaseSampling, Phasor, Reading, electrons, multipath_error_m, range_m, wrap_count},
    scene::{ChargeUnit, Photodetector, Sensor, TimeOfFlight},
};

/// What a pixel has of one frequency.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PixelPhasors {
    pub direct: Phasor,
    pub indirect: Phasor,
}

/// A camera with all that its layers depend on.
#[derive(Clone, Copy)]
pub(crate) struct TofCamera<'t> {
    pub tof: &'t TimeOfFlight,
    pub sensor: Sensor,
    pub photodetector: Photodetector,
    pub frame_index: u32,
}

impl TofCamera<'_> {
    /// The layers of one frequency, but for the standard error. `phasors`, `radiances` (L of all light, as the pixels see it, W/sr/m²) and `half_paths_m`
    /// are those of the pixels.
    pub fn layers(
        &self,
        frequency: usize,
        phasors: &[PixelPhasors],
        radiances: &[f64],
        half_paths_m: &[f64],
    ) -> Vec<(Layer, LayerData)> {
        let frequency_hz = self.tof.frequencies_hz[frequency];
        let total = |i: usize| phasors[i].direct + phasors[i].indirect;
        let count = phasors.len();
        let complex = |value: &(dyn Fn(usize) -> Phasor + Sync)| {
            floats(count, |i| {
                let Phasor { re, im } = value(i);
                [re, im]
            })
        };
        let or_nan = |value: Option<f64>| [value.unwrap_or(f64::NAN)];
        let sampling = PhaseSampling::of(self.tof, frequency);
        let offset = Phasor::of_angle(self.tof.phase_offset_deg.to_radians());
        let delayed = |i: usize| total(i) * offset;
        let images = self.phase_images((frequency, &sampling), &delayed, radiances);
        // K·Q_Z as the phase images tell it.
        let measured = |i: usize| {
            let difference =
                |image: &Vec<f32>| f64::from(image[2 * i]) - f64::from(image[2 * i + 1]);
            sampling.demodulate(images.iter().map(difference))
        };
        let wraps = half_paths_m.iter().map(|&half_m| match half_m.is_finite() {
            true => wrap_count(half_m, frequency_hz),
            false => 0,
        });
        let mut layers = vec![
            (TofQuantity::Phasor, complex(&total)),
            (TofQuantity::PhasorDirect, complex(&|i| phasors[i].direct)),
            (
                TofQuantity::PhasorIndirect,
                complex(&|i| phasors[i].indirect),
            ),
            (
                TofQuantity::Range,
                floats(count, |i| {
                    let measured = match self.tof.noise {
                        Some(_) => measured(i),
                        None => delayed(i),
                    };
                    or_nan(range_m(measured, frequency_hz))
                }),
            ),
            (
                TofQuantity::Amplitude,
                floats(count, |i| [measured(i).magnitude()]),
            ),
            (
                TofQuantity::Intensity,
                floats(count, |i| [self.intensity(&images, i)]),
            ),
            (
                TofQuantity::MultipathError,
                floats(count, |i| {
                    or_nan(multipath_error_m(total(i), phasors[i].direct, frequency_hz))
                }),
            ),
            (TofQuantity::Wraps, LayerData::Id(wraps.collect())),
        ];
        for (phase, image) in images.into_iter().enumerate() {
            layers.push((TofQuantity::Taps(phase as u8), LayerData::Float(image)));
        }
        let named = |(quantity, data)| (Layer::Tof(frequency as u8, quantity), data);
        layers.into_iter().map(named).collect()
    }

    /// What both taps of each pixel give, of each phase image.
    fn phase_images(
        &self,
        (frequency, sampling): (usize, &PhaseSampling),
        phasor: &(dyn Fn(usize) -> Phasor + Sync),
        radiances: &[f64],
    ) -> Vec<Vec<f32>> {
        let per_radiance = electrons(
            self.sensor.joule_per_irradiance(),
            1e-9 * self.photodetector.wavelength_nm,
            self.photodetector.quantum_efficiency,
        );
        let image = |phase: usize| {
            let mut taps = vec![0.0; 2 * radiances.len()];
            per_pixel(&mut taps, |i| {
                let phasor = phasor(i) * per_radiance;
                let expected = sampling.taps(per_radiance * radiances[i], phasor, phase);
                [0, 1].map(|tap| {
                    let reading = Reading {
                        frame: self.frame_index,
                        pixel: i as u32,
                        frequency: frequency as u8,
                        phase: phase as u8,
                        tap: tap as u8,
                    };
                    self.read(expected[tap], reading) as f32
                })
            });
            taps
        };
        (0..self.tof.phase_count as usize).map(image).collect()
    }

    /// What a tap gives, in the unit of the output.
    fn read(&self, expected_e: f64, reading: Reading) -> f64 {
        let Some(noise) = &self.tof.noise else {
            return expected_e;
        };
        let electrons = noise.electrons(expected_e, self.sensor.exposure_time_s, reading);
        match self.tof.output {
            ChargeUnit::Electrons => electrons,
            ChargeUnit::DigitalNumbers => noise.digital_number(electrons),
        }
    }

    /// Σ(A + B), what stands for no electrons taken off.
    fn intensity(&self, images: &[Vec<f32>], pixel: usize) -> f64 {
        let none = match (self.tof.output, &self.tof.noise) {
            (ChargeUnit::DigitalNumbers, Some(noise)) => noise.black_level_dn,
            _ => 0.0,
        };
        let taps = images.iter().flat_map(|image| &image[2 * pixel..][..2]);
        taps.map(|&charge| f64::from(charge) - none).sum()
    }
}

/// `N` values for each pixel.
fn floats<const N: usize>(count: usize, value: impl Fn(usize) -> [f64; N] + Sync) -> LayerData {
    let mut values = vec![0.0; N * count];
    per_pixel(&mut values, |i| value(i).map(|value| value as f32));
    LayerData::Float(values)
}
