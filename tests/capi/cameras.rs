//! Several cameras in one call: each frame equals that of its camera alone, and shared passes run once.

use std::{
    ffi::{c_char, c_void},
    ptr::{null, null_mut},
};

use crate::host::*;
use camlux::capi::*;

fn cameras_of(scene: &Scene) -> [camlux_camera; 3] {
    let camera = scene.camera();
    let mut others = [camera; 3];
    others[1].position_m[0] += 0.2;
    others[2].position_m[2] -= 0.3;
    (others[2].width_px, others[2].height_px) = (12, 20);
    others
}

unsafe extern "C" fn note(fraction: f64, _: *const c_char, user: *mut c_void) -> i32 {
    // SAFETY: the test's own value, which only this callback uses during the render.
    unsafe { &mut *user.cast::<Vec<f64>>() }.push(fraction);
    0
}

#[test]
fn each_sees_what_it_would_see_alone() {
    let device = Device::open();
    let scene = fast_scene(16);
    let cameras = cameras_of(&scene);
    let renderer = device.renderer();
    let mut fractions: Vec<f64> = Vec::new();
    let options = init!(camlux_render_options {
        progress: Some(note),
        progress_user: (&raw mut fractions).cast(),
    });
    let frames = renderer.render_cameras(&scene, &cameras, &options);
    let frames = frames.expect("they render");
    assert!(fractions.is_sorted() && fractions.last() == Some(&1.0));
    assert!(fractions.iter().any(|&fraction| fraction > 2.0 / 3.0));
    // Only the first frame renders the RSM.
    for (index, frame) in frames.iter().enumerate() {
        let sees_light = frame.passes().iter().any(|pass| pass == "rsm");
        assert_eq!(sees_light, index == 0);
    }
    for (camera, frame) in cameras.iter().zip(frames) {
        ok(scene.set_camera(camera));
        let alone = device.renderer();
        let expected = alone.render(&scene);
        assert!(frame.layers() == expected.layers());
    }
}

#[test]
fn where_one_fails_there_is_none() {
    let device = Device::open();
    let scene = fast_scene(16);
    let renderer = device.renderer();
    let mut cameras = cameras_of(&scene);
    cameras[1].width_px = 0;
    let render = |cameras: &[_]| renderer.render_cameras(&scene, cameras, &Default::default());
    fails(
        render(&cameras).unwrap_err(),
        CAMLUX_ERROR_SCENE,
        "camera 1",
    );
    // A valid camera, but too large for any device.
    (cameras[1].width_px, cameras[1].height_px) = (1 << 20, 1 << 20);
    fails(
        render(&cameras).unwrap_err(),
        CAMLUX_ERROR_DEVICE_LIMIT,
        "camera 1",
    );
    let mut frame = null_mut();
    // SAFETY: a struct of that size, and a pointer to a pointer.
    let status = unsafe {
        camlux_renderer_render_cameras(
            renderer.raw(),
            scene.raw(),
            &cameras[0],
            1,
            0,
            null(),
            &mut frame,
        )
    };
    fails(status, CAMLUX_ERROR_INVALID_ARGUMENT, "stride_bytes is 0");
    assert!(render(&[]).expect("nothing fails").is_empty());
}
