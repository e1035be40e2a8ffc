//! The model in f64 against closed forms and independent quadrature.

use std::f64::consts::{PI, TAU};

use crate::common::texels::texel_direction;
use camlux::emission::EmissionDomain;
use camlux::model::{
    Brdf, Lobe, Receiver, Vpl, direct_radiance, indirect_radiance, irradiance_facing,
    radiant_intensity, vpl_contribution,
};
use camlux::scene::{BoundingSphere, Light, SpotCone, VplSum};
use glam::DVec3;

const UNIT_SPHERE: BoundingSphere = BoundingSphere {
    centre_m: DVec3::ZERO,
    radius_m: 1.0,
};

const NO_LOBE: Lobe = Lobe::Phong {
    ks: [0.0; 3],
    shininess: 1.0,
};

const LAMBERT_HALF: Brdf = Brdf {
    kd: [0.5; 3],
    lobe: NO_LOBE,
};

fn spot(inner_half_angle_deg: f64, outer_half_angle_deg: f64) -> Light {
    Light::spot(
        DVec3::ZERO,
        DVec3::new(1.0, -2.0, 0.5),
        SpotCone {
            inner_half_angle_deg,
            outer_half_angle_deg,
        },
        [3.0, 2.0, 1.0],
    )
}

/// ∫ f over [start, end] by the midpoint rule of n steps; its error is step²/24·(f'(end) − f'(start)) for smooth f.
fn midpoint(start: f64, end: f64, n: usize, f: impl Fn(f64) -> f64) -> f64 {
    let step = (end - start) / n as f64;
    (0..n)
        .map(|i| f(start + (i as f64 + 0.5) * step))
        .sum::<f64>()
        * step
}

// --- The unit sphere of the design: I = π W/sr at the centre, k_d = 0.5 -------------------------------------------

/// A point light of I = π W/sr.
fn sphere_light() -> Light {
    Light::point(DVec3::ZERO, [4.0 * PI * PI; 3])
}

/// The sphere's RSM: one VPL per texel of the light's emission domain, put on the sphere analytically.
fn sphere_vpls(size: u32) -> Vec<Vpl> {
    let light = sphere_light();
    let domain = EmissionDomain::new(&light, size, &UNIT_SPHERE);
    let total = domain.total_measure();
    let mut texels = domain.texels.iter();
    let mut vpls = Vec::new();
    for face in &domain.faces {
        for y in 0..size {
            for x in 0..size {
                let position_m = texel_direction(&domain, face, x, y).normalize();
                let texel = texels.next().unwrap();
                vpls.push(Vpl {
                    position_m,
                    normal: -position_m,
                    to_light: -position_m,
                    from_light_m: 1.0,
                    area_m2: texel.measure,
                    brdf: LAMBERT_HALF,
                    irradiance_facing_w_m2: irradiance_facing(&light, position_m),
                    incident_power_w: domain.incident_power_w(texel),
                    domain_share: texel.measure / total,
                });
            }
        }
    }
    vpls
}

/// A point of the sphere that is not a texel centre at any size.
fn sphere_receiver() -> Receiver {
    let position_m = DVec3::new(0.3, -0.71, 0.2).normalize();
    Receiver {
        position_m,
        normal: -position_m,
        to_camera: -position_m,
        brdf: LAMBERT_HALF,
    }
}

#[test]
fn direct_radiance_in_the_unit_sphere_is_one_half() {
    let Receiver {
        position_m, normal, ..
    } = sphere_receiver();
    let camera_position_m = DVec3::new(0.1, 0.2, -0.3);
    let radiance = direct_radiance(
        &sphere_light(),
        &LAMBERT_HALF,
        position_m,
        normal,
        camera_position_m,
    );
    for band in radiance {
        // Measured 2.2e-16.
        assert!((band - 0.5).abs() < 5e-16);
    }
}

#[test]
fn instant_radiosity_in_the_unit_sphere_is_one_quarter_for_any_number_of_vpls() {
    for size in [1, 2, 3, 8, 33, 128] {
        let vpls = sphere_vpls(size);
        let radiance =
            indirect_radiance(VplSum::InstantRadiosity, &vpls, &sphere_receiver(), |_| {
                true
            });
        for band in radiance {
            // cosθ_P·cosθ_Q/d² is 1/4 for every pair of points, so only rounding is left: measured 1.1e-16.
            assert!((band - 0.25).abs() < 3e-16, "size {size}: {band}");
        }
    }
}

#[test]
fn rsm_average_in_the_unit_sphere_converges_to_one_over_six_pi() {
    let relative_error = |size| {
        let radiance = indirect_radiance(
            VplSum::RsmAverage,
            &sphere_vpls(size),
            &sphere_receiver(),
            |_| true,
        );
        (radiance[0] * 6.0 * PI - 1.0).abs()
    };
    // Second order, as for any midpoint rule: measured relative_error·size² is between 0.7e-3 and 2.3e-3 for all of these
    // (5.9e-5 at size 4, 1.8e-8 at 256).
    for size in [4, 8, 16, 32, 64, 128, 256] {
        let bound = 4e-3 / f64::from(size * size);
        assert!(
            relative_error(size) < bound,
            "size {size}: {:e}",
            relative_error(size)
        );
    }
}

// --- Lights -------------------------------------------------------------------------------------------------------

#[test]
fn irradiance_falls_with_the_square_of_the_distance() {
    let lights = [sphere_light(), spot(20.0, 50.0)];
    for light in lights {
        let at = |distance_m: f64| {
            irradiance_facing(&light, DVec3::new(1.0, -2.0, 0.8).normalize() * distance_m)[1]
        };
        for distance_m in [1e-3, 0.7, 3.0, 1e5] {
            let ratio = at(distance_m) * distance_m * distance_m / at(1.0);
            // Measured 4.5e-16.
            assert!((ratio - 1.0).abs() < 1.2e-15, "{distance_m} m: {ratio}");
        }
    }
}

#[test]
fn a_spot_light_emits_its_power() {
    let cones = [
        (0.0, 0.001),
        (0.0005, 0.001),
        (0.001, 0.001),
        (0.1, 0.25),
        (0.0, 30.0),
        (20.0, 30.0),
        (30.0, 30.0),
        // The removable singularity of the closed form: θ_o − θ_i = 90°.
        (0.0, 90.0),
        (10.0, 100.0),
        (10.0, 100.000001),
        (0.0, 179.9),
        (179.8, 179.9),
        (0.0, 180.0),
        (90.0, 180.0),
        (180.0, 180.0),
    ];
    for (inner_deg, outer_deg) in cones {
        let light = spot(inner_deg, outer_deg);
        let axis = light.direction().expect("it has one").normalize();
        let side = axis.any_orthonormal_vector();
        let ring_intensity = |theta: f64| {
            let direction = axis * theta.cos() + side * theta.sin();
            radiant_intensity(&light, direction).unwrap()[0] * theta.sin() * TAU
        };
        // Split at the kink and ended at the rim, where the intensity may jump.
        let (inner, outer) = (f64::to_radians(inner_deg), f64::to_radians(outer_deg));
        let power = midpoint(0.0, inner, 10_000, ring_intensity)
            + midpoint(inner, outer, 10_000, ring_intensity);
        // Measured 4.7e-9, the error of the quadrature here: of order (1.6/10 000)²/6.
        let relative = power / 3.0 - 1.0;
        assert!(
            relative.abs() < 1e-8,
            "{inner_deg} {outer_deg}: {relative:e}"
        );
    }
}

#[test]
fn a_spot_light_is_as_bright_as_a_point_light_of_its_power_over_its_solid_angle() {
    let hemisphere = radiant_intensity(&spot(90.0, 90.0), DVec3::new(1.0, -2.0, 0.5)).unwrap();
    let sphere = radiant_intensity(&spot(180.0, 180.0), DVec3::X).unwrap();
    assert!((hemisphere[0] - 3.0 / TAU).abs() < 1e-15);
    assert!((sphere[0] - 3.0 / (2.0 * TAU)).abs() < 1e-15);
}

#[test]
fn degenerate_light_geometry_gives_zero_and_not_nan() {
    for light in [sphere_light(), spot(10.0, 20.0)] {
        assert_eq!(irradiance_facing(&light, DVec3::ZERO), [0.0; 3]);
        let radiance = direct_radiance(&light, &LAMBERT_HALF, DVec3::ZERO, DVec3::Y, DVec3::Z);
        assert_eq!(radiance, [0.0; 3]);
    }
}

#[test]
fn a_directional_light_is_the_same_everywhere() {
    let light = Light::directional(DVec3::new(0.0, -3.0, 4.0), [10.0, 20.0, 30.0]);
    let radiance = direct_radiance(
        &light,
        &LAMBERT_HALF,
        DVec3::new(1e5, 7.0, -3.0),
        DVec3::Y,
        DVec3::ZERO,
    );
    // E_L·cosθ·k_d/π with cosθ = 3/5.
    for (band, irradiance) in radiance.into_iter().zip([10.0, 20.0, 30.0]) {
        assert!((band / (irradiance * 0.3 / PI) - 1.0).abs() < 1e-15);
    }
    assert_eq!(radiant_intensity(&light, DVec3::Y), None);
}

#[test]
fn two_lights_of_half_power_are_one_light() {
    let halved = |light: &Light| light.with_emission(light.emission().map(|power| 0.5 * power));
    let directional = Light::directional(DVec3::new(1.0, -1.0, 0.0), [3.0, 2.0, 1.0]);
    for light in [sphere_light(), spot(30.0, 70.0), directional] {
        let p_m = DVec3::new(0.7, -1.1, 0.4);
        let radiance = |light: &Light| {
            direct_radiance(
                light,
                &LAMBERT_HALF,
                p_m,
                DVec3::Y,
                DVec3::new(0.0, 1.0, 2.0),
            )
        };
        let (whole, half) = (radiance(&light), radiance(&halved(&light)));
        assert!(whole[0] > 0.0);
        // Halving is exact in binary.
        assert_eq!(half.map(|half| half + half), whole);

        let [whole, half] =
            [&light, &halved(&light)].map(|light| EmissionDomain::new(light, 8, &UNIT_SPHERE));
        for (whole_texel, half_texel) in whole.texels.iter().zip(&half.texels) {
            let doubled = half.incident_power_w(half_texel).map(|power| 2.0 * power);
            assert_eq!(doubled, whole.incident_power_w(whole_texel));
        }
    }
}

// --- Virtual point lights -----------------------------------------------------------------------------------------

#[test]
fn a_vpl_adds_what_the_formulas_say() {
    // Q at (0, 0, 2) looks down on P at the origin from an angle; every factor differs from 1.
    let q_normal = DVec3::new(0.6, 0.0, -0.8);
    let vpl = Vpl {
        position_m: DVec3::new(0.0, 0.0, 2.0),
        normal: q_normal,
        to_light: DVec3::X,
        from_light_m: 1.0,
        area_m2: 0.01,
        brdf: Brdf {
            kd: [0.5, 0.25, 0.125],
            lobe: NO_LOBE,
        },
        irradiance_facing_w_m2: [7.0; 3],
        incident_power_w: [0.3; 3],
        domain_share: 0.01,
    };
    let receiver = Receiver {
        position_m: DVec3::ZERO,
        normal: DVec3::new(0.0, 0.8, 0.6),
        to_camera: DVec3::Y,
        brdf: Brdf {
            kd: [0.2, 0.4, 0.8],
            lobe: NO_LOBE,
        },
    };
    let reflectances = 0.1 / (PI * PI);
    let average = 0.01 * reflectances * 7.0 * 0.6 * 0.6;
    let instant = reflectances * 0.3 * 0.6 * 0.8 / 4.0;
    for (estimator, expected) in [
        (VplSum::RsmAverage, average),
        (VplSum::InstantRadiosity, instant),
    ] {
        for band in vpl_contribution(estimator, &vpl, &receiver) {
            assert!(
                (band / expected - 1.0).abs() < 1e-15,
                "{estimator:?}: {band}"
            );
        }
    }
}

#[test]
fn a_vpl_adds_nothing_below_a_horizon_or_at_its_own_place() {
    let receiver = sphere_receiver();
    let vpl = sphere_vpls(1)[0];
    // Lit from the other side, so that only the horizon can make it 0.
    let below_q = Vpl {
        normal: -vpl.normal,
        to_light: -vpl.to_light,
        ..vpl
    };
    let at_p = Vpl {
        position_m: receiver.position_m,
        ..vpl
    };
    let below_p = Receiver {
        normal: -receiver.normal,
        ..receiver
    };
    for estimator in VplSum::ALL {
        assert!(vpl_contribution(estimator, &vpl, &receiver)[0] > 0.0);
        assert_eq!(vpl_contribution(estimator, &below_q, &receiver), [0.0; 3]);
        assert_eq!(vpl_contribution(estimator, &at_p, &receiver), [0.0; 3]);
        assert_eq!(vpl_contribution(estimator, &vpl, &below_p), [0.0; 3]);
    }
}

#[test]
fn only_instant_radiosity_asks_for_visibility() {
    let (vpls, receiver) = (sphere_vpls(4), sphere_receiver());
    let sum = |estimator, seen| indirect_radiance(estimator, &vpls, &receiver, |_| seen)[0];
    assert_eq!(sum(VplSum::InstantRadiosity, false), 0.0);
    assert_eq!(
        sum(VplSum::RsmAverage, false),
        sum(VplSum::RsmAverage, true)
    );
}
