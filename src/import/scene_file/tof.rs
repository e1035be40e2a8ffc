//! The `[tof]` table of a scene file.

use crate::Result;
use crate::keys::{Keys, Value};
use crate::scene::{Bands, ChargeUnit, SensorNoise, TimeOfFlight};

/// Reads the `[tof]` table. `modulated`: the value of this key for each light of the file.
pub(super) fn from_keys(mut keys: Keys, modulated: &[Option<Value>]) -> Result<TimeOfFlight> {
    keys.only(&[
        "frequencies_mhz",
        "frequencies_hz",
        "phases",
        "contrast",
        "band",
        "phase_offset_deg",
        "output",
        "noise",
    ])?;
    let noise = keys.table("noise")?;
    let (factor, frequencies) = match keys.take_one(&["frequencies_mhz", "frequencies_hz"])? {
        Some(("frequencies_hz", frequencies)) => (1.0, frequencies),
        Some((_, frequencies)) => (1e6, frequencies),
        None => {
            let example = "frequencies_mhz = [20.0, 100.0]";
            (1e6, keys.need("frequencies_mhz", example)?)
        }
    };
    let frequencies = frequencies.filled("give at least one frequency")?.list()?;
    let in_hz = |value: Value| Ok(factor * value.number()?);
    let frequencies_hz = frequencies
        .into_iter()
        .map(in_hz)
        .collect::<Result<Vec<_>>>()?;
    let contrast = keys.need("contrast", "contrast = 0.75, or one for each frequency")?;
    let contrasts = match contrast.number() {
        Ok(contrast) => vec![contrast; frequencies_hz.len()],
        Err(_) => {
            let each = contrast.list()?.into_iter();
            each.map(|value| value.number()).collect::<Result<_>>()?
        }
    };
    let ambient = |light: &Option<Value>| match light {
        Some(light) => light.flag().map(|is_modulated| !is_modulated),
        None => Ok(false),
    };
    let ambient = modulated.iter().map(ambient).collect::<Result<Vec<_>>>()?;
    let lights = ambient.iter().enumerate();
    Ok(TimeOfFlight {
        frequencies_hz,
        phase_count: keys.optional("phases", Value::count)?.unwrap_or(4),
        contrasts,
        band_weights: keys
            .need("band", "band = \"R\", or the weights of three bands")
            .and_then(|band| band_weights(&band))?,
        phase_offset_deg: keys
            .optional("phase_offset_deg", Value::number)?
            .unwrap_or(0.0),
        output: keys
            .optional("output", |word| {
                word.choice(&ChargeUnit::ALL, ChargeUnit::name)
            })?
            .unwrap_or_default(),
        noise: noise.map(self::noise).transpose()?,
        ambient_lights: lights.filter(|(_, is)| **is).map(|(i, _)| i).collect(),
    })
}

fn band_weights(band: &Value) -> Result<Bands> {
    const NAMES: [&str; 3] = ["R", "G", "B"];
    match band.text() {
        Ok(_) => {
            let chosen = band.choice(&NAMES, |name| name)?;
            Ok(NAMES.map(|name| f64::from(u8::from(name == chosen))))
        }
        Err(_) => band.numbers(),
    }
}

fn noise(mut keys: Keys) -> Result<SensorNoise> {
    keys.only(&[
        "seed",
        "dark_e_per_s",
        "read_noise_e",
        "full_well_e",
        "gain_dn_per_e",
        "black_level_dn",
        "bits",
    ])?;
    let mut number = |key, example| keys.need(key, example)?.number();
    Ok(SensorNoise {
        dark_e_per_s: number("dark_e_per_s", "dark_e_per_s = 0.0")?,
        read_noise_e: number("read_noise_e", "read_noise_e = 10.0")?,
        full_well_e: number("full_well_e", "full_well_e = 100000, electrons per tap")?,
        gain_dn_per_e: number("gain_dn_per_e", "gain_dn_per_e = 0.04")?,
        black_level_dn: number("black_level_dn", "black_level_dn = 0")?,
        bits: keys.need("bits", "bits = 12")?.count()?,
        seed: keys.optional("seed", Value::large_count)?.unwrap_or(0),
    })
}
