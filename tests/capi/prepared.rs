//! A prepared renderer: its first frame compiles and copies nothing, and is the same.

use std::ptr::null_mut;

use crate::host::*;
use camlux::capi::*;

fn prepare(renderer: &Renderer, scene: &Scene) -> f64 {
    let mut milliseconds = -1.0;
    // SAFETY: a pointer to a number.
    ok(unsafe { camlux_renderer_prepare(renderer.raw(), scene.raw(), &mut milliseconds) });
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
        let scene = load_at(if name == "sum" { "cornell" } else { name }, [48; 2]);
        if name == "lens" {
            scale_lens(&scene, 48.0 / 800.0);
        }
        if name == "sum" {
            scene.plain_sum(16);
        } else {
            let indirect = init!(camlux_indirect { target_error: 0.1 });
            ok(scene.set_indirect(&indirect));
        }
        let (cold, prepared) = (device.renderer(), device.renderer());
        let expected = cold.render(&scene);
        let milliseconds = prepare(&prepared, &scene);
        let frame = prepared.render(&scene);
        let [cold_ms, left_ms] = [&expected, &frame].map(|frame| frame.stats().preparation_ms);
        println!(
            "{name}: {cold_ms:.1} ms cold, {milliseconds:.1} ms prepared, {left_ms:.3} ms left"
        );
        assert_eq!(left_ms, 0.0, "{name}");
        assert_eq!(frame.stats().frame_index, 0, "preparing is no frame");
        assert!(milliseconds > 0.0 && cold_ms > 0.0 && cold_ms < expected.stats().wall_ms);
        assert!(frame.layers() == expected.layers(), "{name}");
    }
}

fn scale_lens(scene: &Scene, factor: f64) {
    let mut camera = scene.camera();
    for length_px in [
        &mut camera.fx_px,
        &mut camera.fy_px,
        &mut camera.cx_px,
        &mut camera.cy_px,
    ] {
        *length_px *= factor;
    }
    ok(scene.set_camera(&camera));
}

/// Preparing between frames changes none of them, nor the forecast.
#[test]
fn preparing_changes_no_frame() {
    let device = Device::open();
    let (renderer, scene) = (device.renderer(), load_at("cornell", [16; 2]));
    let first = renderer.render(&scene);
    assert!(first.stats().preparation_ms > 0.0);
    let foretold = || {
        let mut milliseconds = -1.0;
        // SAFETY: a pointer to a number.
        ok(unsafe { camlux_renderer_foretell_ms(renderer.raw(), scene.raw(), &mut milliseconds) });
        milliseconds
    };
    let before = foretold();
    // SAFETY: the time is not requested.
    ok(unsafe { camlux_renderer_prepare(renderer.raw(), scene.raw(), null_mut()) });
    assert_eq!(foretold(), before);
    let second = renderer.render(&scene);
    assert!(first.layers() == second.layers());
    let without_sensor = new_scene();
    let mut tof = init!(camlux_tof { frequency_count: 1 });
    tof.frequencies_hz[0] = 2e7;
    ok(without_sensor.set_tof(&tof));
    // SAFETY: the time is not requested.
    let status =
        unsafe { camlux_renderer_prepare(renderer.raw(), without_sensor.raw(), null_mut()) };
    fails(status, SCENE, "camlux_sensor");
}
