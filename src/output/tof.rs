//! Computes a time-of-flight camera's layers from the phasors of its pixels. Uses f64, because f32 resolves a phase only to 1e-7 turns.

use glam::{DVec2, DVec3};

use super::{
    Frame, FrameDescription, Layer, LayerData, TofQuantity, per_pixel, pixels_of_a_thread,
};
use crate::{
    Error, Result,
    model::{
        FrameKey, PhaseSampling, Phasor, Reading, electrons, multipath_error_m, range_m, wrap_count,
    },
    parallel::for_each_at_once,
    scene::{Camera, ChargeUnit, MAX_PHASES, Photodetector, Sensor, TimeOfFlight, VignettingMap},
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
    pub vignetting_map: Option<&'t VignettingMap>,
    pub photodetector: Photodetector,
    pub frame: FrameKey,
}

/// Light of a phase image, by its index and the pixel's index: L of all light, and Z with the camera's phase offset, W/sr/m²; or E and its
/// phasor, W/m².
type PhaseLight<'l> = dyn Fn(usize, usize) -> (f64, Phasor) + Sync + 'l;

/// Pixels whose values are computed together, so that they stay in a core's cache.
const BLOCK: usize = 128;

/// What the phase images of a pixel hold, and what is computed from them.
#[derive(Clone, Copy, Default)]
struct Measured {
    taps: [[f32; 2]; MAX_PHASES],
    /// K·Q_Z.
    phasor: Phasor,
    intensity: f64,
}

/// Which layers of a frequency are made, and where their memory comes from.
pub(crate) struct WantedLayers<'w> {
    pub is_wanted: &'w dyn Fn(Layer) -> bool,
    /// This many values, with arbitrary contents.
    pub floats: &'w mut dyn FnMut(usize) -> Vec<f32>,
}

impl TofCamera<'_> {
    /// That of a frame, if there is one.
    pub fn of(description: &FrameDescription) -> Option<TofCamera<'_>> {
        let sensor = description.sensor?;
        Some(TofCamera {
            tof: description.tof.as_ref()?,
            camera: description.camera,
            sensor,
            vignetting_map: description.vignetting_map.as_deref(),
            photodetector: sensor.photodetector()?,
            frame: description.key,
        })
    }

    /// The wanted layers of one frequency, except the standard error. `phasors`, `radiances` (L of all light at the pixel, W/sr/m²) and
    /// `half_paths_m` have one value per pixel; `lens_factors` are those of [`TofCamera::lens_factors`].
    pub fn layers(
        &self,
        frequency: usize,
        phasors: &[PixelPhasors],
        radiances: &[f64],
        half_paths_m: &[f64],
        lens_factors: &[f64],
        wanted: &mut WantedLayers,
    ) -> Vec<(Layer, LayerData)> {
        let frequency_hz = self.tof.frequencies_hz[frequency];
        let offset = self.phase_offset();
        let light = |_, i: usize| {
            let PixelPhasors { direct, indirect } = phasors[i];
            (radiances[i], (direct + indirect) * offset)
        };
        let of_paths = [
            TofQuantity::Phasor,
            TofQuantity::PhasorDirect,
            TofQuantity::PhasorIndirect,
            TofQuantity::MultipathError,
        ];
        let all = of_paths.into_iter().chain(self.measured_quantities());
        let measuring = Measuring::new(self, frequency, &light, lens_factors);
        let mut layers = measuring.fill(all, phasors, half_paths_m.len(), wanted);
        let wraps = Layer::Tof(frequency as u8, TofQuantity::Wraps);
        if (wanted.is_wanted)(wraps) {
            let mut counts = vec![0; half_paths_m.len()];
            per_pixel(&mut counts, |i| match half_paths_m[i] {
                half_m if half_m.is_finite() => [wrap_count(half_m, frequency_hz)],
                _ => [0],
            });
            let is_of_path = |(layer, _): &&(Layer, LayerData)| {
                of_paths
                    .iter()
                    .any(|&q| *layer == Layer::Tof(frequency as u8, q))
            };
            let after_paths = layers.iter().take_while(is_of_path).count();
            layers.insert(after_paths, (wraps, LayerData::Id(counts)));
        }
        layers
    }

    fn phase_offset(&self) -> Phasor {
        Phasor::of_angle(self.tof.phase_offset_deg.to_radians())
    }

    /// The phase images of a frequency and what is computed from them.
    fn measured_quantities(&self) -> impl Iterator<Item = TofQuantity> + use<> {
        let taps = (0..self.tof.phase_count as u8).map(TofQuantity::Taps);
        [
            TofQuantity::Range,
            TofQuantity::Point,
            TofQuantity::Amplitude,
            TofQuantity::Intensity,
        ]
        .into_iter()
        .chain(taps)
    }

    /// The lens's factor for each pixel, from radiance to irradiance; empty if the factor is 1.
    pub fn lens_factors(&self, count: usize) -> Vec<f64> {
        if self.sensor.f_number.is_none() {
            return Vec::new();
        }
        let mut factors = vec![0.0; count];
        per_pixel(&mut factors, |i| {
            let share = match (self.sensor.vignetting, self.vignetting_map) {
                (None, None) => self.ray(i).z.powi(4),
                (_, Some(map)) => {
                    let resolution_px = self.camera.resolution_px;
                    let (pixel, width) = (i as u32, resolution_px[0]);
                    map.at([pixel % width, pixel / width], resolution_px)
                }
                (Some(vignetting), None) => {
                    let square = self.camera.squared_radius(self.centre_px(i));
                    vignetting.at(square)
                }
            };
            [self.sensor.irradiance_per_radiance(share)]
        });
        factors
    }

    fn centre_px(&self, pixel: usize) -> DVec2 {
        let width = self.camera.resolution_px[0] as usize;
        DVec2::from([pixel % width, pixel / width].map(|place| place as f64 + 0.5))
    }

    /// The ray of a pixel, of unit length, in the camera's axes.
    fn ray(&self, pixel: usize) -> DVec3 {
        let DVec2 { x, y } = self.centre_px(pixel);
        let direction = self.camera.unproject(x, y).unwrap_or_default();
        direction / direction.length()
    }

    /// What is this far along the ray of a pixel, in the camera's axes.
    fn point_m(&self, pixel: usize, range_m: f64) -> DVec3 {
        let along_m = range_m * self.ray(pixel);
        if !self.camera.is_orthographic() {
            return along_m;
        }
        let DVec2 { x, y } = self.centre_px(pixel);
        self.camera.ray_start_m(x, y) + along_m
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
}

/// The measurement of one frequency.
struct Measuring<'m> {
    camera: &'m TofCamera<'m>,
    frequency: usize,
    frequency_hz: f64,
    sampling: PhaseSampling,
    light: &'m PhaseLight<'m>,
    lens_factors: &'m [f64],
    /// Electrons of each W/sr/m², or W/m².
    per_radiance: f64,
    /// What a tap reads without light.
    black_level: f64,
}

impl<'m> Measuring<'m> {
    fn new(
        camera: &'m TofCamera,
        frequency: usize,
        light: &'m PhaseLight,
        lens_factors: &'m [f64],
    ) -> Measuring<'m> {
        Measuring {
            camera,
            frequency,
            frequency_hz: camera.tof.frequencies_hz[frequency],
            sampling: PhaseSampling::of(camera.tof, frequency),
            light,
            lens_factors,
            per_radiance: electrons(
                camera.sensor.joule_per_irradiance(),
                1e-9 * camera.photodetector.wavelength_nm,
                camera.photodetector.quantum_efficiency,
            ),
            black_level: match (camera.tof.output, &camera.tof.noise) {
                (ChargeUnit::DigitalNumbers, Some(noise)) => noise.black_level_dn,
                _ => 0.0,
            },
        }
    }

    /// Fills the wanted layers of so many pixels, on all threads. Nothing is measured that no layer needs.
    fn fill(
        &self,
        quantities: impl Iterator<Item = TofQuantity>,
        phasors: &[PixelPhasors],
        count: usize,
        wanted: &mut WantedLayers,
    ) -> Vec<(Layer, LayerData)> {
        let layer = |quantity| Layer::Tof(self.frequency as u8, quantity);
        let quantities: Vec<TofQuantity> = quantities
            .filter(|&quantity| (wanted.is_wanted)(layer(quantity)))
            .collect();
        let channels = |quantity| layer(quantity).channel_names().len();
        let room = |&quantity: &TofQuantity| (wanted.floats)(channels(quantity) * count);
        let mut values: Vec<Vec<f32>> = quantities.iter().map(room).collect();
        let is_measured = quantities.iter().any(|quantity| {
            let mut measured = self.camera.measured_quantities();
            measured.any(|measured| measured == *quantity)
        });
        let share = pixels_of_a_thread(count);
        let mut parts: Vec<Vec<&mut [f32]>> = Vec::new();
        parts.resize_with(count.div_ceil(share), Vec::new);
        for (values, &quantity) in values.iter_mut().zip(&quantities) {
            let of_parts = values.chunks_mut(channels(quantity) * share);
            for (part, values) in parts.iter_mut().zip(of_parts) {
                part.push(values);
            }
        }
        for_each_at_once(parts.into_iter().enumerate(), |(part, mut layers)| {
            let end = count.min((part + 1) * share);
            let mut measured = [Measured::default(); BLOCK];
            for first in (part * share..end).step_by(BLOCK) {
                let pixels = first..end.min(first + BLOCK);
                if is_measured {
                    for (measured, i) in measured.iter_mut().zip(pixels.clone()) {
                        *measured = self.pixel(i);
                    }
                }
                for (values, &quantity) in layers.iter_mut().zip(&quantities) {
                    let rest = std::mem::take(values);
                    let (block, rest) = rest.split_at_mut(channels(quantity) * pixels.len());
                    *values = rest;
                    let phasors = phasors.get(pixels.clone()).unwrap_or_default();
                    self.write(block, quantity, pixels.start, phasors, &measured);
                }
            }
        });
        let named = |(quantity, values)| (layer(quantity), LayerData::Float(values));
        quantities.into_iter().zip(values).map(named).collect()
    }

    fn pixel(&self, i: usize) -> Measured {
        let camera = self.camera;
        let factor = self.lens_factors.get(i).copied().unwrap_or(1.0);
        let mut measured = Measured::default();
        let mut differences = [0.0; MAX_PHASES];
        let phases = camera.tof.phase_count as usize;
        for (phase, difference) in differences.iter_mut().take(phases).enumerate() {
            let (radiance, phasor) = (self.light)(phase, i);
            let (radiance, phasor) = (radiance * factor, phasor * factor);
            let expected = self.sampling.taps(
                self.per_radiance * radiance,
                phasor * self.per_radiance,
                phase,
            );
            let taps = [0, 1].map(|tap| {
                let reading = Reading {
                    frame: camera.frame,
                    pixel: i as u32,
                    frequency: self.frequency as u8,
                    phase: phase as u8,
                    well: tap as u8,
                };
                camera.read(expected[tap], reading) as f32
            });
            measured.taps[phase] = taps;
            // Without noise, from the expected values before they are rounded.
            let [a, b] = match camera.tof.noise {
                None => expected,
                Some(_) => taps.map(f64::from),
            };
            *difference = a - b;
            for charge in taps {
                measured.intensity += f64::from(charge) - self.black_level;
            }
        }
        let differences = differences.into_iter().take(phases);
        measured.phasor = self.sampling.demodulate(differences);
        measured
    }

    /// Writes the values of a layer for consecutive pixels, from the first on.
    fn write(
        &self,
        values: &mut [f32],
        quantity: TofQuantity,
        first: usize,
        phasors: &[PixelPhasors],
        measured: &[Measured],
    ) {
        let hz = self.frequency_hz;
        let total = |pixel: &PixelPhasors| pixel.direct + pixel.indirect;
        match quantity {
            TofQuantity::Phasor => put(values, phasors, |pixel| complex(total(pixel))),
            TofQuantity::PhasorDirect => put(values, phasors, |pixel| complex(pixel.direct)),
            TofQuantity::PhasorIndirect => put(values, phasors, |pixel| complex(pixel.indirect)),
            TofQuantity::MultipathError => put(values, phasors, |pixel| {
                or_nan(multipath_error_m(total(pixel), pixel.direct, hz))
            }),
            TofQuantity::Range => put(values, measured, |of| or_nan(range_m(of.phasor, hz))),
            TofQuantity::Point => {
                let (points, _) = values.as_chunks_mut::<3>();
                for (i, (point, of)) in points.iter_mut().zip(measured).enumerate() {
                    let range_m = range_m(of.phasor, hz).unwrap_or(f64::NAN);
                    let point_m = self.camera.point_m(first + i, range_m);
                    *point = point_m.as_vec3().to_array();
                }
            }
            TofQuantity::Amplitude => put(values, measured, |of| [of.phasor.magnitude() as f32]),
            TofQuantity::Intensity => put(values, measured, |of| [of.intensity as f32]),
            TofQuantity::Taps(phase) => put(values, measured, |of| of.taps[usize::from(phase)]),
            // They are no floats, or not of this camera, or of another gather.
            TofQuantity::Wraps
            | TofQuantity::PhasorStandardError
            | TofQuantity::PhasorBounce(_) => (),
        }
    }
}

fn put<T, const N: usize>(values: &mut [f32], pixels: &[T], value: impl Fn(&T) -> [f32; N]) {
    let (values, _) = values.as_chunks_mut::<N>();
    for (values, pixel) in values.iter_mut().zip(pixels) {
        *values = value(pixel);
    }
}

fn complex(Phasor { re, im }: Phasor) -> [f32; 2] {
    [re as f32, im as f32]
}

fn or_nan(value: Option<f64>) -> [f32; 1] {
    [value.unwrap_or(f64::NAN) as f32]
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
        let camera = TofCamera::of(&self.description);
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
        let lens_factors = camera.lens_factors(count);
        let measuring = Measuring::new(&camera, frequency, &light, &lens_factors);
        let mut wanted = WantedLayers {
            is_wanted: &|layer| self.layers.iter().any(|(own, _)| *own == layer),
            floats: &mut |values| vec![0.0; values],
        };
        let made = measuring.fill(camera.measured_quantities(), &[], count, &mut wanted);
        for (layer, data) in made {
            let mut own = self.layers.iter_mut();
            if let Some((_, kept)) = own.find(|(own, _)| *own == layer) {
                *kept = data;
            }
        }
        Ok(())
    }
}
