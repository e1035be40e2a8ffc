//! The BRDF against closed forms: energy and reciprocity.

use std::f64::consts::{FRAC_PI_2, PI};

use camlux::model::{Brdf, Lobe};
use glam::{DQuat, DVec3};

fn phong(kd: [f64; 3], ks: [f64; 3], shininess: f64) -> Brdf {
    let lobe = Lobe { ks, shininess };
    Brdf { kd, lobe }
}

fn on_hemisphere(theta: f64, phi: f64) -> DVec3 {
    DVec3::new(
        theta.sin() * phi.cos(),
        theta.sin() * phi.sin(),
        theta.cos(),
    )
}

/// Quadrature steps over the polar angle; the azimuth has twice this number.
const HEMISPHERE_STEPS: usize = 400;

/// ∫ f(l, n, v)·cosθ dω over the hemisphere of l: the share of light from v that is reflected.
fn reflected_share(brdf: &Brdf, v: DVec3) -> [f64; 3] {
    let step = FRAC_PI_2 / HEMISPHERE_STEPS as f64;
    let mut sum = [0.0; 3];
    for i in 0..HEMISPHERE_STEPS {
        let theta = (i as f64 + 0.5) * step;
        for j in 0..2 * HEMISPHERE_STEPS {
            let phi = (j as f64 + 0.5) * 2.0 * step;
            let f = brdf.eval(on_hemisphere(theta, phi), DVec3::Z, v);
            let measure = theta.cos() * theta.sin() * step * 2.0 * step;
            for band in 0..3 {
                sum[band] += f[band] * measure;
            }
        }
    }
    sum
}

#[test]
fn a_surface_reflects_no_more_than_its_reflectance() {
    for shininess in [0.0, 0.5, 1.0, 7.0, 200.0] {
        let brdf = phong([0.3, 0.0, 1.0], [0.6, 1.0, 0.0], shininess);
        // Error of the midpoint rule for cos^(s+1)·sin: step²·(s+4)/24 to leading order. Measured up to 1.3e-4 for s = 200,
        // 2.6e-6 for s = 0.
        let step = FRAC_PI_2 / HEMISPHERE_STEPS as f64;
        let quadrature_error = step * step * (shininess + 4.0) / 20.0;
        let limits = [0.9, 1.0, 1.0];
        for view_deg in [0.0, 20.0, 45.0, 70.0, 89.0] {
            let v = on_hemisphere(f64::to_radians(view_deg), 0.4);
            let reflected = reflected_share(&brdf, v);
            for band in 0..3 {
                let excess = reflected[band] - limits[band];
                let case = format!("s {shininess}, {view_deg}°, band {band}: {excess:e}");
                assert!(excess < quadrature_error, "{case}");
                // No light is lost at normal incidence, nor for the diffuse part at any angle.
                if view_deg == 0.0 || brdf.lobe.ks[band] == 0.0 {
                    assert!(excess > -quadrature_error, "{case}");
                }
            }
        }
    }
}

/// At s = 0 the lobe is a half space tilted by the view angle α, whose projected area is π·(1 + cos α)/2.
#[test]
fn exponent_zero_reflects_into_a_tilted_half_space() {
    let brdf = phong([0.0; 3], [1.0, 0.5, 0.0], 0.0);
    for view_deg in [0.0, 20.0, 45.0, 70.0, 89.0] {
        let view_rad = f64::to_radians(view_deg);
        let [full, half, none] = reflected_share(&brdf, on_hemisphere(view_rad, 0.4));
        // The lobe's edge cuts through cells of the quadrature: measured 1.1e-5.
        let error = full - 0.5 * (1.0 + view_rad.cos());
        assert!(error.abs() < 2e-5, "{view_deg}°: {error:e}");
        assert!((half - 0.5 * full).abs() < 1e-12, "{view_deg}°");
        assert_eq!(none, 0.0);
    }
}

#[test]
fn reflectance_is_reciprocal() {
    for shininess in [0.0, 1.0, 30.0, 200.0] {
        let brdf = phong([0.0; 3], [0.6; 3], shininess);
        let n = DVec3::new(1.0, 2.0, -0.5).normalize();
        let to_n = DQuat::from_rotation_arc(DVec3::Z, n);
        let mut lit = 0;
        for i in 0..200 {
            let l = to_n * on_hemisphere(1.5 * f64::from(i % 17) / 17.0, f64::from(i));
            let v = to_n * on_hemisphere(1.5 * f64::from(i % 23) / 23.0, 3.0 * f64::from(i));
            let (there, back) = (brdf.eval(l, n, v)[0], brdf.eval(v, n, l)[0]);
            // r·v has an absolute error of a few 1e-16, which the power multiplies by s/(r·v). Values below 1e-30 are therefore
            // noise and skipped. Measured 1.3e-13, at s = 200.
            if there > 1e-30 {
                lit += 1;
                let relative = (there - back).abs() / there;
                assert!(relative < 4e-13);
            }
        }
        assert!(lit > 50, "s {shininess}: {lit}");
    }
}

#[test]
fn exponent_zero_is_a_half_space() {
    let brdf = phong([0.0; 3], [1.0; 3], 0.0);
    let at = |v| brdf.eval(DVec3::Z, DVec3::Z, v)[0];
    assert_eq!(at(DVec3::new(0.8, 0.0, 0.6)), 1.0 / PI);
    assert_eq!(at(DVec3::X), 0.0, "r·v = 0");
    assert_eq!(at(DVec3::NEG_Z), 0.0, "r·v < 0");
}

#[test]
fn the_lobe_peaks_in_the_mirror_direction() {
    let brdf = phong([0.1, 0.2, 0.3], [0.5, 0.25, 0.0], 10.0);
    let f = brdf.eval(
        DVec3::new(0.6, 0.0, 0.8),
        DVec3::Z,
        DVec3::new(-0.6, 0.0, 0.8),
    );
    // (s+2)/(2π) = 6/π; three roundings.
    let expected = [3.1 / PI, 1.7 / PI, 0.3 / PI];
    for band in 0..3 {
        assert!((f[band] - expected[band]).abs() < 1e-14);
    }
}
