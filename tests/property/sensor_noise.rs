//! The noise of a sensor against closed forms, over many readings.

use std::f64::consts::PI;

use camlux::model::{
    FrameKey, PhaseSampling, Phasor, Reading, SPEED_OF_LIGHT_M_S, range_m, unambiguous_range_m,
};
use camlux::scene::SensorNoise;

const READINGS: u32 = 10_000;
const EXPOSURE_S: f64 = 2e-3;

const NOISE: SensorNoise = SensorNoise {
    seed: 7,
    dark_e_per_s: 50_000.0,
    read_noise_e: 12.0,
    full_well_e: 1e5,
    gain_dn_per_e: 0.25,
    black_level_dn: 64.0,
    bits: 12,
};

fn reading(pixel: u32) -> Reading {
    Reading {
        frame: FrameKey::default(),
        pixel,
        frequency: 0,
        phase: 0,
        tap: 0,
    }
}

/// Asserts that mean and variance are within three of their standard errors.
#[track_caller]
fn assert_moments(what: &str, values: &[f64], mean: f64, variance: f64) {
    let n = values.len() as f64;
    let found_mean = values.iter().sum::<f64>() / n;
    let found_variance = values.iter().map(|v| (v - found_mean).powi(2)).sum::<f64>() / (n - 1.0);
    let off_mean = (found_mean - mean) / (variance / n).sqrt();
    let off_variance = (found_variance / variance - 1.0) / (2.0 / n).sqrt();
    println!("{what}: mean {off_mean:+.2}, variance {off_variance:+.2} standard errors off");
    assert!(off_mean.abs() < 3.0, "{what}: mean {found_mean} for {mean}");
    assert!(
        off_variance.abs() < 3.0,
        "{what}: variance {found_variance} for {variance}"
    );
}

#[test]
fn electrons_are_those_of_poisson_and_gauss() {
    let dark = NOISE.dark_e_per_s * EXPOSURE_S;
    // Below and above the mean at which the sampling method changes.
    for expected in [0.0, 3.0, 800.0, 20_000.0] {
        let read = |pixel| NOISE.electrons(expected, EXPOSURE_S, reading(pixel));
        let values: Vec<f64> = (0..READINGS).map(read).collect();
        let mean = expected + dark;
        let variance = mean + NOISE.read_noise_e.powi(2);
        assert_moments(&format!("{expected} e-"), &values, mean, variance);
    }
}

#[test]
fn numbers_have_gain_offset_and_one_rounding() {
    let dark = NOISE.dark_e_per_s * EXPOSURE_S;
    let expected = 5_000.0;
    let read = |pixel| NOISE.digital_number(NOISE.electrons(expected, EXPOSURE_S, reading(pixel)));
    let values: Vec<f64> = (0..READINGS).map(read).collect();
    assert!(values.iter().all(|value| value.fract() == 0.0));
    let variance_e = expected + dark + NOISE.read_noise_e.powi(2);
    let mean = 64.0 + 0.25 * (expected + dark);
    assert_moments("numbers", &values, mean, 0.0625 * variance_e + 1.0 / 12.0);
    assert_eq!(NOISE.digital_number(1e9), 4095.0);
    assert_eq!(NOISE.digital_number(-1e9), 0.0);
}

#[test]
fn a_full_well_holds_no_more() {
    let noise = SensorNoise {
        read_noise_e: 0.0,
        ..NOISE
    };
    for pixel in 0..100 {
        assert_eq!(noise.electrons(1e6, EXPOSURE_S, reading(pixel)), 1e5);
    }
    let without = SensorNoise {
        dark_e_per_s: 0.0,
        ..noise
    };
    assert_eq!(without.electrons(0.0, EXPOSURE_S, reading(0)), 0.0);
}

/// σ_range = c/(4πfK·N_s)·√((N_s + N_b + 2σ_r²)/2), with N_s and N_b the electrons of modulated and other light in both taps of a phase image.
#[test]
fn a_range_scatters_as_it_should() {
    let noise = SensorNoise {
        dark_e_per_s: 0.0,
        ..NOISE
    };
    let (frequency_hz, of_signal, of_ambient) = (20e6, 20_000.0, 15_000.0);
    let contrast = 0.75;
    let sampling = PhaseSampling::new(4, contrast);
    let phasor = Phasor::of_path(of_signal, 2.0 * 3.1, frequency_hz);
    let mut differences_of_first = Vec::new();
    let range = |pixel| {
        let differences = [0, 1, 2, 3].map(|phase: u8| {
            let expected = sampling.taps(of_signal + of_ambient, phasor, phase.into());
            let [a, b] = [0, 1].map(|tap: u8| {
                let reading = Reading {
                    phase,
                    tap,
                    ..reading(pixel)
                };
                noise.electrons(expected[usize::from(tap)], EXPOSURE_S, reading)
            });
            a - b
        });
        differences_of_first.push(differences[0]);
        range_m(sampling.demodulate(differences), frequency_hz).expect("light")
    };
    let ranges: Vec<f64> = (0..READINGS).map(range).collect();
    let of_difference = of_signal + of_ambient + 2.0 * noise.read_noise_e.powi(2);
    let difference = contrast * phasor.re;
    assert_moments(
        "difference",
        &differences_of_first,
        difference,
        of_difference,
    );
    let per_radian = SPEED_OF_LIGHT_M_S / (4.0 * PI * frequency_hz);
    let sigma_m = per_radian / (contrast * of_signal) * (of_difference / 2.0).sqrt();
    assert!(3.1 < unambiguous_range_m(frequency_hz));
    assert_moments("range", &ranges, 3.1, sigma_m.powi(2));
}

/// Readings whose keys differ in one part are uncorrelated: correlations of 10⁴ pairs are within 3.5/√n.
#[test]
fn readings_are_independent_of_each_other() {
    let all = |change: &dyn Fn(&mut Reading)| -> Vec<f64> {
        let read = |pixel| {
            let mut reading = reading(pixel);
            change(&mut reading);
            NOISE.electrons(400.0, EXPOSURE_S, reading)
        };
        (0..READINGS).map(read).collect()
    };
    let first = all(&|_| {});
    let others = [
        ("frame", all(&|reading| reading.frame.index = 1)),
        ("camera", all(&|reading| reading.frame.camera = 1)),
        ("seed", all(&|reading| reading.frame.seed = 1)),
        ("pixel", all(&|reading| reading.pixel += 1)),
        ("frequency", all(&|reading| reading.frequency = 1)),
        ("phase", all(&|reading| reading.phase = 1)),
        ("tap", all(&|reading| reading.tap = 1)),
    ];
    let mean = 400.0 + NOISE.dark_e_per_s * EXPOSURE_S;
    let variance = mean + NOISE.read_noise_e.powi(2);
    for (name, second) in others {
        let products = first
            .iter()
            .zip(&second)
            .map(|(a, b)| (a - mean) * (b - mean));
        let correlation = products.sum::<f64>() / f64::from(READINGS) / variance;
        println!("{name}: {correlation:+.4}");
        assert!(
            correlation.abs() < 3.5 / f64::from(READINGS).sqrt(),
            "{name}: {correlation}"
        );
    }
}
