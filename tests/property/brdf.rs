//! The BRDF against closed forms: energy and reciprocity.

use std::f64::consts::{FRAC_PI_2, PI};

use camlux::model::{Brdf, Lobe};
use camlux::scene::MetallicRoughness;
use glam::{DQuat, DVec3};

fn phong(kd: [f64; 3], ks: [f64; 3], shininess: f64) -> Brdf {
    let lobe = Lobe::Phong { ks, shininess };
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
        let is_specular = [true, true, false];
        for view_deg in [0.0, 20.0, 45.0, 70.0, 89.0] {
            let v = on_hemisphere(f64::to_radians(view_deg), 0.4);
            let reflected = reflected_share(&brdf, v);
            for band in 0..3 {
                let excess = reflected[band] - limits[band];
                let case = format!("s {shininess}, {view_deg}°, band {band}: {excess:e}");
                assert!(excess < quadrature_error, "{case}");
                // No light is lost at normal incidence, nor for the diffuse part at any angle.
                if view_deg == 0.0 || !is_specular[band] {
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

fn facets(f0: f64, roughness: f64) -> Brdf {
    Brdf {
        kd: [0.0; 3],
        lobe: Lobe::Microfacets {
            f0: [f0; 3],
            alpha: roughness * roughness,
        },
    }
}

/// The share of light from v that facets with F = 1 reflect, by the angle and the azimuth of h about n: dω_l = 4·h·v dω_h. Tangents of
/// the angle follow the lobe's width.
fn reflected_by_facets(roughness: f64, v: DVec3) -> f64 {
    let brdf = facets(1.0, roughness);
    let alpha = roughness * roughness;
    let (steps, turns) = (2000, 720);
    let mut sum = 0.0;
    for i in 0..steps {
        // t in 0 to 1 is the share of facets within the angle: tan²θ = α²·t/(1−t).
        let t = (i as f64 + 0.5) / steps as f64;
        let theta = (alpha * (t / (1.0 - t)).sqrt()).atan();
        let density = alpha.powi(2)
            / (PI * theta.cos().powi(3) * (alpha.powi(2) + theta.tan().powi(2)).powi(2));
        for j in 0..turns {
            let phi = (j as f64 + 0.5) / turns as f64 * 2.0 * PI;
            let h = on_hemisphere(theta, phi);
            let l = 2.0 * h.dot(v) * h - v;
            if l.z > 0.0 && h.dot(v) > 0.0 {
                sum += brdf.eval(l, DVec3::Z, v)[0] * l.z * 4.0 * h.dot(v) / density;
            }
        }
    }
    sum / f64::from(steps * turns)
}

/// Facets hide each other, and light that they send to another facet is not modelled. So they reflect less than they receive, and all of it
/// only where they are smooth.
#[test]
fn facets_reflect_no_more_than_they_receive() {
    for roughness in [0.03, 0.1, 0.2, 0.4, 0.7, 1.0] {
        for view_deg in [0.0, 30.0, 60.0, 80.0, 89.0] {
            let share =
                reflected_by_facets(roughness, on_hemisphere(f64::to_radians(view_deg), 0.3));
            assert!(share < 1.0 + 1e-6, "{roughness} {view_deg}°: {share}");
            if roughness <= 0.1 && view_deg <= 60.0 {
                assert!(share > 0.999, "{roughness} {view_deg}°: {share}");
            }
        }
    }
}

/// Straight on, n·v = 1, so V = 1/2/(c + √(α²+(1−α²)c²)). At α = 1, D is 1/π, and the share is ∫ c/(1+c) dc from 0 to 1 = 1 − ln 2.
#[test]
fn rough_facets_reflect_what_the_closed_form_says() {
    let share = reflected_by_facets(1.0, DVec3::Z);
    let expected = 1.0 - 2.0_f64.ln();
    assert!((share - expected).abs() < 1e-6, "{share} {expected}");
}

/// D over all facets, by their projected area, is the surface: ∫ D·cosθ dω = 1. Its value along n is 1/(π·α²).
#[test]
fn facets_make_up_the_surface() {
    for roughness in [0.03, 0.3, 1.0] {
        let alpha = f64::powi(roughness, 2);
        let along_n = facets(1.0, roughness).eval(DVec3::Z, DVec3::Z, DVec3::Z)[0];
        // F = 1 and V = 1/4.
        assert!(
            (along_n * 4.0 * PI * alpha * alpha - 1.0).abs() < 1e-12,
            "{roughness}"
        );
    }
}

#[test]
fn facets_are_reciprocal() {
    for roughness in [0.03, 0.2, 1.0] {
        let brdf = facets(0.04, roughness);
        let n = DVec3::new(1.0, 2.0, -0.5).normalize();
        let to_n = DQuat::from_rotation_arc(DVec3::Z, n);
        for i in 0..200 {
            let l = to_n * on_hemisphere(1.5 * f64::from(i % 17) / 17.0, f64::from(i));
            let v = to_n * on_hemisphere(1.5 * f64::from(i % 23) / 23.0, 3.0 * f64::from(i));
            let (there, back) = (brdf.eval(l, n, v)[0], brdf.eval(v, n, l)[0]);
            assert!(
                there > 0.0 && (there - back).abs() <= 1e-11 * there,
                "{there} {back}"
            );
        }
    }
}

/// Straight on a dielectric reflects ((n−1)/(n+1))², at grazing angles all; metal its base colour.
#[test]
fn fresnel_goes_from_straight_on_to_grazing() {
    let surface = |metallic, ior| {
        let of = MetallicRoughness {
            metallic,
            roughness: 1.0,
            ior,
            ..MetallicRoughness::DEFAULT
        };
        Brdf::metallic_roughness([0.8, 0.5, 0.2], &of)
    };
    // With α = 1, D·V straight on is 1/(4π).
    let straight_on = |brdf: &Brdf| {
        brdf.eval(DVec3::Z, DVec3::Z, DVec3::Z)
            .map(|f| f * 4.0 * PI)
    };
    let glass = surface(0.0, 1.5);
    assert!((straight_on(&glass)[0] - (0.04 + 4.0 * glass.kd[0])).abs() < 1e-12);
    assert!((glass.kd[0] - 0.8 * 0.96).abs() < 1e-12);
    let metal = surface(1.0, 1.5);
    assert_eq!(metal.kd, [0.0; 3]);
    assert!((straight_on(&metal)[2] - 0.2).abs() < 1e-12);
    let grazing = on_hemisphere(FRAC_PI_2 - 1e-4, 0.0);
    let across = DVec3::new(-grazing.x, 0.0, grazing.z);
    let [as_glass, as_metal] = [glass, metal].map(|brdf| {
        let lobe = Brdf {
            kd: [0.0; 3],
            ..brdf
        };
        lobe.eval(across, DVec3::Z, grazing)[2]
    });
    assert!(
        (as_glass / as_metal - 1.0).abs() < 1e-3,
        "{as_glass} {as_metal}"
    );
}
