//! How a sensor turns light on a pixel into a number: shot noise, dark current, read noise, full well, gain, rounding (EMVA 1288, release
//! 4.0).

use std::convert::Infallible;

use rand_core::TryRng;
use rand_distr::{Distribution, Poisson, StandardNormal};

use crate::scene::SensorNoise;

/// One reading of one well. Random numbers depend only on this and the sensor's seed, not on threads or on what else is rendered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    pub frame: FrameKey,
    pub pixel: u32,
    /// Of time of flight, or [`Reading::NO_FREQUENCY`].
    pub frequency: u8,
    pub phase: u8,
    /// Which of the pixel's wells: a tap of time of flight, or the band.
    pub well: u8,
}

impl Reading {
    /// What a sensor without time of flight has in place of a frequency.
    pub const NO_FREQUENCY: u8 = u8::MAX;

    /// What tells the readings of a frame apart, and beside them the fixed patterns of the sensor.
    fn counter(self, is_pattern: bool) -> [u32; 4] {
        let Reading {
            frame,
            pixel,
            frequency,
            phase,
            well,
        } = self;
        match is_pattern {
            false => [
                0,
                u32::from_le_bytes([frequency, phase, well, 0]),
                pixel,
                frame.index,
            ],
            // The same in all readings of the well.
            true => [0, u32::from_le_bytes([0, 0, well, 1]), pixel, 0],
        }
    }
}

/// What tells the noise of one frame from that of another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FrameKey {
    /// Index in a series.
    pub index: u32,
    /// Index of the camera among those that see the same frame.
    pub camera: u32,
    /// The seed of the render.
    pub seed: u32,
}

impl FrameKey {
    /// A number for each camera and seed; 0 if both are 0.
    fn mixed(self) -> u64 {
        // A bijection (the finaliser of MurmurHash3), so that small numbers do not meet the sensor's own small seeds.
        let mut x = u64::from(self.seed) << 32 | u64::from(self.camera);
        x = (x ^ x >> 33).wrapping_mul(0xff51_afd7_ed55_8ccd);
        x = (x ^ x >> 33).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        x ^ x >> 33
    }
}

impl SensorNoise {
    /// The reading of a well in which light frees `expected_e` electrons on average, electrons. Read noise may make it negative.
    pub fn electrons(&self, expected_e: f64, exposure_time_s: f64, reading: Reading) -> f64 {
        let key = self.seed ^ reading.frame.mixed();
        let mut random = Philox::new(key, reading.counter(false));
        let (response, offset_e) = self.fixed_pattern(reading);
        let mean = response * expected_e + self.dark_e_per_s * exposure_time_s;
        // A mean without a distribution frees no electron.
        let freed = Poisson::new(mean).map_or(0.0, |poisson| poisson.sample(&mut random));
        let noise: f64 = StandardNormal.sample(&mut random);
        freed.min(self.full_well_e) + offset_e + self.read_noise_e * noise
    }

    /// What the well of this reading makes of light, as a factor, and the electrons that it adds to each reading.
    fn fixed_pattern(&self, reading: Reading) -> (f64, f64) {
        if !self.has_fixed_pattern() {
            return (1.0, 0.0);
        }
        // Each camera is a sensor of its own, whose pattern no seed of a render changes.
        let camera = FrameKey {
            camera: reading.frame.camera,
            ..FrameKey::default()
        };
        let mut random = Philox::new(self.seed ^ camera.mixed(), reading.counter(true));
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let (of_response, of_dark) = (normal(), normal());
        let response = (1.0 + self.prnu * of_response).max(0.0);
        (response, self.dsnu_e * of_dark)
    }

    /// The number that stands for this many electrons.
    pub fn digital_number(&self, electrons: f64) -> f64 {
        let number = self.black_level_dn + self.gain_dn_per_e * electrons;
        let most = f64::from(self.bits).exp2() - 1.0;
        number.round().clamp(0.0, most)
    }
}

/// Philox4x32-10 (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", 2011): each number is a function of key and counter.
struct Philox {
    key: [u32; 2],
    counter: [u32; 4],
    numbers: [u32; 4],
    used: usize,
}

impl Philox {
    fn new(key: u64, counter: [u32; 4]) -> Philox {
        Philox {
            key: [key as u32, (key >> 32) as u32],
            counter,
            numbers: [0; 4],
            used: 4,
        }
    }

    fn next(&mut self) -> u32 {
        if self.used == 4 {
            self.numbers = philox(self.counter, self.key);
            self.counter[0] = self.counter[0].wrapping_add(1);
            self.used = 0;
        }
        self.used += 1;
        self.numbers[self.used - 1]
    }
}

fn philox(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let [mut c0, mut c1, mut c2, mut c3] = counter;
    let [mut k0, mut k1] = key;
    for _ in 0..10 {
        let a = u64::from(c0) * 0xd251_1f53;
        let b = u64::from(c2) * 0xcd9e_8d57;
        [c0, c1, c2, c3] = [
            (b >> 32) as u32 ^ c1 ^ k0,
            b as u32,
            (a >> 32) as u32 ^ c3 ^ k1,
            a as u32,
        ];
        k0 = k0.wrapping_add(0x9e37_79b9);
        k1 = k1.wrapping_add(0xbb67_ae85);
    }
    [c0, c1, c2, c3]
}

impl TryRng for Philox {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.next())
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(u64::from(self.next()) | u64::from(self.next()) << 32)
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for part in bytes.chunks_mut(4) {
            part.copy_from_slice(&self.next().to_le_bytes()[..part.len()]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::philox;

    /// Known answers of Random123, `kat_vectors`.
    #[test]
    fn philox_gives_its_known_answers() {
        for (counter, key, due) in [
            (
                [0; 4],
                [0; 2],
                [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8],
            ),
            (
                [u32::MAX; 4],
                [u32::MAX; 2],
                [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd],
            ),
            (
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0],
                [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
            ),
        ] {
            assert_eq!(philox(counter, key), due);
        }
    }
}
