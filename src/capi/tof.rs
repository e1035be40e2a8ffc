//! Time of flight: what a host says of such a camera, and the numbers of its layers.

use super::*;
use crate::{
    output::{Layer, TofQuantity},
    scene::{ChargeUnit, MAX_FREQUENCIES, SensorNoise, TimeOfFlight},
};

/// Half the length of the shortest path from a modulated light by way of the surface to the camera, m; +infinity without a surface.
pub const CAMLUX_LAYER_HALF_PATH: i32 = 11;

/// Z, of all light that is modulated, W/sr/m^2, channels re, im. This and the layers below are those of frequency 0; add
/// CAMLUX_TOF_NEXT_FREQUENCY for each frequency after it. All of them with camlux_scene_set_tof.
pub const CAMLUX_LAYER_TOF_PHASOR: i32 = 64;
/// Z of the direct light, W/sr/m^2, channels re, im.
pub const CAMLUX_LAYER_TOF_PHASOR_DIRECT: i32 = 65;
/// Z of the indirect light, W/sr/m^2, channels re, im; with camlux_scene_set_indirect.
pub const CAMLUX_LAYER_TOF_PHASOR_INDIRECT: i32 = 66;
/// Half the length of the paths as the phase images tell it, from 0 to c/(2f), m; NaN without modulated light.
pub const CAMLUX_LAYER_TOF_RANGE: i32 = 67;
/// What the taps differ by at most, over all phases: K|Q_Z|, electrons or DN.
pub const CAMLUX_LAYER_TOF_AMPLITUDE: i32 = 68;
/// The sum of both taps over all phase images, electrons or DN above the black level.
pub const CAMLUX_LAYER_TOF_INTENSITY: i32 = 69;
/// How much farther the pixel seems to be than by its direct light alone, m; NaN where that is 0; with camlux_scene_set_indirect.
pub const CAMLUX_LAYER_TOF_MPI: i32 = 70;
/// How often the phase of the shortest path has wrapped (CAMLUX_FORMAT_U32).
pub const CAMLUX_LAYER_TOF_WRAPS: i32 = 71;
/// Both taps of phase image 0, electrons or DN, channels A, B. Add 1 for each phase image after it.
pub const CAMLUX_LAYER_TOF_TAPS: i32 = 72;
/// From a layer of one frequency to that of the next.
pub const CAMLUX_TOF_NEXT_FREQUENCY: i32 = 16;

/// Charges are electrons.
pub const CAMLUX_CHARGE_ELECTRONS: i32 = 0;
/// Charges are digital numbers, DN, by the gain of camlux_tof_noise.
pub const CAMLUX_CHARGE_DN: i32 = 1;

/// The noise of a sensor after EMVA 1288, and how it turns electrons into numbers. Each tap is a well of its own. Begin with
/// CAMLUX_TOF_NOISE_INIT, and set at least full_well_e: 12 bits, 1 DN an electron, shot noise alone.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_tof_noise {
    /// sizeof(camlux_tof_noise)
    pub struct_size: u32,
    /// DN are from 0 to 2^bits - 1; 1 to 24.
    pub bits: u32,
    /// Another seed: other noise. So does another frame_index of camlux_render_options.
    pub seed: u64,
    /// Dark current of a tap, electrons per second.
    pub dark_e_per_s: f64,
    /// Standard deviation of what reading adds, electrons.
    pub read_noise_e: f64,
    /// Electrons that a tap holds at most.
    pub full_well_e: f64,
    /// DN of an electron.
    pub gain_dn_per_e: f64,
    /// DN that stand for no electrons.
    pub black_level_dn: f64,
}

/// A time-of-flight camera, whose pixels correlate light with the modulation of its source (AMCW). Begin with CAMLUX_TOF_INIT: four
/// phase images, band R, contrast 1, electrons, no frequency yet.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_tof {
    /// sizeof(camlux_tof)
    pub struct_size: u32,
    /// 1 to 4.
    pub frequency_count: u32,
    /// Modulation frequencies, Hz, 1 to 1e12; the first frequency_count are looked at.
    pub frequencies_hz: [f64; 4],
    /// K of each frequency: what the taps differ by, as a share of the light, 0 to 1.
    pub contrasts: [f64; 4],
    /// How much of each band R, G, B the pixels see.
    pub band_weights: [f64; 3],
    /// Is added to every phase that is measured, degrees.
    pub phase_offset_deg: f64,
    /// N, 3 to 8: phase image i is taken at the phase 2 pi i / N.
    pub phase_count: u32,
    /// CAMLUX_CHARGE_ELECTRONS, or CAMLUX_CHARGE_DN, which needs noise.
    pub output: i32,
    /// NULL: charges are expected values.
    pub noise: *const camlux_tof_noise,
    /// Indices of the lights that are not modulated; directional lights must be among them, for their paths have no length.
    pub ambient_lights: *const u32,
    /// How many there are; 0: all lights are modulated.
    pub ambient_light_count: usize,
}

c_struct!(
    camlux_tof_noise, 56,
    bits: 12,
    gain_dn_per_e: 1.0,
);

c_struct!(
    camlux_tof, 136,
    contrasts: [1.0; 4],
    band_weights: [1.0, 0.0, 0.0],
    phase_count: 4,
);

const _: () = assert!(MAX_FREQUENCIES == 4, "camlux_tof has room for as many");

/// The number of a layer of time of flight; `None` for others, and for what no render has.
pub(super) fn tof_number(layer: Layer) -> Option<i32> {
    let Layer::Tof(frequency, quantity) = layer else {
        return None;
    };
    let first = match quantity {
        TofQuantity::Phasor => CAMLUX_LAYER_TOF_PHASOR,
        TofQuantity::PhasorDirect => CAMLUX_LAYER_TOF_PHASOR_DIRECT,
        TofQuantity::PhasorIndirect => CAMLUX_LAYER_TOF_PHASOR_INDIRECT,
        TofQuantity::PhasorStandardError => return None,
        TofQuantity::Range => CAMLUX_LAYER_TOF_RANGE,
        TofQuantity::Amplitude => CAMLUX_LAYER_TOF_AMPLITUDE,
        TofQuantity::Intensity => CAMLUX_LAYER_TOF_INTENSITY,
        TofQuantity::MultipathError => CAMLUX_LAYER_TOF_MPI,
        TofQuantity::Wraps => CAMLUX_LAYER_TOF_WRAPS,
        TofQuantity::Taps(phase) => CAMLUX_LAYER_TOF_TAPS + i32::from(phase),
    };
    Some(first + CAMLUX_TOF_NEXT_FREQUENCY * i32::from(frequency))
}

/// Sets a time-of-flight camera, with which frames have the layers CAMLUX_LAYER_HALF_PATH and CAMLUX_LAYER_TOF_PHASOR to
/// CAMLUX_LAYER_TOF_TAPS of each frequency. It needs camlux_scene_set_sensor with wavelength_nm and quantum_efficiency.
///
/// \param tof NULL: none, as at first. The noise and the indices that it points to are copied.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT. What does not go together with the rest of the scene, such as
/// a directional light that is modulated, is CAMLUX_ERROR_SCENE when it is rendered, or by camlux_scene_validate.
/// \threads any; calls for one scene take turns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_tof(
    scene: *mut camlux_scene,
    tof: *const camlux_tof,
) -> camlux_status {
    ffi_guard("camlux_scene_set_tof", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller's word.
        let tof = unsafe { args::read_optional(tof) }?;
        // SAFETY: the caller's word.
        let tof = tof.map(|tof| unsafe { tof_from_c(tof) }).transpose()?;
        object.lock_to_change().scene.tof = tof;
        Ok(())
    })
}

/// # Safety
/// Its pointers are null, or misaligned, or point to what it says.
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
        name: "ambient_lights",
        data: tof.ambient_lights.cast(),
        stride_bytes: 0,
        count: tof.ambient_light_count,
        length: 1,
    };
    // SAFETY: the caller's word.
    let (noise, ambient_lights) = unsafe {
        let index = |light: &[u32]| light[0] as usize;
        (args::read_optional(tof.noise)?, ambient_lights.read(index)?)
    };
    Ok(TimeOfFlight {
        frequencies_hz: tof.frequencies_hz[..count].to_vec(),
        phase_count: tof.phase_count,
        contrasts: tof.contrasts[..count].to_vec(),
        band_weights: tof.band_weights,
        phase_offset_deg: tof.phase_offset_deg,
        ambient_lights,
        output: args::one_of("output", tof.output, &outputs)?,
        noise: noise.map(noise_from_c),
    })
}

fn noise_from_c(noise: camlux_tof_noise) -> SensorNoise {
    SensorNoise {
        seed: noise.seed,
        dark_e_per_s: noise.dark_e_per_s,
        read_noise_e: noise.read_noise_e,
        full_well_e: noise.full_well_e,
        gain_dn_per_e: noise.gain_dn_per_e,
        black_level_dn: noise.black_level_dn,
        bits: noise.bits,
    }
}
