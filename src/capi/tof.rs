//! Time of flight: the camera's settings.

use super::*;
use crate::scene::{ChargeUnit, MAX_FREQUENCIES, SensorNoise, TimeOfFlight};

/// Difference between the numbers of a layer at one frequency and at the next. CAMLUX_LAYER_TOF_PHASOR and so on are of frequency 0, and
/// CAMLUX_LAYER_TOF_TAPS is of phase image 0: add 1 for each phase image after it. CAMLUX_LAYER_INDIRECT_BOUNCE and CAMLUX_LAYER_TOF_PHASOR_BOUNCE
/// are of one bounce: add 1 for each bounce more.
pub const CAMLUX_TOF_NEXT_FREQUENCY: i32 = 16;

/// Charges are electrons.
pub const CAMLUX_CHARGE_ELECTRONS: i32 = 0;
/// Charges are digital numbers, DN, computed with the gain of camlux_tof_noise.
pub const CAMLUX_CHARGE_DN: i32 = 1;

/// A time-of-flight camera (AMCW): its pixels correlate light with the modulation of the source. Initialise with CAMLUX_TOF_INIT: four
/// phase images, band R, contrast 1, electrons, no frequency yet.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_tof {
    /// Set by CAMLUX_TOF_INIT.
    pub struct_size: u32,
    /// Number of frequencies, 1 to 4.
    pub frequency_count: u32,
    /// Modulation frequencies, Hz (20 MHz are 20e6), 1e3 to 1e12; only the first frequency_count are used.
    pub frequencies_hz: [f64; 4],
    /// Contrast K of each frequency: the difference between the taps as a fraction of the light, 0 to 1.
    pub contrasts: [f64; 4],
    /// Weight of each band R, G, B in what the pixels receive.
    pub band_weights: [f64; 3],
    /// Offset added to every measured phase, degrees.
    pub phase_offset_deg: f64,
    /// Number of phase images N, 3 to 8: phase image i is taken at the phase 2 pi i / N.
    pub phase_count: u32,
    /// Unit of charges: CAMLUX_CHARGE_ELECTRONS, or CAMLUX_CHARGE_DN, which needs noise.
    pub output: i32,
    /// Noise; NULL: charges are expected values.
    pub noise: *const camlux_tof_noise,
    /// Indices of the lights that are not modulated. Directional lights must be among them, because their paths have no length.
    pub ambient_lights: *const u32,
    /// Number of these lights; 0: all lights are modulated.
    pub ambient_light_count: usize,
}

c_struct!(
    camlux_tof, 136,
    contrasts: [TimeOfFlight::DEFAULT_CONTRAST; 4],
    band_weights: TimeOfFlight::DEFAULT_BAND_WEIGHTS,
    phase_count: TimeOfFlight::DEFAULT_PHASE_COUNT,
);

const _: () = assert!(MAX_FREQUENCIES == 4, "camlux_tof has room for as many");

/// Sets a time-of-flight camera. Frames then have the layers CAMLUX_LAYER_HALF_PATH and CAMLUX_LAYER_TOF_PHASOR to
/// CAMLUX_LAYER_TOF_TAPS of each frequency. It needs camlux_scene_set_sensor with wavelength_nm and quantum_efficiency.
///
/// \param tof NULL: none, the default. The noise and the indices that it points to are copied.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values out of range. Settings that do not go
/// together with the rest of the scene, such as a modulated directional light, are CAMLUX_ERROR_SCENE at the next render or
/// camlux_scene_validate.
/// The index of a removed light counts for no light that takes it later.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_tof(
    scene: *mut camlux_scene,
    tof: *const camlux_tof,
) -> camlux_status {
    ffi_guard("camlux_scene_set_tof", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        let tof = unsafe { args::read_optional(tof) }?;
        // SAFETY: the caller guarantees it.
        let tof = tof.map(|tof| unsafe { tof_from_c(tof) }).transpose()?;
        object.lock_to_change().scene.tof = tof;
        Ok(())
    })
}

/// Reads the time-of-flight camera, in the form of camlux_scene_set_tof.
///
/// \param tof initialise with CAMLUX_TOF_INIT. Its noise is NULL, or points to `noise`; its ambient_lights is NULL, or points to
/// `ambient_lights`. Unchanged if there is none.
/// \param noise initialise with CAMLUX_TOF_NOISE_INIT. Unchanged if there is none.
/// \param ambient_lights receives the indices of the lights that are not modulated; NULL: they are only counted, by ambient_light_count.
/// \param capacity largest number of these indices: `lights` of camlux_scene_counts is enough.
/// \param is_set receives 1, or 0 if there is no time of flight.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT, also if there are more ambient lights than the capacity.
/// \threads any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_get_tof(
    scene: *mut camlux_scene,
    tof: *mut camlux_tof,
    noise: *mut camlux_tof_noise,
    ambient_lights: *mut u32,
    capacity: usize,
    is_set: *mut i32,
) -> camlux_status {
    ffi_guard("camlux_scene_get_tof", || {
        let found = handle::get(scene)?.lock().scene.tof.clone();
        // SAFETY: the caller guarantees it.
        unsafe {
            args::check_struct(tof)?;
            args::check_struct(noise)?;
            args::check_pointer(is_set, "is_set")?;
            let Some(found) = found else {
                return args::write_optional(tof, is_set, None);
            };
            let mut made = tof_to_c(&found);
            if !ambient_lights.is_null() && made.ambient_light_count > 0 {
                args::check_pointer(ambient_lights, "ambient_lights")?;
                let count = made.ambient_light_count;
                if count > capacity {
                    let problem = format!("capacity is {capacity}, but {count} lights are ambient");
                    return Err(Failure::argument(format!("{problem}; give more memory")));
                }
                for (place, &light) in found.ambient_lights.iter().enumerate() {
                    ambient_lights.add(place).write(light as u32);
                }
                made.ambient_lights = ambient_lights;
            }
            if let Some(of_tof) = &found.noise {
                args::write(noise, || Ok(noise_to_c(of_tof)))?;
                made.noise = noise;
            }
            args::write_optional(tof, is_set, Some(made))
        }
    })
}

fn tof_to_c(tof: &TimeOfFlight) -> camlux_tof {
    let mut made = camlux_tof {
        frequency_count: tof.frequencies_hz.len() as u32,
        band_weights: tof.band_weights,
        phase_offset_deg: tof.phase_offset_deg,
        phase_count: tof.phase_count,
        output: match tof.output {
            ChargeUnit::Electrons => CAMLUX_CHARGE_ELECTRONS,
            ChargeUnit::DigitalNumbers => CAMLUX_CHARGE_DN,
        },
        ambient_light_count: tof.ambient_lights.len(),
        ..Default::default()
    };
    let numbers = tof.frequencies_hz.iter().zip(&tof.contrasts);
    for (i, (hz, contrast)) in numbers.enumerate().take(MAX_FREQUENCIES) {
        (made.frequencies_hz[i], made.contrasts[i]) = (*hz, *contrast);
    }
    made
}

pub(super) fn noise_to_c(noise: &SensorNoise) -> camlux_tof_noise {
    camlux_tof_noise {
        bits: noise.bits,
        seed: noise.seed,
        dark_e_per_s: noise.dark_e_per_s,
        read_noise_e: noise.read_noise_e,
        full_well_e: noise.full_well_e,
        gain_dn_per_e: noise.gain_dn_per_e,
        black_level_dn: noise.black_level_dn,
        dsnu_e: noise.dsnu_e,
        prnu: noise.prnu,
        ..Default::default()
    }
}

/// # Safety
/// Its pointers are null, or misaligned, or point to what their members state.
unsafe fn tof_from_c(tof: camlux_tof) -> Outcome<TimeOfFlight> {
    let count = tof.frequency_count as usize;
    if count > MAX_FREQUENCIES {
        let problem = format!("frequency_count is {count}; give 1 to {MAX_FREQUENCIES}");
        return Err(Failure::argument(problem));
    }
    let outputs = args::choices![
        CAMLUX_CHARGE_ELECTRONS => ChargeUnit::Electrons,
        CAMLUX_CHARGE_DN => ChargeUnit::DigitalNumbers,
    ];
    let ambient_lights = args::Rows {
        name: "camlux_tof.ambient_lights",
        count_name: "ambient_light_count",
        data: tof.ambient_lights.cast(),
        stride_bytes: 0,
        count: tof.ambient_light_count,
        length: 1,
    };
    // SAFETY: the caller guarantees it.
    let (noise, ambient_lights) = unsafe {
        let index = |light: &[u32]| light[0] as usize;
        (args::read_optional(tof.noise)?, ambient_lights.read(index)?)
    };
    let tof = TimeOfFlight {
        frequencies_hz: tof.frequencies_hz[..count].to_vec(),
        phase_count: tof.phase_count,
        contrasts: tof.contrasts[..count].to_vec(),
        band_weights: tof.band_weights,
        phase_offset_deg: tof.phase_offset_deg,
        ambient_lights,
        output: args::one_of("output", tof.output, &outputs)?,
        noise: noise.map(noise_from_c),
    };
    tof.validate()?;
    Ok(tof)
}

pub(super) fn noise_from_c(noise: camlux_tof_noise) -> SensorNoise {
    SensorNoise {
        seed: noise.seed,
        dark_e_per_s: noise.dark_e_per_s,
        read_noise_e: noise.read_noise_e,
        full_well_e: noise.full_well_e,
        gain_dn_per_e: noise.gain_dn_per_e,
        black_level_dn: noise.black_level_dn,
        bits: noise.bits,
        dsnu_e: noise.dsnu_e,
        prnu: noise.prnu,
    }
}
