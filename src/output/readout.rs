//! Computes what a sensor without time of flight counts: electrons, and the digital numbers that it gives for them.

use super::{Frame, FrameDescription, Layer, LayerData, WantedLayers, per_pixel};
use crate::{
    model::{FrameKey, Reading, electrons},
    scene::Sensor,
};

/// A sensor with everything that its readings depend on, beside the energy.
pub(crate) struct SensorReadout {
    sensor: Sensor,
    /// Whether a pixel has one value for all bands.
    is_raw: bool,
    frame: FrameKey,
    width_px: usize,
    /// Electrons of a joule in each band.
    per_joule: [f64; 3],
}

impl SensorReadout {
    pub const LAYERS: [Layer; 4] = [
        Layer::Electrons,
        Layer::DigitalNumber,
        Layer::RawElectrons,
        Layer::RawDigitalNumber,
    ];

    /// That of a frame, if its sensor counts electrons.
    pub fn of(description: &FrameDescription) -> Option<SensorReadout> {
        let sensor = description.sensor?;
        let counted = sensor.counted_electrons()?;
        let detector = sensor.photodetector()?;
        let wavelength_m = 1e-9 * detector.wavelength_nm;
        let per_joule = electrons(1.0, wavelength_m, detector.quantum_efficiency);
        Some(SensorReadout {
            sensor,
            is_raw: counted.is_raw,
            frame: description.key,
            width_px: description.camera.resolution_px[0] as usize,
            per_joule: sensor.band_weights.map(|weight| weight * per_joule),
        })
    }

    /// The wanted layers that the sensor has. `energies`: those of each pixel, joules per band.
    pub fn layers(&self, energies: &[f32], wanted: &mut WantedLayers) -> Vec<(Layer, LayerData)> {
        let (energies, _) = energies.as_chunks::<3>();
        if self.is_raw {
            let layers = [Layer::RawElectrons, Layer::RawDigitalNumber];
            let read = |i: usize| [self.read(self.raw_expected_e(energies[i], i), i, 0)];
            self.layers_by(layers, energies.len(), read, wanted)
        } else {
            let layers = [Layer::Electrons, Layer::DigitalNumber];
            let read = |i: usize| {
                let expected_e = |band: usize| self.per_joule[band] * f64::from(energies[i][band]);
                [0, 1, 2].map(|band| self.read(expected_e(band), i, band))
            };
            self.layers_by(layers, energies.len(), read, wanted)
        }
    }

    /// The layers of electrons and of digital numbers, as far as they are wanted. `read`: the electrons of a pixel.
    fn layers_by<const N: usize>(
        &self,
        [of_electrons, of_numbers]: [Layer; 2],
        count: usize,
        read: impl Fn(usize) -> [f64; N] + Sync,
        wanted: &mut WantedLayers,
    ) -> Vec<(Layer, LayerData)> {
        let noise = self.sensor.noise.filter(|_| (wanted.is_wanted)(of_numbers));
        let has_electrons = (wanted.is_wanted)(of_electrons);
        let mut layers = Vec::new();
        if !has_electrons && noise.is_none() {
            return layers;
        }
        // Both layers are of one reading.
        let mut electrons = vec![0.0; N * count];
        per_pixel(&mut electrons, read);
        if has_electrons {
            let mut values = (wanted.floats)(N * count);
            per_pixel(&mut values, |i| [electrons[i] as f32]);
            layers.push((of_electrons, LayerData::Float(values)));
        }
        if let Some(noise) = noise {
            let mut values = (wanted.floats)(N * count);
            per_pixel(&mut values, |i| [noise.digital_number(electrons[i]) as f32]);
            layers.push((of_numbers, LayerData::Float(values)));
        }
        layers
    }

    /// Electrons that light frees on average in a pixel with one value.
    fn raw_expected_e(&self, energies: [f32; 3], pixel: usize) -> f64 {
        let of_band = |band: usize| self.per_joule[band] * f64::from(energies[band]);
        match self.sensor.bayer {
            Some(pattern) => of_band(pattern.band([pixel % self.width_px, pixel / self.width_px])),
            None => (0..3).map(of_band).sum(),
        }
    }

    /// The electrons that a well of a pixel is read to hold.
    fn read(&self, expected_e: f64, pixel: usize, well: usize) -> f64 {
        let Some(noise) = &self.sensor.noise else {
            return expected_e;
        };
        let reading = Reading {
            frame: self.frame,
            pixel: pixel as u32,
            frequency: Reading::NO_FREQUENCY,
            phase: 0,
            well: well as u8,
        };
        noise.electrons(expected_e, self.sensor.exposure_time_s, reading)
    }
}

impl Frame {
    /// Counts the electrons of each pixel again, by the layer `energy` as it is now. Other layers stay.
    pub fn count_electrons(&mut self) {
        let (Some(readout), Some(energies)) = (
            SensorReadout::of(&self.description),
            self.values(Layer::Energy),
        ) else {
            return;
        };
        let mut wanted = WantedLayers {
            is_wanted: &|layer| self.layers.iter().any(|(own, _)| *own == layer),
            floats: &mut |values| vec![0.0; values],
        };
        for (layer, data) in readout.layers(energies, &mut wanted) {
            let mut own = self.layers.iter_mut();
            if let Some((_, kept)) = own.find(|(own, _)| *own == layer) {
                *kept = data;
            }
        }
    }
}
