//! The layers of a time-of-flight camera and their names.

use super::Layer;
use crate::scene::{MAX_FREQUENCIES, MAX_PHASES};

/// A quantity of one frequency. Pixels without light hold 0, but NaN in `range` and `mpi`. Charges are electrons, or digital numbers if
/// the scene requests them ([`Layer::unit_by`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TofQuantity {
    /// Z, of all light, W/sr/m², channels re, im.
    Phasor,
    /// Z of the direct light.
    PhasorDirect,
    /// Z of the indirect light.
    PhasorIndirect,
    /// Standard error of the indirect light's Z; only in a reference image.
    PhasorStandardError,
    /// Charge of both taps in the phase image with this index, electrons, channels A, B.
    Taps(u8),
    /// Half the path length from the phases, from 0 to c/(2f), metres; NaN where Z is 0.
    Range,
    /// K·|Q_Z|, electrons.
    Amplitude,
    /// Σ(A + B) over all phase images, electrons.
    Intensity,
    /// Multipath error: how much farther the pixel appears than by its direct light alone, metres; NaN where the direct light is 0.
    MultipathError,
    /// Number of times that the phase of the shortest path has wrapped.
    Wraps,
}

const PER_FREQUENCY: usize = 9 + MAX_PHASES;

/// Every possible layer.
pub(super) const TOF_LAYERS: [Layer; MAX_FREQUENCIES * PER_FREQUENCY] = {
    let mut layers = [Layer::HalfPath; MAX_FREQUENCIES * PER_FREQUENCY];
    let mut i = 0;
    while i < layers.len() {
        let quantity = match i % PER_FREQUENCY {
            0 => TofQuantity::Phasor,
            1 => TofQuantity::PhasorDirect,
            2 => TofQuantity::PhasorIndirect,
            3 => TofQuantity::PhasorStandardError,
            4 => TofQuantity::Range,
            5 => TofQuantity::Amplitude,
            6 => TofQuantity::Intensity,
            7 => TofQuantity::MultipathError,
            8 => TofQuantity::Wraps,
            phase => TofQuantity::Taps((phase - 9) as u8),
        };
        layers[i] = Layer::Tof((i / PER_FREQUENCY) as u8, quantity);
        i += 1;
    }
    layers
};

/// Name, channels, unit.
pub(super) fn describe_tof(
    frequency: u8,
    quantity: TofQuantity,
) -> (&'static str, &'static [&'static str], &'static str) {
    const RADIANCE: &str = "W/sr/m^2";
    const ELECTRONS: &str = "e-";
    macro_rules! layer {
        ($name:expr, $unit:expr, $($channel:literal),+) => {
            ($name, &[$(concat!($name, $channel)),+], $unit)
        };
    }
    macro_rules! of_frequency {
        ($f:literal) => {
            match quantity {
                TofQuantity::Phasor => layer!(concat!($f, ".phasor"), RADIANCE, ".re", ".im"),
                TofQuantity::PhasorDirect => {
                    layer!(concat!($f, ".phasor_direct"), RADIANCE, ".re", ".im")
                }
                TofQuantity::PhasorIndirect => {
                    layer!(concat!($f, ".phasor_indirect"), RADIANCE, ".re", ".im")
                }
                TofQuantity::PhasorStandardError => {
                    layer!(concat!($f, ".phasor_stderr"), RADIANCE, ".re", ".im")
                }
                TofQuantity::Range => layer!(concat!($f, ".range"), "m", ".Z"),
                TofQuantity::Amplitude => layer!(concat!($f, ".amplitude"), ELECTRONS, ".Y"),
                TofQuantity::Intensity => layer!(concat!($f, ".intensity"), ELECTRONS, ".Y"),
                TofQuantity::MultipathError => layer!(concat!($f, ".mpi"), "m", ".Z"),
                TofQuantity::Wraps => layer!(concat!($f, ".wraps"), "1", ""),
                TofQuantity::Taps(0) => layer!(concat!($f, ".phase0"), ELECTRONS, ".A", ".B"),
                TofQuantity::Taps(1) => layer!(concat!($f, ".phase1"), ELECTRONS, ".A", ".B"),
                TofQuantity::Taps(2) => layer!(concat!($f, ".phase2"), ELECTRONS, ".A", ".B"),
                TofQuantity::Taps(3) => layer!(concat!($f, ".phase3"), ELECTRONS, ".A", ".B"),
                TofQuantity::Taps(4) => layer!(concat!($f, ".phase4"), ELECTRONS, ".A", ".B"),
                TofQuantity::Taps(5) => layer!(concat!($f, ".phase5"), ELECTRONS, ".A", ".B"),
                TofQuantity::Taps(6) => layer!(concat!($f, ".phase6"), ELECTRONS, ".A", ".B"),
                TofQuantity::Taps(_) => layer!(concat!($f, ".phase7"), ELECTRONS, ".A", ".B"),
            }
        };
    }
    match frequency {
        0 => of_frequency!("tof0"),
        1 => of_frequency!("tof1"),
        2 => of_frequency!("tof2"),
        _ => of_frequency!("tof3"),
    }
}
