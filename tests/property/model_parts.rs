//! Building blocks of the model against closed forms: solid angles, a spot light's cone, sums.

use std::f64::consts::{FRAC_PI_2, PI};

use camlux::model::{CompensatedSum, rectangle_solid_angle, triangle_solid_angle};
use camlux::scene::ConeIntegral;
use glam::DVec3;

#[test]
fn known_solid_angles() {
    // An octant of the sphere, a face of a cube; a few roundings.
    let octant = triangle_solid_angle(DVec3::X, 2.0 * DVec3::Y, 3.0 * DVec3::Z);
    assert!((octant - PI / 2.0).abs() < 1e-15);
    let face = rectangle_solid_angle([-1.0, 1.0], [-1.0, 1.0]);
    assert!((face - 4.0 * PI / 6.0).abs() < 2e-15);
}

#[test]
fn small_rectangles_keep_their_digits() {
    // Off axis at u = 1 the solid angle tends to area·cos³ = area/2^1.5; the next term is of order (width)² = 1e-16.
    let width = 2f64.powi(-26);
    let solid_angle = rectangle_solid_angle([1.0 - width, 1.0 + width], [-width, width]);
    let relative = solid_angle / (4.0 * width * width / 2f64.powf(1.5)) - 1.0;
    assert!(relative.abs() < 2e-15, "{relative:e}");
}

/// The closed forms agree where the code switches between them, and across the removable singularity w = ½π.
#[test]
fn both_forms_agree_where_they_meet() {
    for inner_deg in [0.0, 1.0, 30.0, 85.0] {
        for w_rad in [1.0, FRAC_PI_2] {
            let at = |w_rad: f64| {
                let integral = ConeIntegral {
                    inner_rad: f64::to_radians(inner_deg),
                    outer_rad: f64::to_radians(inner_deg) + w_rad,
                };
                integral.falloff_within(integral.outer_rad)
            };
            // The derivative in w is below 2, so a true step of 2e-9 accounts for 4e-9.
            let step = (at(w_rad + 1e-9) - at(w_rad - 1e-9)).abs();
            assert!(step < 4e-9, "inner {inner_deg}, w {w_rad}: {step:e}");
        }
    }
}

/// Small-angle limit: for θ_i = 0 the integral is θ_o²·(2/π)·(1 − 2/π), with a relative error of order θ_o².
#[test]
fn narrow_cones_keep_their_digits() {
    for outer_rad in [1e-4, 1e-6, 1e-9, 1e-12] {
        let integral = ConeIntegral {
            inner_rad: 0.0,
            outer_rad,
        };
        let expected = outer_rad * outer_rad / FRAC_PI_2 * (1.0 - 1.0 / FRAC_PI_2);
        let relative = integral.falloff_within(outer_rad) / expected - 1.0;
        assert!(
            relative.abs() < outer_rad * outer_rad + 2e-15,
            "{outer_rad:e}: {relative:e}"
        );
    }
}

#[test]
fn keeps_what_plain_summation_loses() {
    let terms = || [1.0, 1e100, 1.0, -1e100].into_iter();
    assert_eq!(terms().sum::<f64>(), 0.0);
    assert_eq!(terms().collect::<CompensatedSum>().value(), 2.0);
}
