//! What a time-of-flight camera makes of the phasors of its pixels. In f64: of a phase, f32 keeps 1e-7 turns.

use super::{Layer, LayerData, TofQuantity};
use crate::{
    model::{PhaseSampling, Phasor, electrons, multipath_error_m, range_m, wrap_count},
    scene::{Photodetector, Sensor, TimeOfFlight},
};

/// What a pixel has of one frequency.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PixelPhasors {
    pub direct: Phasor,
    pub indirect: Phasor,
}

/// The layers of one frequency, but for the standard error. `phasors`, `radiances` (L of all light, as the pixels see it, W/sr/m²) and `half_paths_m`
/// are those of the pixels.
pub(crate) fn tof_layers(
    (tof, sensor, photodetector): (&TimeOfFlight, Sensor, Photodetector),
    frequency: usize,
    phasors: &[PixelPhasors],
    radiances: &[f64],
    half_paths_m: &[f64],
) -> Vec<(Layer, LayerData)> {
    let frequency_hz = tof.frequencies_hz[frequency];
    let sampling = PhaseSampling::of(tof, frequency);
    let offset = Phasor::of_angle(tof.phase_offset_deg.to_radians());
    let wavelength_m = 1e-9 * photodetector.wavelength_nm;
    let electrons_per_radiance = electrons(
        sensor.joule_per_irradiance(),
        wavelength_m,
        photodetector.quantum_efficiency,
    );
    let total = |p: &PixelPhasors| p.direct + p.indirect;
    let measured = |p: &PixelPhasors| total(p) * offset * electrons_per_radiance;
    let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let floats = |value: &dyn Fn(&PixelPhasors) -> f64| {
        LayerData::Float(phasors.iter().map(|p| value(p) as f32).collect())
    };
    let complex = |value: &dyn Fn(&PixelPhasors) -> Phasor| {
        let values = phasors.iter().map(value);
        LayerData::Float(values.flat_map(|z| [z.re as f32, z.im as f32]).collect())
    };
    let all_phases = f64::from(tof.phase_count) * electrons_per_radiance;
    let intensities = radiances
        .iter()
        .map(|radiance| (all_phases * radiance) as f32);
    let wraps = half_paths_m
        .iter()
        .map(|&half_path_m| match half_path_m.is_finite() {
            true => wrap_count(half_path_m, frequency_hz),
            false => 0,
        });
    let mut layers = vec![
        (TofQuantity::Phasor, complex(&total)),
        (TofQuantity::PhasorDirect, complex(&|p| p.direct)),
        (TofQuantity::PhasorIndirect, complex(&|p| p.indirect)),
        (
            TofQuantity::Range,
            floats(&|p| or_nan(range_m(total(p) * offset, frequency_hz))),
        ),
        (
            TofQuantity::Amplitude,
            floats(&|p| sampling.contrast * measured(p).magnitude()),
        ),
        (
            TofQuantity::Intensity,
            LayerData::Float(intensities.collect()),
        ),
        (
            TofQuantity::MultipathError,
            floats(&|p| or_nan(multipath_error_m(total(p), p.direct, frequency_hz))),
        ),
        (TofQuantity::Wraps, LayerData::Id(wraps.collect())),
    ];
    for phase in 0..tof.phase_count {
        let taps = phasors.iter().zip(radiances).flat_map(|(p, radiance)| {
            let energy = electrons_per_radiance * radiance;
            sampling
                .taps(energy, measured(p), phase)
                .map(|charge| charge as f32)
        });
        layers.push((
            TofQuantity::Taps(phase as u8),
            LayerData::Float(taps.collect()),
        ));
    }
    let named = |(quantity, data)| (Layer::Tof(frequency as u8, quantity), data);
    layers.into_iter().map(named).collect()
}
