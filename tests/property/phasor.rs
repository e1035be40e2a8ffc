//! Phasors in f64 against closed forms.

use std::f64::consts::{PI, TAU};

use crate::common::quadrature::unit_interval;
use camlux::model::{
    PhaseSampling, Phasor, SPEED_OF_LIGHT_M_S, electrons, multipath_error_m, range_m,
    unambiguous_range_m,
};

/// k = 2πf/c, 1/m.
fn wave_number(frequency_hz: f64) -> f64 {
    TAU * frequency_hz / SPEED_OF_LIGHT_M_S
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance
}

#[test]
fn a_path_has_its_range() {
    for frequency_hz in [1e6, 20e6, 100e6, 200e6, 1e9] {
        let most_m = unambiguous_range_m(frequency_hz);
        for range in [0.0, 0.001, 0.3, 0.7123, 9.9, 1e4] {
            let found = range_m(
                Phasor::of_path(2.5, 2.0 * range, frequency_hz),
                frequency_hz,
            );
            let found = found.expect("there is light");
            let away = (found - range).rem_euclid(most_m);
            assert!((0.0..most_m).contains(&found), "{found} of {most_m}");
            assert!(
                away.min(most_m - away) < 1e-9,
                "{range} m at {frequency_hz} Hz: {found}"
            );
        }
    }
}

#[test]
fn nothing_has_no_range() {
    let (none, some) = (Phasor::default(), Phasor::of_path(1.0, 1.0, 20e6));
    assert_eq!(range_m(none, 20e6), None);
    assert_eq!(multipath_error_m(some, none, 20e6), None);
    assert_eq!(multipath_error_m(none, some, 20e6), None);
    // Antiphase.
    let opposite = some * -1.0;
    assert_eq!(range_m(some + opposite, 20e6), None);
}

#[test]
fn phase_images_give_the_phasor_back() {
    let (energy, phasor) = (3.0, Phasor { re: -0.7, im: 1.1 });
    for phase_count in [3, 4, 5, 8] {
        let sampling = PhaseSampling::new(phase_count, 0.6);
        let taps: Vec<_> = (0..phase_count as usize)
            .map(|phase| sampling.taps(energy, phasor, phase))
            .collect();
        for [a, b] in &taps {
            assert!(close(a + b, energy, 1e-15) && *a >= 0.0 && *b >= 0.0);
        }
        let differences: Vec<_> = taps.iter().map(|[a, b]| a - b).collect();
        let found = sampling.demodulate(differences.iter().copied());
        assert!(
            close(found.re, 0.6 * phasor.re, 1e-15),
            "{phase_count}: {found:?}"
        );
        assert!(
            close(found.im, 0.6 * phasor.im, 1e-15),
            "{phase_count}: {found:?}"
        );
        // Noise that is equal in all phase images has no phase.
        let alike = sampling.demodulate((0..phase_count).map(|_| 1.0));
        assert_eq!(alike, Phasor::default(), "{phase_count}");
        if let [d0, d1, d2, d3] = differences[..] {
            let phase = (d3 - d1).atan2(d0 - d2);
            assert!(close(phase, phasor.im.atan2(phasor.re), 1e-15));
        }
    }
}

/// A photon of 850 nm has 2.337e-19 J.
#[test]
fn photons_free_electrons() {
    let of_a_photon = 6.626_070_15e-34 * 299_792_458.0 / 850e-9;
    assert!(close(
        electrons(1000.0 * of_a_photon, 850e-9, 0.8),
        800.0,
        1e-9
    ));
    assert!(close(of_a_photon, 2.337e-19, 1e-22));
}

/// A Lambertian sphere of radius R with the light at its centre: the ratio of bounce to direct light is ρ·G(x) for every point and camera,
/// G(x) = 2[e^{ix}(1 − ix) − 1]/x², x = 2kR.
#[test]
fn the_bounce_in_a_sphere_has_its_closed_form() {
    let albedo = 0.5;
    // Frequency, range bias in mm for R = 1 m, |Z| relative to the light at f = 0.
    let known = [
        (1.0, 222.222, 1.0),
        (10e6, 220.921, 0.98974),
        (20e6, 216.922, 0.95950),
        (50e6, 184.510, 0.77099),
        (100e6, 23.287, 0.47414),
    ];
    for (frequency_hz, bias_mm, share) in known {
        // The chord length s from P to points of the sphere has the density s/2 from 0 to 2.
        let part = |is_im: bool| {
            // Shifted, because the quadrature needs integrands of one sign.
            unit_interval(1e-10, |t| {
                let path = Phasor::of_path(2.0 * t, 2.0 * t, frequency_hz);
                2.0 * t + if is_im { path.im } else { path.re }
            }) - 1.0
        };
        let bounce = Phasor {
            re: part(false),
            im: part(true),
        } * albedo;
        let x = 2.0 * wave_number(frequency_hz);
        if x > 0.1 {
            // e^{ix}(1 − ix) − 1
            let turned = Phasor {
                re: x.cos(),
                im: x.sin(),
            } * Phasor { re: 1.0, im: -x };
            let closed = (turned + Phasor { re: -1.0, im: 0.0 }) * (2.0 * albedo / (x * x));
            assert!(close(bounce.re, closed.re, 1e-9), "{bounce:?} {closed:?}");
            assert!(close(bounce.im, closed.im, 1e-9), "{bounce:?} {closed:?}");
        }
        let direct = Phasor { re: 1.0, im: 0.0 };
        let total = direct + bounce;
        let found_mm = 1e3 * multipath_error_m(total, direct, frequency_hz).expect("light");
        assert!(
            close(found_mm, bias_mm, 6e-4),
            "{frequency_hz}: {found_mm} mm"
        );
        assert!(
            close(total.magnitude() / (1.0 + albedo), share, 6e-6),
            "{frequency_hz}"
        );
    }
}

/// Compares sums over paths between two plates with an integral. P is on the lower plate, below the light at height a. The upper plate is at
/// height H. E_P = 2ρI₀bH²∫ r(b² + r²)^{−3/2}(r² + H²)^{−2}·e^{ik(√(b² + r²) + √(r² + H²))} dr, b = H − a.
#[test]
fn the_bounce_between_plates_has_its_integral() {
    let (albedo, height_m, gap_m, frequency_hz) = (0.6, 0.7_f64, 2.0_f64, 30e6);
    let below_m = gap_m - height_m;
    // The model's formulas, ring by ring of the upper plate, r from 0 to 300 m.
    let rings = 400_000;
    let r_at = |i: f64| 300.0 * (i / f64::from(rings)).powi(3);
    let paths = (0..rings).map(|i| {
        let r = r_at(f64::from(i) + 0.5);
        let area = PI * (r_at(f64::from(i) + 1.0).powi(2) - r_at(f64::from(i)).powi(2));
        let (to_q, to_p) = (below_m.hypot(r), gap_m.hypot(r));
        let irradiance_q = below_m / to_q / (to_q * to_q);
        let cosines = (gap_m / to_p).powi(2);
        let irradiance_p = albedo / PI * irradiance_q * cosines / (to_p * to_p) * area;
        Phasor::of_path(irradiance_p, to_q + to_p, frequency_hz)
    });
    let found: Phasor = paths.sum();
    let k = wave_number(frequency_hz);
    let integrand = |t: f64| {
        // r = t/(1 − t)
        let r = t / (1.0 - t).max(1e-12);
        let (to_q, to_p) = (below_m.hypot(r), gap_m.hypot(r));
        let scale = 2.0 * albedo * below_m * gap_m * gap_m * r / (to_q.powi(3) * to_p.powi(4));
        (scale * (1.0 + r).powi(2), k * (to_q + to_p))
    };
    let whole = unit_interval(1e-10, |t| integrand(t).0);
    let shifted = |f: &dyn Fn(f64) -> f64| {
        unit_interval(1e-10, |t| {
            let (scale, phase) = integrand(t);
            scale * (1.0 + f(phase))
        }) - whole
    };
    let (re, im) = (shifted(&f64::cos), shifted(&f64::sin));
    assert!(close(found.re, re, 1e-7 * whole), "{found:?} {re} {im}");
    assert!(close(found.im, im, 1e-7 * whole), "{found:?} {re} {im}");
}
