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
    dsnu_e: 0.0,
    prnu: 0.0,
};

fn reading(pixel: u32) -> Reading {
    Reading {
        frame: FrameKey::default(),
        pixel,
        frequency: 0,
        phase: 0,
        well: 0,
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
fn pixels_differ_by_their_fixed_pattern() {
    let noise = SensorNoise {
        read_noise_e: 0.0,
        dark_e_per_s: 0.0,
        dsnu_e: 3.0,
        prnu: 0.02,
        full_well_e: 1e12,
        ..NOISE
    };
    // Without light a reading is the pixel's offset alone.
    let dark = |frame: u32, seed| {
        move |pixel| {
            let mut reading = reading(pixel);
            (reading.frame.index, reading.frame.seed) = (frame, seed);
            noise.electrons(0.0, EXPOSURE_S, reading)
        }
    };
    let offsets: Vec<f64> = (0..READINGS).map(dark(0, 0)).collect();
    assert_moments("offsets", &offsets, 0.0, noise.dsnu_e.powi(2));
    for (frame, seed) in [(1, 0), (0, 1)] {
        let again: Vec<f64> = (0..READINGS).map(dark(frame, seed)).collect();
        assert_eq!(offsets, again, "a fixed pattern changes");
    }
    // So bright that the responses drown the shot noise.
    let expected = 1e10;
    let read = |pixel| noise.electrons(expected, EXPOSURE_S, reading(pixel));
    let bright: Vec<f64> = (0..READINGS).map(read).collect();
    let variance = (noise.prnu * expected).powi(2) + expected + noise.dsnu_e.powi(2);
    assert_moments("responses", &bright, expected, variance);
    let pairs = bright.iter().zip(&offsets);
    let products = pairs.map(|(response, offset)| (response - expected) * offset);
    let scale = f64::from(READINGS) * (variance * noise.dsnu_e.powi(2)).sqrt();
    let correlation = products.sum::<f64>() / scale;
    assert!(
        correlation.abs() < 3.5 / f64::from(READINGS).sqrt(),
        "{correlation}"
    );
    // Another camera and another well have patterns of their own.
    let mut reading = reading(0);
    reading.frame.camera = 1;
    assert_ne!(noise.electrons(0.0, EXPOSURE_S, reading), offsets[0]);
    reading.frame.camera = 0;
    reading.well = 1;
    assert_ne!(noise.electrons(0.0, EXPOSURE_S, reading), offsets[0]);
}

/// σ² = G·(μ − μ₀) + G²·(dark + σ_r²) + 1/12: the slope of the line through ten exposures is the gain.
#[test]
fn the_photon_transfer_curve_has_the_slope_of_the_gain() {
    let points: Vec<[f64; 2]> = (1..=10_u8)
        .map(|exposure| {
            let expected = 1_000.0 * f64::from(exposure);
            let read = |pixel| {
                let reading = Reading {
                    phase: exposure,
                    ..reading(pixel)
                };
                NOISE.digital_number(NOISE.electrons(expected, EXPOSURE_S, reading))
            };
            let values: Vec<f64> = (0..READINGS).map(read).collect();
            let n = f64::from(READINGS);
            let mean = values.iter().sum::<f64>() / n;
            let squares = values.iter().map(|value| (value - mean).powi(2));
            [mean, squares.sum::<f64>() / (n - 1.0)]
        })
        .collect();
    // Least squares with each point's own standard error of the variance, σ²·√(2/n).
    let weight = |[_, variance]: &[f64; 2]| variance.powi(-2);
    let total: f64 = points.iter().map(weight).sum();
    let centre = [0, 1].map(|axis| points.iter().map(|p| weight(p) * p[axis]).sum::<f64>() / total);
    let spread = points
        .iter()
        .map(|p| weight(p) * (p[0] - centre[0]).powi(2));
    let spread: f64 = spread.sum();
    let products = points
        .iter()
        .map(|p| weight(p) * (p[0] - centre[0]) * (p[1] - centre[1]));
    let slope = products.sum::<f64>() / spread;
    let standard_error = (2.0 / f64::from(READINGS) / spread).sqrt();
    let off = (slope - NOISE.gain_dn_per_e) / standard_error;
    println!("slope {slope:.5} DN/e-, {off:+.2} standard errors off");
    assert!(off.abs() < 3.0, "{slope} for {}", NOISE.gain_dn_per_e);
    let dark_dn2 = NOISE.dark_e_per_s * EXPOSURE_S + NOISE.read_noise_e.powi(2);
    let black_dn2 = NOISE.gain_dn_per_e.powi(2) * dark_dn2 + 1.0 / 12.0;
    let dark_dn = NOISE.gain_dn_per_e * NOISE.dark_e_per_s * EXPOSURE_S;
    let at_black = centre[1] - slope * (centre[0] - NOISE.black_level_dn - dark_dn);
    let off = (at_black - black_dn2) / (standard_error * (centre[0] - NOISE.black_level_dn));
    assert!(off.abs() < 3.0, "{at_black} DN² for {black_dn2} DN²");
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
                    well: tap,
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
        ("well", all(&|reading| reading.well = 1)),
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
