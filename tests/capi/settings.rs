//! Settings of a scene that a host reads back, such as those of a scene file.

use std::ptr::{null, null_mut};

use crate::host::*;
use camlux::capi::*;

fn noisy_tof(ambient_lights: &[u32], noise: &camlux_tof_noise) -> camlux_tof {
    let mut tof = init!(camlux_tof {
        frequency_count: 2,
        noise: noise,
        output: CAMLUX_CHARGE_DN,
        phase_offset_deg: 3.0,
        ambient_lights: ambient_lights.as_ptr(),
        ambient_light_count: ambient_lights.len()
    });
    tof.frequencies_hz[..2].copy_from_slice(&[20e6, 100e6]);
    tof.contrasts[1] = 0.75;
    tof
}

#[test]
fn settings_of_a_file_can_be_read_and_set_again() {
    let scene = load("tof_corner");
    let (mut sensor, mut indirect) = (init!(camlux_sensor {}), init!(camlux_indirect {}));
    let (mut tof, mut noise) = (init!(camlux_tof {}), init!(camlux_tof_noise {}));
    let mut is_set = [0; 3];
    let (handle, [of_sensor, of_indirect, of_tof]) = (scene.raw(), &mut is_set);
    // SAFETY: structs of their size, and pointers to numbers.
    for got in unsafe {
        [
            camlux_scene_get_sensor(handle, &mut sensor, of_sensor),
            camlux_scene_get_indirect(handle, &mut indirect, of_indirect),
            camlux_scene_get_tof(handle, &mut tof, &mut noise, null_mut(), 0, of_tof),
        ]
    } {
        ok(got);
    }
    assert_eq!(is_set, [1; 3]);
    assert!(sensor.wavelength_nm > 0.0 && tof.frequency_count > 0);
    ok(scene.set_sensor(&sensor));
    ok(scene.set_indirect(&indirect));
    ok(scene.set_tof(&tof));
    ok(scene.validate());
}

#[test]
fn settings_come_back() {
    let scene = new_scene();
    let noise = init!(camlux_tof_noise {
        full_well_e: 1e4,
        read_noise_e: 2.0,
        seed: 9
    });
    let tof = noisy_tof(&[0, 2], &noise);
    let (mut got, mut got_noise) = (init!(camlux_tof {}), init!(camlux_tof_noise {}));
    let (mut ambient, mut is_set) = ([7_u32; 3], 5);
    let at = ambient.as_mut_ptr();
    // SAFETY: structs of their size, a list as long as its capacity, and a pointer to a number.
    let mut get = |capacity| unsafe {
        let noise = &mut got_noise;
        camlux_scene_get_tof(scene.raw(), &mut got, noise, at, capacity, &mut is_set)
    };
    ok(get(3));
    ok(scene.set_tof(&tof));
    fails(get(1), ARGUMENT, "capacity is 1, but 2 lights are ambient");
    ok(get(3));
    assert_eq!((is_set, ambient), (1, [0, 2, 7]));
    assert_eq!(
        (got.ambient_lights, got.ambient_light_count),
        (at.cast_const(), 2)
    );
    assert_eq!(got.noise, &raw const got_noise);
    assert_eq!(
        (got.frequencies_hz, got.contrasts),
        (tof.frequencies_hz, tof.contrasts)
    );
    assert_eq!((got.output, got.phase_offset_deg), (CAMLUX_CHARGE_DN, 3.0));
    assert_eq!((got_noise.full_well_e, got_noise.seed), (1e4, 9));
    // It has the form of the setter.
    ok(scene.set_tof(&got));

    scene.unset_tof();
    let noise = &mut got_noise;
    // SAFETY: as above.
    ok(unsafe { camlux_scene_get_tof(scene.raw(), &mut got, noise, at, 3, &mut is_set) });
    assert_eq!(is_set, 0);
    let (mut direct, mut sensor) = (init!(camlux_direct {}), init!(camlux_sensor {}));
    // SAFETY: a struct of that size, and a pointer to a number.
    ok(unsafe { camlux_scene_get_sensor(scene.raw(), &mut sensor, &mut is_set) });
    assert_eq!((is_set, sensor.duty_cycle), (0, 1.0));
    // SAFETY: as above; NULL is refused.
    let nowhere = unsafe { camlux_scene_get_sensor(scene.raw(), &mut sensor, null_mut()) };
    fails(nowhere, ARGUMENT, "is_set is NULL");
    let mut noise = init!(camlux_tof_noise {
        full_well_e: 1e4,
        prnu: 0.01,
        seed: 5
    });
    // SAFETY: a struct of its size, for all calls below.
    let set_noise = |noise| unsafe { camlux_scene_set_sensor_noise(scene.raw(), noise) };
    fails(
        set_noise(&noise),
        ARGUMENT,
        "call camlux_scene_set_sensor first",
    );
    ok(set_noise(null()));
    let mut sensor = init!(camlux_sensor {
        pixel_pitch_um: [3.0; 2],
        exposure_time_s: 1e-3,
        bayer: CAMLUX_BAYER_GRBG,
        f_number: 2.0,
        vignetting: [-0.25, 0.0, 0.125],
        has_vignetting: 1
    });
    fails(
        scene.set_sensor(&sensor),
        SCENE,
        "quantum efficiency is not known",
    );
    (sensor.wavelength_nm, sensor.quantum_efficiency) = (550.0, 0.6);
    ok(scene.set_sensor(&sensor));
    ok(set_noise(&noise));
    // The noise stays when the sensor changes.
    sensor.exposure_time_s = 2e-3;
    ok(scene.set_sensor(&sensor));
    let mut got = init!(camlux_sensor {});
    (noise.prnu, noise.seed) = (0.0, 0);
    // SAFETY: structs of their size, and pointers to a number.
    unsafe {
        ok(camlux_scene_get_sensor(scene.raw(), &mut got, &mut is_set));
        ok(camlux_scene_get_sensor_noise(
            scene.raw(),
            &mut noise,
            &mut is_set,
        ));
    }
    assert_eq!((is_set, noise.prnu, noise.seed), (1, 0.01, 5));
    assert_eq!((got.bayer, got.exposure_time_s), (CAMLUX_BAYER_GRBG, 2e-3));
    assert_eq!(
        (got.vignetting, got.has_vignetting),
        ([-0.25, 0.0, 0.125], 1)
    );
    // Zeros are a lens without vignetting, which is not cos⁴.
    for has_vignetting in [1, 0] {
        let even = camlux_sensor {
            vignetting: [0.0; 3],
            has_vignetting,
            ..sensor
        };
        ok(scene.set_sensor(&even));
        // SAFETY: a struct of its size, and a pointer to a number.
        ok(unsafe { camlux_scene_get_sensor(scene.raw(), &mut got, &mut is_set) });
        assert_eq!(got.has_vignetting, has_vignetting);
    }
    sensor.wavelength_nm = 0.0;
    fails(
        scene.set_sensor(&sensor),
        SCENE,
        "only one of wavelength_nm",
    );
    ok(set_noise(null()));
    // SAFETY: as above.
    ok(unsafe { camlux_scene_get_sensor_noise(scene.raw(), &mut noise, &mut is_set) });
    assert_eq!(is_set, 0);
    ok(scene.set_direct(&with(|d| d.shadow = CAMLUX_SHADOW_RAYS)));
    // SAFETY: a struct of that size.
    ok(unsafe { camlux_scene_get_direct(scene.raw(), &mut direct) });
    assert_eq!(direct.shadow, CAMLUX_SHADOW_RAYS);
    for estimator in [
        CAMLUX_ESTIMATOR_FINAL_GATHER,
        CAMLUX_ESTIMATOR_RSM_AVERAGE,
        CAMLUX_ESTIMATOR_INSTANT_RADIOSITY,
    ] {
        let of_gather = estimator == CAMLUX_ESTIMATOR_FINAL_GATHER;
        let set = init!(camlux_indirect {
            estimator: estimator,
            rsm_size: 16,
            error_norm: if of_gather { CAMLUX_NORM_LOCAL } else { 0 },
            max_rays: if of_gather { 1 << 20 } else { 0 },
            target_range_error_mm: if of_gather { 2.5 } else { 0.0 }
        });
        ok(scene.set_indirect(&set));
        let mut got = init!(camlux_indirect {});
        // SAFETY: a struct of that size, and a pointer to a number.
        ok(unsafe { camlux_scene_get_indirect(scene.raw(), &mut got, &mut is_set) });
        assert_eq!((is_set, got.estimator, got.rsm_size), (1, estimator, 16));
        assert_eq!(
            (got.error_norm, got.max_rays, got.target_range_error_mm),
            (set.error_norm, set.max_rays, set.target_range_error_mm)
        );
    }
    let light = CAMLUX_PART_LIGHT;
    let visible = || {
        let mut is_visible = -1;
        // SAFETY: a pointer to a number.
        let status = unsafe { camlux_scene_get_visible(scene.raw(), light, 0, &mut is_visible) };
        (status, is_visible)
    };
    fails(visible().0, ARGUMENT, "no light 0");
    scene.add_light(&Default::default()).expect("it is added");
    for is_visible in [0, 1] {
        ok(camlux_scene_set_visible(scene.raw(), light, 0, is_visible));
        assert_eq!(visible(), (CAMLUX_OK, is_visible));
    }
}
