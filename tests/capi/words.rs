//! Errors name what the caller wrote: members and constants of camlux.h, not keys of scene files or names in Rust.

use std::ptr::null_mut;

use crate::host::*;
use camlux::capi::*;

/// What only scene files and Rust have.
const FOREIGN: [&str; 17] = [
    "[tof",
    "[sensor]",
    "[indirect]",
    "[camera]",
    "[direct]",
    "\"rays\"",
    "\"dn\"",
    "\"final-gather\"",
    "modulated =",
    "map_d",
    "phases is",
    "position is",
    "look_at is",
    "look_at are",
    "resolution is",
    "frequencies_mhz",
    "leave it out",
];

#[track_caller]
fn says(status: camlux_status, words: &str) {
    fails(status, CAMLUX_ERROR_SCENE, words);
    let message = last_error();
    for foreign in FOREIGN {
        assert!(!message.contains(foreign), "{foreign:?} in {message:?}");
    }
}

/// A scene with a time-of-flight camera, which `change` makes wrong.
#[track_caller]
fn tof_says(change: impl FnOnce(&mut camlux_tof), words: &str) {
    let scene = new_scene();
    let sensor = init!(camlux_sensor {
        pixel_pitch_um: [10.0; 2],
        exposure_time_s: 1e-3,
        wavelength_nm: 850.0,
        quantum_efficiency: 0.5
    });
    let mut tof = init!(camlux_tof { frequency_count: 1 });
    tof.frequencies_hz[0] = 20e6;
    change(&mut tof);
    // SAFETY: structs of their size; no index requested.
    let status = unsafe {
        ok(camlux_scene_set_sensor(scene, &sensor));
        ok(camlux_scene_add_light(
            scene,
            &init!(camlux_light {}),
            null_mut(),
        ));
        match camlux_scene_set_tof(scene, &tof) {
            CAMLUX_OK => camlux_scene_validate(scene),
            refused => refused,
        }
    };
    says(status, words);
    ok(camlux_scene_release(scene));
}

#[test]
fn errors_of_time_of_flight_are_in_the_words_of_c() {
    tof_says(
        |tof| tof.frequencies_hz[0] = 20.0,
        "frequency 0 is 20 Hz; give 1 kHz to 1 THz",
    );
    tof_says(|tof| tof.phase_count = 9, "phase_count is 9");
    tof_says(
        |tof| tof.band_weights = [0.0; 3],
        "band_weights is [0.0, 0.0, 0.0]",
    );
    tof_says(
        |tof| tof.output = CAMLUX_CHARGE_DN,
        "output is CAMLUX_CHARGE_DN, and there is no gain; set noise of camlux_tof",
    );
    let scene = new_scene();
    let sun = init!(camlux_light {
        kind: CAMLUX_LIGHT_DIRECTIONAL,
        direction: [0.0, -1.0, 0.0]
    });
    let sensor = init!(camlux_sensor {
        pixel_pitch_um: [10.0; 2],
        exposure_time_s: 1e-3
    });
    let mut tof = init!(camlux_tof { frequency_count: 1 });
    tof.frequencies_hz[0] = 20e6;
    // SAFETY: structs of their size; no index requested.
    unsafe {
        ok(camlux_scene_add_light(scene, &sun, null_mut()));
        ok(camlux_scene_set_sensor(scene, &sensor));
        ok(camlux_scene_set_tof(scene, &tof));
        says(
            camlux_scene_validate(scene),
            "set wavelength_nm and quantum_efficiency of camlux_sensor",
        );
        let sensor = init!(camlux_sensor {
            pixel_pitch_um: [10.0; 2],
            exposure_time_s: 1e-3,
            wavelength_nm: 850.0,
            quantum_efficiency: 0.5
        });
        ok(camlux_scene_set_sensor(scene, &sensor));
    }
    says(
        camlux_scene_validate(scene),
        "list it in ambient_lights of camlux_tof",
    );
    ok(camlux_scene_release(scene));
}

#[test]
fn errors_of_parts_are_in_the_words_of_c() {
    let scene = new_scene();
    let nan = f64::NAN;
    // SAFETY: structs of their size; no index requested.
    unsafe {
        let camera = |camera: camlux_camera| camlux_scene_set_camera(scene, &camera);
        says(
            camera(init!(camlux_camera { width_px: 0 })),
            "width_px x height_px is 0 x 480",
        );
        says(
            camera(init!(camlux_camera {
                position_m: [nan; 3]
            })),
            "position_m is",
        );
        says(
            camera(init!(camlux_camera {
                look_at_m: [nan; 3]
            })),
            "look_at_m is",
        );
        says(
            camera(init!(camlux_camera {
                look_at_m: [0.0; 3]
            })),
            "position_m and look_at_m are both",
        );
        let lens = CAMLUX_LENS_INTRINSICS;
        says(
            camera(init!(camlux_camera {
                lens: lens,
                fx_px: -1.0
            })),
            "fx_px is -1",
        );
        says(
            camera(init!(camlux_camera {
                lens: lens,
                fx_px: 1.0,
                fy_px: 1.0,
                cx_px: nan
            })),
            "cx_px, cy_px are NaN, 0",
        );
        let indirect = |indirect: camlux_indirect| camlux_scene_set_indirect(scene, &indirect);
        says(
            indirect(init!(camlux_indirect { max_ms: -1.0 })),
            "such as 500, or 0 for no limit",
        );
        let light = |light: camlux_light| camlux_scene_add_light(scene, &light, null_mut());
        says(
            light(init!(camlux_light {
                position_m: [nan; 3]
            })),
            "position_m is",
        );
        let mut area = init!(camlux_light {
            kind: CAMLUX_LIGHT_AREA,
            direction: [0.0, -1.0, 0.0],
            up: [1.0, 0.0, 0.0]
        });
        says(
            light(area),
            "size_m and radius_m are 0; give size_m of a rectangle, or radius_m of a disc",
        );
        area.size_m = [0.5, 0.0];
        says(light(area), "size_m is 0");
        area.radius_m = 0.1;
        says(
            light(area),
            "size_m is [0.5, 0.0], and radius_m is 0.1; an area light is a rectangle or a disc",
        );
        area.size_m = [0.0; 2];
        area.radius_m = -1.0;
        says(light(area), "radius_m is -1");
        area.radius_m = 1.0;
        ok(light(area));
        let direct = init!(camlux_direct {
            shadow: CAMLUX_SHADOW_MAP
        });
        ok(camlux_scene_set_direct(scene, &direct));
        says(
            camlux_scene_validate(scene),
            "set shadow to CAMLUX_SHADOW_RAYS",
        );
        ok(camlux_scene_set_direct(scene, std::ptr::null()));
        plain_sum(scene, 8);
        says(
            camlux_scene_validate(scene),
            "set estimator to CAMLUX_ESTIMATOR_FINAL_GATHER",
        );
    }
    ok(camlux_scene_release(scene));
}

/// A layer that a scene does not have, as a target.
#[test]
fn errors_of_layers_are_in_the_words_of_c() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load("cornell_spot");
    resize(scene, 4, 4);
    // SAFETY: NULL is allowed.
    unsafe {
        ok(camlux_scene_set_indirect(scene, std::ptr::null()));
        ok(camlux_scene_set_sensor(scene, std::ptr::null()));
    }
    for (layer, words) in [
        (CAMLUX_LAYER_ENERGY, "call camlux_scene_set_sensor"),
        (CAMLUX_LAYER_INDIRECT, "call camlux_scene_set_indirect"),
        (CAMLUX_LAYER_STDERR, "set stderr_layer of camlux_indirect"),
        (CAMLUX_LAYER_DEPTH_MEAN, "set samples of camlux_camera"),
        (CAMLUX_LAYER_TOF_RANGE, "call camlux_scene_set_tof"),
    ] {
        let mut memory = vec![0_u8; 4 * 4 * 4 * 4];
        let target = init!(camlux_target {
            layer: layer,
            data: memory.as_mut_ptr().cast(),
            size_bytes: memory.len()
        });
        let options = init!(camlux_render_options {
            targets: &raw const target,
            target_count: 1
        });
        let mut frame = null_mut();
        // SAFETY: structs of their size, and a pointer to a pointer.
        let status = unsafe { camlux_renderer_render(renderer, scene, &options, &mut frame) };
        fails(status, CAMLUX_ERROR_SCENE, words);
    }
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

/// A file keeps the words of its format.
#[test]
fn errors_of_a_file_are_in_its_words() {
    let folder = std::env::temp_dir().join(format!("camlux-words-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("it is created");
    let path = folder.join("scene.toml");
    let text = "[camera]\nresolution = [0, 4]\nposition = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov_y_deg = 40\n\
                [[light]]\nkind = \"point\"\nposition = [0, 0, 0]\npower_w = 1\n";
    std::fs::write(&path, text).expect("it is written");
    let c_path = std::ffi::CString::new(path.to_str().expect("UTF-8")).expect("no NUL");
    let mut scene = null_mut();
    // SAFETY: a string, and a pointer to a pointer.
    let status = unsafe { camlux_scene_load_file(c_path.as_ptr(), &mut scene) };
    fails(status, CAMLUX_ERROR_SCENE, "resolution is 0 x 4");
    std::fs::remove_dir_all(&folder).expect("it is removed");
}
