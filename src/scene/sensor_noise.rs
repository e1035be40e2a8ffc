//! The noise of a sensor.

use super::{
    ChargeUnit, Limits,
    parameters::{check_limits, parameters},
    validate::Part,
};
use crate::Result;

const UP_TO_1E12: Limits = Limits::between(0.0, 1e12, "give a value from 0 to 1e12");

parameters! {
    /// The noise of a sensor, and its conversion of electrons to digital numbers (DN), after EMVA 1288. Each value of a pixel is a well of its
    /// own: for time of flight, each tap of a phase image.
    pub struct SensorNoise {
        /// The most electrons that a well holds.
        full_well_e: f64 = 0.0, Limits::positive(1e15, "give a value above 0, up to 1e15"); needs "full_well_e = 100000, electrons per well";
        /// Dark current of a well, electrons per second.
        dark_e_per_s: f64 = 0.0, UP_TO_1E12;
        /// σ_r, the standard deviation of the read noise, electrons.
        read_noise_e: f64 = 0.0, UP_TO_1E12;
        /// DN per electron.
        gain_dn_per_e: f64 = 1.0, Limits::positive(1e12, "give a value above 0, up to 1e12");
        /// The DN of 0 electrons.
        black_level_dn: f64 = 0.0, UP_TO_1E12;
        /// DN are from 0 to 2^bits − 1.
        bits: u32 = 12, Limits::between(1.0, 24.0, "give 1 to 24");
        /// Each seed gives different noise.
        seed: u64 = 0;
        /// Dark signal non-uniformity (DSNU), electrons: standard deviation over the pixels of what a pixel adds to every reading. It depends on
        /// the seed, and stays from frame to frame.
        dsnu_e: f64 = 0.0, UP_TO_1E12;
        /// Photo response non-uniformity (PRNU): standard deviation over the pixels of the factor of their quantum efficiency. It stays like
        /// `dsnu_e`.
        prnu: f64 = 0.0, Limits::between(0.0, 1.0, "give a share from 0 to 1, such as 0.01");
    }
}

impl SensorNoise {
    /// Whether some pixels always read more than others.
    pub fn has_fixed_pattern(&self) -> bool {
        self.dsnu_e > 0.0 || self.prnu > 0.0
    }

    /// The reading from which a tap counts as full, or nearly full: read noise may have lowered it.
    pub(crate) fn full_tap(&self, output: ChargeUnit) -> f64 {
        let full_e = self.full_well_e - f64::min(3.0 * self.read_noise_e, 0.5 * self.full_well_e);
        match output {
            ChargeUnit::Electrons => full_e,
            ChargeUnit::DigitalNumbers => {
                let most = f64::from((1_u32 << self.bits) - 1);
                // A number stands for values from half a unit below it.
                (self.black_level_dn + self.gain_dn_per_e * full_e - 0.5).min(most)
            }
        }
    }

    /// `at`: what the noise is of, for messages.
    pub(super) fn validate(&self, at: &str) -> Result<()> {
        let part = Part(at.into());
        check_limits(&part, self)?;
        let most = f64::from((1_u32 << self.bits) - 1);
        part.require(
            self.black_level_dn <= most,
            format_args!(
                "black_level_dn is {}, but {} bits hold at most {most}",
                self.black_level_dn, self.bits
            ),
            "give more bits, or a lower black level",
        )
    }
}
