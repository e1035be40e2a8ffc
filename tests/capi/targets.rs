//! Layers that are written to the host's memory.

use std::ptr::{null, null_mut};

use crate::host::*;
use camlux::capi::*;

const SIZE_PX: [u32; 2] = [20, 12];
const PIXELS: usize = (SIZE_PX[0] * SIZE_PX[1]) as usize;

fn scene() -> Scene {
    let scene = load_at("cornell", SIZE_PX);
    scene.plain_sum(8);
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

#[test]
fn layers_go_to_the_hosts_memory_and_others_stay_away() {
    let device = Device::open();
    let (renderer, scene) = (device.renderer(), scene());
    let whole = renderer.render(&scene);
    let expected = [
        CAMLUX_LAYER_RADIANCE,
        CAMLUX_LAYER_INSTANCE_ID,
        CAMLUX_LAYER_DEPTH,
    ]
    .map(|layer| whole.words(layer));
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
        let frame = renderer.try_render(&scene, &options).expect("it renders");
        for (got, expected) in radiance.chunks(stride).zip(expected[0].chunks(row)) {
            assert_eq!(&got[..row], expected);
            assert_eq!(got[row..], [7; 5]);
        }
        assert_eq!([&ids, &depth], [&expected[1], &expected[2]]);
        assert!(frame.layers().is_empty(), "they are in the host's memory");
        let mut seen = init!(camlux_view {});
        // SAFETY: it points to a struct of that size.
        let viewed = unsafe { camlux_frame_view(frame.raw(), CAMLUX_LAYER_DEPTH, &mut seen) };
        fails(viewed, ARGUMENT, "were written to the targets");
        let stats = frame.stats();
        assert_eq!(stats.pass_count == 0, comes_back);
        assert!(stats.wall_ms > 0.0);
    }
}

#[test]
fn a_frame_has_the_layers_that_are_named() {
    let device = Device::open();
    let (renderer, scene) = (device.renderer(), scene());
    let named = |layers: &[i32]| {
        init!(camlux_render_options {
            layers: layers.as_ptr(),
            layer_count: layers.len()
        })
    };
    let layers = [CAMLUX_LAYER_ALBEDO, CAMLUX_LAYER_DEPTH];
    let frame = renderer.try_render(&scene, &named(&layers));
    let frame = frame.expect("it renders");
    let whole = renderer.render(&scene);
    let depth = whole.words(CAMLUX_LAYER_DEPTH);
    let found: Vec<i32> = frame.layers().iter().map(|(layer, _)| *layer).collect();
    assert_eq!(found, layers);
    assert_eq!(frame.words(CAMLUX_LAYER_DEPTH), depth);
    // Layers on request do not come by themselves, and targets ask for them, too.
    let mut seen = init!(camlux_view {});
    // SAFETY: it points to a struct of that size.
    let viewed = unsafe { camlux_frame_view(whole.raw(), CAMLUX_LAYER_ALBEDO, &mut seen) };
    let words = "no layer albedo; name it in layers of camlux_render_options";
    fails(viewed, ARGUMENT, words);
    let mut albedo = vec![7; 3 * PIXELS];
    let targets = [target(CAMLUX_LAYER_ALBEDO, &mut albedo, 0)];
    let to_targets = renderer.try_render(&scene, &to(&targets));
    to_targets.expect("it renders");
    assert_eq!(frame.words(CAMLUX_LAYER_ALBEDO), albedo);
    assert!(albedo.iter().any(|&bits| f32::from_bits(bits) > 0.1));
    for camera in renderer
        .render_cameras(&scene, &[scene.camera(), scene.camera()], &named(&layers))
        .expect("they render")
    {
        assert_eq!(camera.words(CAMLUX_LAYER_ALBEDO), albedo);
    }

    let (mut staying, mut nowhere) = (named(&layers), named(&layers));
    let both = camlux_render_options {
        targets: targets.as_ptr(),
        target_count: 1,
        ..named(&layers)
    };
    (staying.on_device, nowhere.layers) = (1, null());
    for (options, status, words) in [
        (staying, ARGUMENT, "set only one of them"),
        (both, ARGUMENT, "set only one of them"),
        (nowhere, ARGUMENT, "layers is NULL, but layer_count is 2"),
        (named(&[5000]), ARGUMENT, "layer is 5000"),
        (named(&[CAMLUX_LAYER_STDERR]), SCENE, "no layer stderr"),
    ] {
        let rendered = renderer.try_render(&scene, &options);
        fails(rendered.unwrap_err(), status, words);
    }
}

#[test]
fn a_job_fills_targets_until_it_is_done() {
    let device = Device::open();
    let (renderer, scene) = (device.renderer(), scene());
    let whole = renderer.render(&scene);
    let mut direct = vec![0; 3 * PIXELS];
    let targets = [target(CAMLUX_LAYER_DIRECT, &mut direct, 0)];
    let job = renderer.try_submit(&scene, &to(&targets));
    let job = job.expect("it begins");
    // SAFETY: it points to a pointer.
    let _frame = Owned::<camlux_frame>::new(|frame| unsafe { camlux_job_wait(job.raw(), frame) });
    assert_eq!(direct, whole.words(CAMLUX_LAYER_DIRECT));
}

#[test]
fn targets_that_cannot_be_filled_are_refused() {
    let device = Device::open();
    let (renderer, scene) = (device.renderer(), scene());
    let mut room = vec![7; 3 * PIXELS];
    let good = target(CAMLUX_LAYER_DIRECT, &mut room, 0);
    let refuses = |change: fn(&mut camlux_target), status, words| {
        let mut bad = good;
        change(&mut bad);
        let rendered = renderer.try_render(&scene, &to(&[good, bad]));
        fails(rendered.unwrap_err(), status, words);
    };
    refuses(|t| t.data = null_mut(), ARGUMENT, "is NULL");
    refuses(|t| t.size_bytes -= 1, ARGUMENT, "do not fit in");
    refuses(
        |t| t.row_stride_bytes = 8,
        ARGUMENT,
        "row_stride_bytes is 8",
    );
    refuses(|t| t.layer = 5000, ARGUMENT, "layer is 5000");
    refuses(|t| t.struct_size = 4, ARGUMENT, "struct_size");
    refuses(|t| t.layer = CAMLUX_LAYER_STDERR, SCENE, "no layer stderr");
    let targets = [good];
    let (mut staying, mut nowhere) = (to(&targets), to(&targets));
    (staying.on_device, nowhere.targets) = (1, null());
    for (options, words) in [(staying, "on_device"), (nowhere, "camlux_target is NULL")] {
        let rendered = renderer.try_render(&scene, &options);
        fails(rendered.unwrap_err(), ARGUMENT, words);
    }
    let cameras = [scene.camera()];
    let rendered = renderer.render_cameras(&scene, &cameras, &to(&targets));
    fails(rendered.unwrap_err(), ARGUMENT, "render camera by camera");
    assert_eq!(room, [7; 3 * PIXELS]);
}
