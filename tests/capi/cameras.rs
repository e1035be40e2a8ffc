//! Several cameras in one call: each frame equals that of its camera alone, and shared passes run once.

use std::{
    ffi::{c_char, c_void},
    ptr::{null, null_mut},
};

use crate::host::*;
use camlux::capi::*;

fn cameras_of(scene: *mut camlux_scene) -> [camlux_camera; 3] {
    let mut camera = init!(camlux_camera {});
    // SAFETY: a struct of that size.
    ok(unsafe { camlux_scene_get_camera(scene, &mut camera) });
    let mut others = [camera; 3];
    others[1].position_m[0] += 0.2;
    others[2].position_m[2] -= 0.3;
    (others[2].width_px, others[2].height_px) = (12, 20);
    others
}

fn render_cameras(
    renderer: *mut camlux_renderer,
    scene: *mut camlux_scene,
    cameras: &[camlux_camera],
    options: *const camlux_render_options,
) -> (camlux_status, Vec<*mut camlux_frame>) {
    let mut frames = vec![null_mut(); cameras.len()];
    let (first, stride_bytes) = (cameras.as_ptr(), size_of::<camlux_camera>());
    // SAFETY: `cameras` and `frames` have that length.
    let status = unsafe {
        camlux_renderer_render_cameras(
            renderer,
            scene,
            first,
            cameras.len(),
            stride_bytes,
            options,
            frames.as_mut_ptr(),
        )
    };
    (status, frames)
}

unsafe extern "C" fn note(fraction: f64, _: *const c_char, user: *mut c_void) -> i32 {
    // SAFETY: the test's own value, which only this callback uses during the render.
    unsafe { &mut *user.cast::<Vec<f64>>() }.push(fraction);
    0
}

#[test]
fn each_sees_what_it_would_see_alone() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, 16, 16);
    plain_sum(scene, 8);
    let cameras = cameras_of(scene);
    let renderer = device.renderer();
    let mut fractions: Vec<f64> = Vec::new();
    let options = init!(camlux_render_options {
        progress: Some(note),
        progress_user: (&raw mut fractions).cast(),
    });
    let (status, frames) = render_cameras(renderer, scene, &cameras, &options);
    ok(status);
    assert!(fractions.is_sorted() && fractions.last() == Some(&1.0));
    assert!(fractions.iter().any(|&fraction| fraction > 2.0 / 3.0));
    // Only the first frame renders the RSM.
    let sees_light = |frame| passes(frame).iter().any(|pass| pass == "rsm");
    assert_eq!(
        frames
            .iter()
            .map(|&frame| sees_light(frame))
            .collect::<Vec<_>>(),
        [true, false, false]
    );
    for (camera, frame) in cameras.iter().zip(frames) {
        // SAFETY: a struct of that size.
        ok(unsafe { camlux_scene_set_camera(scene, camera) });
        let alone = device.renderer();
        let expected = render(alone, scene);
        assert!(layers(frame) == layers(expected));
        for frame in [frame, expected] {
            ok(camlux_frame_release(frame));
        }
        ok(camlux_renderer_release(alone));
    }
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

#[test]
fn where_one_fails_there_is_none() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, 16, 16);
    plain_sum(scene, 8);
    let renderer = device.renderer();
    let mut cameras = cameras_of(scene);
    cameras[1].width_px = 0;
    let (status, frames) = render_cameras(renderer, scene, &cameras, null());
    fails(status, CAMLUX_ERROR_SCENE, "camera 1");
    assert!(frames.iter().all(|frame| frame.is_null()));
    // A valid camera, but too large for any device.
    (cameras[1].width_px, cameras[1].height_px) = (1 << 20, 1 << 20);
    let (status, frames) = render_cameras(renderer, scene, &cameras, null());
    fails(status, CAMLUX_ERROR_DEVICE_LIMIT, "camera 1");
    assert!(frames.iter().all(|frame| frame.is_null()));
    let mut frame = null_mut();
    // SAFETY: a struct of that size, and a pointer to a pointer.
    let status = unsafe {
        camlux_renderer_render_cameras(renderer, scene, &cameras[0], 1, 0, null(), &mut frame)
    };
    fails(status, CAMLUX_ERROR_INVALID_ARGUMENT, "stride_bytes is 0");
    let (status, none) = render_cameras(renderer, scene, &[], null());
    ok(status);
    assert!(none.is_empty());
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}
