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
    fails(status, SCENE, words);
    let message = last_error();
    for foreign in FOREIGN {
        assert!(!message.contains(foreign), "{foreign:?} in {message:?}");
    }
}

fn sensor() -> camlux_sensor {
    init!(camlux_sensor {
        pixel_pitch_um: [10.0; 2],
        exposure_time_s: 1e-3,
        wavelength_nm: 850.0,
        quantum_efficiency: 0.5
    })
}

fn tof() -> camlux_tof {
    let mut tof = init!(camlux_tof { frequency_count: 1 });
    tof.frequencies_hz[0] = 20e6;
    tof
}

/// A scene with a time-of-flight camera, which `change` makes wrong.
#[track_caller]
fn tof_says(change: impl FnOnce(&mut camlux_tof), words: &str) {
    let scene = new_scene();
    ok(scene.set_sensor(&sensor()));
    scene.add_light(&Default::default()).expect("it is added");
    let mut tof = tof();
    change(&mut tof);
    let status = match scene.set_tof(&tof) {
        CAMLUX_OK => scene.validate(),
        refused => refused,
    };
    says(status, words);
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
    let plain = init!(camlux_sensor {
        pixel_pitch_um: [10.0; 2],
        exposure_time_s: 1e-3
    });
    scene.add_light(&sun).expect("it is added");
    ok(scene.set_sensor(&plain));
    ok(scene.set_tof(&tof()));
    let words = "set wavelength_nm and quantum_efficiency of camlux_sensor";
    says(scene.validate(), words);
    ok(scene.set_sensor(&sensor()));
    says(scene.validate(), "list it in ambient_lights of camlux_tof");
}

#[test]
fn errors_of_parts_are_in_the_words_of_c() {
    const NAN: f64 = f64::NAN;
    let scene = new_scene();
    let camera = |change| scene.set_camera(&with(change));
    says(
        camera(|c| c.width_px = 0),
        "width_px x height_px is 0 x 480",
    );
    says(camera(|c| c.position_m = [NAN; 3]), "position_m is");
    says(camera(|c| c.look_at_m = [NAN; 3]), "look_at_m is");
    let words = "position_m and look_at_m are both";
    says(camera(|c| c.look_at_m = [0.0; 3]), words);
    let lens = CAMLUX_LENS_INTRINSICS;
    let mut intrinsics = init!(camlux_camera {
        lens: lens,
        fx_px: -1.0
    });
    says(scene.set_camera(&intrinsics), "fx_px is -1");
    (intrinsics.fx_px, intrinsics.fy_px, intrinsics.cx_px) = (1.0, 1.0, NAN);
    says(scene.set_camera(&intrinsics), "cx_px, cy_px are NaN, 0");
    let indirect = scene.set_indirect(&with(|i| i.max_ms = -1.0));
    says(indirect, "such as 500, or 0 for no limit");
    let refused = |light: camlux_light| scene.add_light(&light).unwrap_err();
    says(refused(with(|l| l.position_m = [NAN; 3])), "position_m is");
    let mut area = init!(camlux_light {
        kind: CAMLUX_LIGHT_AREA,
        direction: [0.0, -1.0, 0.0],
        up: [1.0, 0.0, 0.0]
    });
    for (size_m, radius_m, words) in [
        (
            [0.0; 2],
            0.0,
            "size_m and radius_m are 0; give size_m of a rectangle, or radius_m of a disc",
        ),
        ([0.5, 0.0], 0.0, "size_m is 0"),
        (
            [0.5, 0.0],
            0.1,
            "size_m is [0.5, 0.0], and radius_m is 0.1; an area light is a rectangle or a disc",
        ),
        ([0.0; 2], -1.0, "radius_m is -1"),
    ] {
        (area.size_m, area.radius_m) = (size_m, radius_m);
        says(refused(area), words);
    }
    area.radius_m = 1.0;
    scene.add_light(&area).expect("it is added");
    ok(scene.set_direct(&with(|d| d.shadow = CAMLUX_SHADOW_MAP)));
    says(scene.validate(), "set shadow to CAMLUX_SHADOW_RAYS");
    scene.unset_direct();
    scene.plain_sum(8);
    let words = "set estimator to CAMLUX_ESTIMATOR_FINAL_GATHER";
    says(scene.validate(), words);
}

/// A layer that a scene does not have, as a target.
#[test]
fn errors_of_layers_are_in_the_words_of_c() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load_at("cornell_spot", [4, 4]);
    scene.unset_indirect();
    scene.unset_sensor();
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
        let rendered = renderer.try_render(&scene, &options);
        fails(rendered.unwrap_err(), SCENE, words);
    }
}

/// A file keeps the words of its format.
#[test]
fn errors_of_a_file_are_in_its_words() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    let text = "[camera]\nresolution = [0, 4]\nposition = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov_y_deg = 40\n\
                [[light]]\nkind = \"point\"\nposition = [0, 0, 0]\npower_w = 1\n";
    std::fs::write(&path, text).expect("it is written");
    let path = c_path(&path);
    let mut scene = null_mut();
    // SAFETY: a string, and a pointer to a pointer.
    let status = unsafe { camlux_scene_load_file(path.as_ptr(), &mut scene) };
    fails(status, SCENE, "resolution is 0 x 4");
}
