//! A prepared renderer: its first frame compiles and copies nothing, and is the same.

use std::ptr::null_mut;

use crate::host::*;
use camlux::capi::*;

fn prepare(renderer: *mut camlux_renderer, scene: *mut camlux_scene) -> f64 {
    let mut milliseconds = -1.0;
    // SAFETY: a pointer to a number.
    ok(unsafe { camlux_renderer_prepare(renderer, scene, &mut milliseconds) });
    milliseconds
}

#[test]
fn a_prepared_frame_compiles_nothing() {
    let device = Device::open();
    for name in [
        "cornell",
        "glossy",
        "area",
        "tof_corner",
        "textured",
        "lens",
        "samples",
        "sum",
    ] {
        let scene = load(if name == "sum" { "cornell" } else { name });
        resize(scene, 96, 96);
        if name == "lens" {
            scale_lens(scene, 96.0 / 800.0);
        }
        if name == "sum" {
            plain_sum(scene, 16);
        } else {
            let indirect = init!(camlux_indirect { target_error: 0.1 });
            // SAFETY: a struct of that size.
            ok(unsafe { camlux_scene_set_indirect(scene, &indirect) });
        }
        let (cold, prepared) = (device.renderer(), device.renderer());
        let expected = render(cold, scene);
        let milliseconds = prepare(prepared, scene);
        let frame = render(prepared, scene);
        let [cold_ms, left_ms] = [expected, frame].map(|frame| stats(frame).preparation_ms);
        println!(
            "{name}: {cold_ms:.1} ms cold, {milliseconds:.1} ms prepared, {left_ms:.3} ms left"
        );
        assert_eq!(left_ms, 0.0, "{name}");
        assert_eq!(stats(frame).frame_index, 0, "preparing is no frame");
        assert!(milliseconds > 0.0 && cold_ms > 0.0 && cold_ms < stats(expected).wall_ms);
        assert!(layers(frame) == layers(expected), "{name}");
        for frame in [expected, frame] {
            ok(camlux_frame_release(frame));
        }
        for renderer in [cold, prepared] {
            ok(camlux_renderer_release(renderer));
        }
        ok(camlux_scene_release(scene));
    }
}

fn scale_lens(scene: *mut camlux_scene, factor: f64) {
    let mut camera = init!(camlux_camera {});
    // SAFETY: structs of that size.
    unsafe {
        ok(camlux_scene_get_camera(scene, &mut camera));
        for length_px in [
            &mut camera.fx_px,
            &mut camera.fy_px,
            &mut camera.cx_px,
            &mut camera.cy_px,
        ] {
            *length_px *= factor;
        }
        ok(camlux_scene_set_camera(scene, &camera));
    }
}

/// Preparing between frames changes none of them, nor the forecast.
#[test]
fn preparing_changes_no_frame() {
    let device = Device::open();
    let (renderer, scene) = (device.renderer(), load("cornell"));
    resize(scene, 16, 16);
    let first = render(renderer, scene);
    assert!(stats(first).preparation_ms > 0.0);
    let foretold = || {
        let mut milliseconds = -1.0;
        // SAFETY: a pointer to a number.
        ok(unsafe { camlux_renderer_foretell_ms(renderer, scene, &mut milliseconds) });
        milliseconds
    };
    let before = foretold();
    // SAFETY: the time is not requested.
    ok(unsafe { camlux_renderer_prepare(renderer, scene, null_mut()) });
    assert_eq!(foretold(), before);
    let second = render(renderer, scene);
    assert!(layers(first) == layers(second));
    let without_sensor = new_scene();
    let mut tof = init!(camlux_tof { frequency_count: 1 });
    tof.frequencies_hz[0] = 2e7;
    // SAFETY: a struct of that size; the time is not requested.
    let status = unsafe {
        ok(camlux_scene_set_tof(without_sensor, &tof));
        camlux_renderer_prepare(renderer, without_sensor, null_mut())
    };
    fails(status, CAMLUX_ERROR_SCENE, "camlux_sensor");
    for frame in [first, second] {
        ok(camlux_frame_release(frame));
    }
    ok(camlux_renderer_release(renderer));
    for scene in [scene, without_sensor] {
        ok(camlux_scene_release(scene));
    }
}
