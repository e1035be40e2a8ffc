//! The `[tof]` table of a scene file.

use crate::Result;
use crate::keys::{Keys, Value};
use crate::scene::{Bands, ChargeUnit, TimeOfFlight};

use super::sensor_noise;

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
    let of_all = |contrast| vec![contrast; frequencies_hz.len()];
    let contrasts = match keys.take("contrast") {
        None => of_all(TimeOfFlight::DEFAULT_CONTRAST),
        Some(contrast) => match contrast.number() {
            Ok(contrast) => of_all(contrast),
            Err(_) => {
                let each = contrast.list()?.into_iter();
                each.map(|value| value.number()).collect::<Result<_>>()?
            }
        },
    };
    let ambient = |light: &Option<Value>| match light {
        Some(light) => light.flag().map(|is_modulated| !is_modulated),
        None => Ok(false),
    };
    let ambient = modulated.iter().map(ambient).collect::<Result<Vec<_>>>()?;
    let lights = ambient.iter().enumerate();
    Ok(TimeOfFlight {
        frequencies_hz,
        phase_count: keys
            .optional("phases", Value::count)?
            .unwrap_or(TimeOfFlight::DEFAULT_PHASE_COUNT),
        contrasts,
        band_weights: keys
            .optional("band", band_weights)?
            .unwrap_or(TimeOfFlight::DEFAULT_BAND_WEIGHTS),
        phase_offset_deg: keys
            .optional("phase_offset_deg", Value::number)?
            .unwrap_or(0.0),
        output: keys
            .optional("output", |word| {
                word.choice(&ChargeUnit::ALL, ChargeUnit::name)
            })?
            .unwrap_or_default(),
        noise: noise.map(sensor_noise).transpose()?,
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
