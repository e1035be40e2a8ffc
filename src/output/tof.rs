//! Computes a time-of-flight camera's layers from the phasors of its pixels. Uses f64, because f32 resolves a phase only to 1e-7 turns.

use super::{Frame, Layer, LayerData, TofQuantity, per_pixel};
use crate::{
    Error, Result,
    model::{
        FrameKey, PhaseSampling, Phasor, Reading, electrons, multipath_error_m, range_m, wrap_count,
    },
    scene::{Camera, ChargeUnit, Photodetector, Sensor, TimeOfFlight},
};

/// The phasors of a pixel at one frequency.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PixelPhasors {
    pub direct: Phasor,
    pub indirect: Phasor,
}

/// A camera with everything that its layers depend on.
#[derive(Clone, Copy)]
pub(crate) struct TofCamera<'t> {
    pub tof: &'t TimeOfFlight,
    pub camera: Camera,
    pub sensor: Sensor,
    pub photodetector: Photodetector,
    pub frame: FrameKey,
}

/// Light of a phase image, by its index and the pixel's index: L of all light, and Z with the camera's phase offset, W/sr/m²; or E and its
/// phasor, W/m².
type PhaseLight<'l> = dyn Fn(usize, usize) -> (f64, Phasor) + Sync + 'l;

impl TofCamera<'_> {
    /// The layers of one frequency, except the standard error. `phasors`, `radiances` (L of all light at the pixel, W/sr/m²) and
    /// `half_paths_m` have one value per pixel.
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
        let wraps = half_paths_m.iter().map(|&half_m| match half_m.is_finite() {
            true => wrap_count(half_m, frequency_hz),
            false => 0,
        });
        let multipath_error =
            |i: usize| or_nan(multipath_error_m(total(i), phasors[i].direct, frequency_hz));
        let of_paths = [
            (TofQuantity::Phasor, complex(&total)),
            (TofQuantity::PhasorDirect, complex(&|i| phasors[i].direct)),
            (
                TofQuantity::PhasorIndirect,
                complex(&|i| phasors[i].indirect),
            ),
            (TofQuantity::MultipathError, floats(count, multipath_error)),
            (TofQuantity::Wraps, LayerData::Id(wraps.collect())),
        ];
        let named = |(quantity, data)| (Layer::Tof(frequency as u8, quantity), data);
        let mut layers: Vec<_> = of_paths.into_iter().map(named).collect();
        let offset = self.phase_offset();
        let light = |_, i: usize| (radiances[i], total(i) * offset);
        layers.extend(self.measured_layers(frequency, count, &light));
        layers
    }

    fn phase_offset(&self) -> Phasor {
        Phasor::of_angle(self.tof.phase_offset_deg.to_radians())
    }

    /// The phase images of a frequency and the layers computed from them.
    fn measured_layers(
        &self,
        frequency: usize,
        count: usize,
        light: &PhaseLight,
    ) -> Vec<(Layer, LayerData)> {
        let frequency_hz = self.tof.frequencies_hz[frequency];
        let sampling = PhaseSampling::of(self.tof, frequency);
        let irradiance_per_radiance = self.irradiance_per_radiance(count);
        let light = &|phase: usize, i: usize| {
            let (radiance, phasor) = light(phase, i);
            let factor = irradiance_per_radiance.get(i).copied().unwrap_or(1.0);
            (radiance * factor, phasor * factor)
        };
        let phases = 0..self.tof.phase_count as usize;
        let image = |phase| self.phase_image((frequency, &sampling), phase, count, light);
        let images: Vec<Vec<f32>> = phases.clone().map(image).collect();
        // K·Q_Z from the phase images. Without noise, it uses the expected values before they are rounded.
        let measured = |i: usize| {
            let difference = |phase: usize| {
                let [a, b] = match self.tof.noise {
                    None => self.expected_taps(&sampling, phase, light(phase, i)),
                    Some(_) => [0, 1].map(|tap| f64::from(images[phase][2 * i + tap])),
                };
                a - b
            };
            sampling.demodulate(phases.clone().map(difference))
        };
        let mut layers = vec![
            (
                TofQuantity::Range,
                floats(count, |i| or_nan(range_m(measured(i), frequency_hz))),
            ),
            (
                TofQuantity::Amplitude,
                floats(count, |i| [measured(i).magnitude()]),
            ),
            (
                TofQuantity::Intensity,
                floats(count, |i| [self.intensity(&images, i)]),
            ),
        ];
        for (phase, image) in images.into_iter().enumerate() {
            layers.push((TofQuantity::Taps(phase as u8), LayerData::Float(image)));
        }
        let named = |(quantity, data)| (Layer::Tof(frequency as u8, quantity), data);
        layers.into_iter().map(named).collect()
    }

    /// The lens's factor for each pixel; empty if the factor is 1.
    fn irradiance_per_radiance(&self, count: usize) -> Vec<f64> {
        if self.sensor.f_number.is_none() {
            return Vec::new();
        }
        let width = self.camera.resolution_px[0] as usize;
        let mut factors = vec![0.0; count];
        per_pixel(&mut factors, |i| {
            let [x_px, y_px] = [i % width, i / width].map(|place| place as f64 + 0.5);
            let direction = self.camera.unproject(x_px, y_px).unwrap_or_default();
            let cosine = direction.z / direction.length();
            [self.sensor.irradiance_per_radiance(cosine)]
        });
        factors
    }

    /// Electrons of both taps, without noise.
    fn expected_taps(
        &self,
        sampling: &PhaseSampling,
        phase: usize,
        (radiance, phasor): (f64, Phasor),
    ) -> [f64; 2] {
        let per_radiance = electrons(
            self.sensor.joule_per_irradiance(),
            1e-9 * self.photodetector.wavelength_nm,
            self.photodetector.quantum_efficiency,
        );
        sampling.taps(per_radiance * radiance, phasor * per_radiance, phase)
    }

    /// The output of both taps of each pixel.
    fn phase_image(
        &self,
        (frequency, sampling): (usize, &PhaseSampling),
        phase: usize,
        count: usize,
        light: &PhaseLight,
    ) -> Vec<f32> {
        let mut taps = vec![0.0; 2 * count];
        per_pixel(&mut taps, |i| {
            let expected = self.expected_taps(sampling, phase, light(phase, i));
            [0, 1].map(|tap| {
                let reading = Reading {
                    frame: self.frame,
                    pixel: i as u32,
                    frequency: frequency as u8,
                    phase: phase as u8,
                    tap: tap as u8,
                };
                self.read(expected[tap], reading) as f32
            })
        });
        taps
    }

    /// The output of a tap, in the output's unit.
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

    /// Σ(A + B), less the black level of each tap if the output is digital numbers.
    fn intensity(&self, images: &[Vec<f32>], pixel: usize) -> f64 {
        let none = match (self.tof.output, &self.tof.noise) {
            (ChargeUnit::DigitalNumbers, Some(noise)) => noise.black_level_dn,
            _ => 0.0,
        };
        let taps = images.iter().flat_map(|image| &image[2 * pixel..][..2]);
        taps.map(|&charge| f64::from(charge) - none).sum()
    }
}

fn or_nan(value: Option<f64>) -> [f64; 1] {
    [value.unwrap_or(f64::NAN)]
}

/// `N` values for each pixel.
fn floats<const N: usize>(count: usize, value: impl Fn(usize) -> [f64; N] + Sync) -> LayerData {
    let mut values = vec![0.0; N * count];
    per_pixel(&mut values, |i| value(i).map(|value| value as f32));
    LayerData::Float(values)
}

/// The light at the pixels of one phase image, averaged over its exposure: the mean of frames rendered during it.
#[derive(Debug, Clone, Default)]
pub struct Exposure {
    /// Sums over the frames.
    pixels: Vec<(f64, Phasor)>,
    frame_count: u32,
}

impl Exposure {
    /// Adds a frame's light of the modulation frequency with this index.
    ///
    /// # Errors
    /// [`Error::Internal`] for a frame without time of flight at that frequency, or with another size than the previous frames.
    pub fn add(&mut self, frame: &Frame, frequency: usize) -> Result<()> {
        let phasor = Layer::Tof(frequency as u8, TofQuantity::Phasor);
        let (Some(tof), Some(radiances), Some(phasors)) = (
            &frame.description.tof,
            frame.values(Layer::Radiance),
            frame.values(phasor),
        ) else {
            return Err(Error::internal("a frame has no phasors to expose by"));
        };
        let (radiances, _) = radiances.as_chunks::<3>();
        let (phasors, _) = phasors.as_chunks::<2>();
        if self.frame_count == 0 {
            self.pixels = vec![Default::default(); radiances.len()];
        }
        if self.pixels.len() != radiances.len() {
            return Err(Error::internal("frames of one exposure differ in size"));
        }
        let added = radiances.iter().zip(phasors);
        for (sum, (radiance, phasor)) in self.pixels.iter_mut().zip(added) {
            let [re, im] = phasor.map(f64::from);
            sum.0 += tof.weighted(radiance.map(f64::from));
            sum.1 = sum.1 + Phasor { re, im };
        }
        self.frame_count += 1;
        Ok(())
    }

    fn mean(&self, pixel: usize) -> (f64, Phasor) {
        let share = 1.0 / f64::from(self.frame_count);
        let (radiance, phasor) = self.pixels[pixel];
        (radiance * share, phasor * share)
    }
}

impl Frame {
    /// Computes the phase images of a modulation frequency again, each from its own exposure, and from them `range`, `amplitude` and
    /// `intensity`. Other layers stay, including those of the paths.
    ///
    /// # Errors
    /// [`Error::Internal`] for a frame without time of flight at that frequency, or unless each phase image has an exposure with the
    /// frame's number of pixels.
    pub fn expose(&mut self, frequency: usize, exposures: &[Exposure]) -> Result<()> {
        let camera = self.description.time_of_flight();
        let camera = camera.filter(|camera| frequency < camera.tof.frequencies_hz.len());
        let camera = camera.ok_or_else(|| Error::internal("a frame has no phase images"))?;
        let count: usize = self.resolution_px.iter().map(|&px| px as usize).product();
        let is_whole = |exposure: &Exposure| exposure.pixels.len() == count;
        if exposures.len() != camera.tof.phase_count as usize || !exposures.iter().all(is_whole) {
            return Err(Error::internal("phase images and exposures differ"));
        }
        let offset = camera.phase_offset();
        let light = |phase: usize, i: usize| {
            let (radiance, phasor) = exposures[phase].mean(i);
            (radiance, phasor * offset)
        };
        for (layer, data) in camera.measured_layers(frequency, count, &light) {
            let mut own = self.layers.iter_mut();
            if let Some((_, kept)) = own.find(|(own, _)| *own == layer) {
                *kept = data;
            }
        }
        Ok(())
    }
}
