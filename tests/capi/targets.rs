//! Layers that are written to the host's memory.

use std::ptr::{null, null_mut};

use crate::host::{Device, fails, init, load, ok, plain_sum, resize, view};
use camlux::capi::*;

const SIZE_PX: [u32; 2] = [20, 12];
const PIXELS: usize = (SIZE_PX[0] * SIZE_PX[1]) as usize;

fn scene() -> *mut camlux_scene {
    let scene = load("cornell");
    resize(scene, SIZE_PX[0], SIZE_PX[1]);
    plain_sum(scene, 8);
    scene
}

fn target(layer: i32, values: &mut [u32], row_stride_bytes: usize) -> camlux_target {
    init!(camlux_target {
        layer: layer,
        data: values.as_mut_ptr().cast(),
        size_bytes: size_of_val(values),
        row_stride_bytes: row_stride_bytes
    })
}

fn to(targets: &[camlux_target]) -> camlux_render_options {
    init!(camlux_render_options {
        targets: targets.as_ptr(),
        target_count: targets.len()
    })
}

fn render(
    renderer: *mut camlux_renderer,
    scene: *mut camlux_scene,
    options: &camlux_render_options,
) -> (camlux_status, *mut camlux_frame) {
    let mut frame = null_mut();
    // SAFETY: all pointers are valid.
    let status = unsafe { camlux_renderer_render(renderer, scene, options, &mut frame) };
    (status, frame)
}

fn words(frame: *mut camlux_frame, layer: i32) -> Vec<u32> {
    let view = view(frame, layer);
    // SAFETY: the view has `size_bytes` bytes.
    unsafe { std::slice::from_raw_parts(view.data.cast(), view.size_bytes / 4) }.to_vec()
}

#[test]
fn layers_go_to_the_hosts_memory_and_others_stay_away() {
    let device = Device::open();
    let (renderer, scene) = (device.renderer(), scene());
    let whole = crate::host::render(renderer, scene);
    let expected = [
        CAMLUX_LAYER_RADIANCE,
        CAMLUX_LAYER_INSTANCE_ID,
        CAMLUX_LAYER_DEPTH,
    ]
    .map(|layer| words(whole, layer));
    // Each row has five values of padding.
    let row = 3 * SIZE_PX[0] as usize;
    let stride = row + 5;
    // Sums do not depend on the seed. With the last frame's, that frame comes back.
    for (seed, comes_back) in [(0, true), (1, false), (1, true)] {
        let mut radiance = vec![7; stride * SIZE_PX[1] as usize];
        let mut ids = vec![7; PIXELS];
        let mut depth = vec![7; PIXELS];
        let targets = [
            target(CAMLUX_LAYER_RADIANCE, &mut radiance, 4 * stride),
            target(CAMLUX_LAYER_INSTANCE_ID, &mut ids, 0),
            target(CAMLUX_LAYER_DEPTH, &mut depth, 0),
        ];
        let options = camlux_render_options {
            seed,
            ..to(&targets)
        };
        let (status, frame) = render(renderer, scene, &options);
        ok(status);
        for (got, expected) in radiance.chunks(stride).zip(expected[0].chunks(row)) {
            assert_eq!(&got[..row], expected);
            assert_eq!(got[row..], [7; 5]);
        }
        assert_eq!([&ids, &depth], [&expected[1], &expected[2]]);
        let mut stats = init!(camlux_frame_stats {});
        let mut seen = init!(camlux_view {});
        // SAFETY: both point to structs of their size.
        unsafe {
            ok(camlux_frame_get_stats(frame, &mut stats));
            let mut count = 1;
            ok(camlux_frame_layer_count(frame, &mut count));
            assert_eq!(count, 0, "they are in the host's memory");
            let status = camlux_frame_view(frame, CAMLUX_LAYER_DEPTH, &mut seen);
            fails(
                status,
                CAMLUX_ERROR_INVALID_ARGUMENT,
                "were written to the targets",
            );
        }
        assert_eq!(stats.pass_count == 0, comes_back);
        assert!(stats.wall_ms > 0.0);
        ok(camlux_frame_release(frame));
    }
    ok(camlux_frame_release(whole));
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}

#[test]
fn a_job_fills_targets_until_it_is_done() {
    let device = Device::open();
    let (renderer, scene) = (device.renderer(), scene());
    let whole = crate::host::render(renderer, scene);
    let mut direct = vec![0; 3 * PIXELS];
    let targets = [target(CAMLUX_LAYER_DIRECT, &mut direct, 0)];
    let (mut job, mut frame) = (null_mut(), null_mut());
    // SAFETY: all pointers are valid, and the memory lives until the job is done.
    unsafe {
        ok(camlux_renderer_submit(
            renderer,
            scene,
            &to(&targets),
            &mut job,
        ));
        ok(camlux_job_wait(job, &mut frame));
    }
    assert_eq!(direct, words(whole, CAMLUX_LAYER_DIRECT));
    for frame in [frame, whole] {
        ok(camlux_frame_release(frame));
    }
    ok(camlux_job_release(job));
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}

#[test]
fn targets_that_cannot_be_filled_are_refused() {
    let device = Device::open();
    let (renderer, scene) = (device.renderer(), scene());
    let mut room = vec![7; 3 * PIXELS];
    let good = target(CAMLUX_LAYER_DIRECT, &mut room, 0);
    let changed = |change: fn(&mut camlux_target)| {
        let mut changed = good;
        change(&mut changed);
        changed
    };
    for (bad, status, words) in [
        (
            changed(|t| t.data = null_mut()),
            CAMLUX_ERROR_INVALID_ARGUMENT,
            "is NULL",
        ),
        (
            changed(|t| t.size_bytes -= 1),
            CAMLUX_ERROR_INVALID_ARGUMENT,
            "do not fit in",
        ),
        (
            changed(|t| t.row_stride_bytes = 8),
            CAMLUX_ERROR_INVALID_ARGUMENT,
            "row_stride_bytes is 8",
        ),
        (
            changed(|t| t.layer = 5000),
            CAMLUX_ERROR_INVALID_ARGUMENT,
            "layer is 5000",
        ),
        (
            changed(|t| t.struct_size = 4),
            CAMLUX_ERROR_INVALID_ARGUMENT,
            "struct_size",
        ),
        (
            changed(|t| t.layer = CAMLUX_LAYER_STDERR),
            CAMLUX_ERROR_SCENE,
            "no layer stderr",
        ),
    ] {
        let (found, _) = render(renderer, scene, &to(&[good, bad]));
        fails(found, status, words);
    }
    let targets = [good];
    let (status, _) = render(
        renderer,
        scene,
        &camlux_render_options {
            on_device: 1,
            ..to(&targets)
        },
    );
    fails(status, CAMLUX_ERROR_INVALID_ARGUMENT, "on_device");
    let nowhere = camlux_render_options {
        targets: null(),
        ..to(&targets)
    };
    let (status, _) = render(renderer, scene, &nowhere);
    fails(
        status,
        CAMLUX_ERROR_INVALID_ARGUMENT,
        "camlux_target is NULL",
    );
    let mut camera = init!(camlux_camera {});
    let mut frame = null_mut();
    // SAFETY: all pointers are valid.
    let status = unsafe {
        ok(camlux_scene_get_camera(scene, &mut camera));
        let stride = size_of::<camlux_camera>();
        camlux_renderer_render_cameras(
            renderer,
            scene,
            &camera,
            1,
            stride,
            &to(&targets),
            &mut frame,
        )
    };
    fails(
        status,
        CAMLUX_ERROR_INVALID_ARGUMENT,
        "render camera by camera",
    );
    assert_eq!(room, [7; 3 * PIXELS]);
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}
