//! Frames through the C interface: they equal the engine's bit for bit, also after parts move; progress reports and cancelling.

use std::{
    f64::consts::FRAC_PI_2,
    ffi::{CStr, c_char, c_void},
    ptr::{null, null_mut},
    sync::mpsc::{Receiver, Sender, channel},
};

use crate::host::*;
use camlux::{
    RenderOptions, Renderer, Scene,
    capi::*,
    glam::{DQuat, DVec3},
    scene::{
        AreaShape, Distortion, Encoding, IndirectLight, Lens, Light, Mesh, PixelFilter,
        PixelSampling, Texels, VplSum,
    },
};

const SIZE_PX: [u32; 2] = [24, 20];

/// The layers of a frame that is rendered without the C interface.
fn engine_frame(scene: &Scene) -> Vec<(i32, Vec<u32>)> {
    let device = camlux::Device::open(&Default::default()).expect("a device");
    let mut renderer = Renderer::new(&device).expect("a renderer");
    let frame = renderer.render(scene, &mut RenderOptions::default());
    layers_of(&frame.expect("the scene renders"))
}

fn engine_scene(name: &str) -> Scene {
    let path = scene_file(name);
    let path = std::path::Path::new(path.to_str().expect("a UTF-8 path"));
    let mut scene = Scene::load(path).expect("a demo scene loads");
    scene.camera.resolution_px = SIZE_PX;
    scene
}

#[test]
fn a_scene_from_arrays_is_that_of_the_file() {
    let device = Device::open();
    for name in ["cornell", "textured"] {
        let expected = engine_scene(name);
        let loaded = load(name);
        resize(loaded, SIZE_PX[0], SIZE_PX[1]);
        let built = from_arrays(&expected);
        let renderer = device.renderer();
        let [of_file, of_arrays] = [loaded, built].map(|scene| render(renderer, scene));
        assert!(layers(of_file) == layers(of_arrays), "{name}");
        assert!(layers(of_file) == engine_frame(&expected), "{name}");
        ok(camlux_renderer_release(renderer));
        for frame in [of_file, of_arrays] {
            ok(camlux_frame_release(frame));
        }
        for scene in [loaded, built] {
            ok(camlux_scene_release(scene));
        }
    }
}

#[test]
fn a_measured_lamp_comes_with_its_scene() {
    let device = Device::open();
    let renderer = device.renderer();
    let mut expected = engine_scene("lamp");
    let scene = load("lamp");
    resize(scene, SIZE_PX[0], SIZE_PX[1]);
    let mut light = init!(camlux_light {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_light(scene, 0, &mut light) });
    assert_eq!(light.kind, CAMLUX_LIGHT_PATTERN);
    let before = render(renderer, scene);
    assert!(layers(before) == engine_frame(&expected));
    // The lamp now shines upwards.
    let (position_m, turn) = (
        DVec3::new(0.1, 0.5, 0.0),
        DQuat::from_rotation_x(-FRAC_PI_2),
    );
    let pose = init!(camlux_pose {
        position_m: position_m.to_array(),
        orientation_xyzw: turn.to_array(),
    });
    // SAFETY: as above.
    ok(unsafe { camlux_scene_set_pose(scene, CAMLUX_PART_LIGHT, 0, &pose) });
    let light = &mut expected.lights[0];
    *light.position_m_mut().expect("it has one") = position_m;
    *light.direction_mut().expect("it has one") = turn * DVec3::Z;
    *light.up_mut().expect("it has one") = turn * DVec3::NEG_Y;
    let after = render(renderer, scene);
    assert!(layers(after) == engine_frame(&expected));
    assert!(layers(after) != layers(before));
    for frame in [before, after] {
        ok(camlux_frame_release(frame));
    }
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}

#[test]
fn a_lens_and_maps_of_normals_and_alpha_from_c_are_those_of_the_engine() {
    let device = Device::open();
    let renderer = device.renderer();
    let rational = [-0.2, 0.05, 0.002, -0.001, 0.01, 0.02, 0.003, 0.004];
    let mut images = Vec::new();
    for distortion in [
        Distortion::Rational(rational),
        Distortion::Fisheye([0.05, -0.01, 0.002, 0.001]),
    ] {
        let mut expected = engine_scene("textured");
        for texture in &mut expected.textures {
            let Texels::U8(_, encoding) = &mut texture.texels else {
                panic!("the scene has textures of 8 bits");
            };
            *encoding = Encoding::Linear;
        }
        for material in &mut expected.materials {
            material.normal_texture = Some(0.into());
            material.alpha_texture = Some(0.into());
        }
        expected.camera.lens = Lens::Distorted {
            intrinsics: expected.camera.intrinsics_px(),
            distortion,
        };
        let is_fisheye = matches!(distortion, Distortion::Fisheye(_));
        let sensor = expected.sensor.as_mut().expect("the scene has one");
        sensor.f_number = (!is_fisheye).then_some(2.0);
        let (samples, filter) = (3, PixelFilter::Gaussian);
        expected.camera.pixel_sampling = is_fisheye.then_some(PixelSampling { samples, filter });
        let built = from_arrays(&expected);
        let frame = render(renderer, built);
        assert!(layers(frame) == engine_frame(&expected), "{distortion:?}");
        images.push(layers(frame));
        let mut camera = init!(camlux_camera {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_get_camera(built, &mut camera) });
        let sampling = (camera.samples, camera.filter);
        let due = if is_fisheye {
            (3, CAMLUX_FILTER_GAUSSIAN)
        } else {
            (1, CAMLUX_FILTER_BOX)
        };
        assert_eq!(sampling, due);
        let coefficients = distortion.coefficients();
        assert_eq!(camera.distortion[..coefficients.len()], *coefficients);
        ok(camlux_frame_release(frame));
        ok(camlux_scene_release(built));
    }
    assert!(images[0] != images[1]);
    ok(camlux_renderer_release(renderer));
}

#[test]
fn a_frame_foretells_those_that_are_like_it() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load("cornell");
    resize(scene, SIZE_PX[0], SIZE_PX[1]);
    let foretold = || {
        let mut milliseconds = -1.0;
        // SAFETY: it points to a number.
        ok(unsafe { camlux_renderer_foretell_ms(renderer, scene, &mut milliseconds) });
        milliseconds
    };
    assert_eq!(foretold(), 0.0);
    ok(camlux_frame_release(render(renderer, scene)));
    let alike = foretold();
    resize(scene, 2 * SIZE_PX[0], 2 * SIZE_PX[1]);
    assert!(foretold() > alike && alike > 0.0);
    let indirect = init!(camlux_indirect {
        estimator: CAMLUX_ESTIMATOR_FINAL_GATHER,
        target_error: 0.1,
    });
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_set_indirect(scene, &indirect) });
    assert_eq!(foretold(), 0.0);
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}

/// An error that a frame does not estimate is NaN, so that the result of a VPL sum is never read as exact.
#[test]
fn each_estimator_estimates_its_own_error() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load("cornell");
    resize(scene, SIZE_PX[0], SIZE_PX[1]);
    let mut estimated = |indirect: camlux_indirect| {
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_set_indirect(scene, &indirect) });
        let frame = render(renderer, scene);
        let stats = stats(frame);
        ok(camlux_frame_release(frame));
        let errors = [stats.estimated_error, stats.estimated_interpolation_error];
        (errors.map(f64::is_nan), stats.stop)
    };
    let average = init!(camlux_indirect {
        estimator: CAMLUX_ESTIMATOR_RSM_AVERAGE,
        rsm_size: 8
    });
    let radiosity = init!(camlux_indirect {
        estimator: CAMLUX_ESTIMATOR_INSTANT_RADIOSITY,
        rsm_size: 8
    });
    let nothing = ([true; 2], CAMLUX_STOP_NONE);
    assert_eq!([average, radiosity].map(&mut estimated), [nothing; 2]);
    let interpolated = camlux_indirect {
        interpolation_error: 0.1,
        ..average
    };
    let of_the_sum = ([true, false], CAMLUX_STOP_NONE);
    assert_eq!(estimated(interpolated), of_the_sum);
    let gathered = init!(camlux_indirect { target_error: 0.1 });
    let of_the_bounce = ([false, true], CAMLUX_STOP_TARGET_MET);
    assert_eq!(estimated(gathered), of_the_bounce);
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}

/// Holds on the host, and for a frame that stays on the device. The next frame that does not request the layer has none.
#[test]
fn a_frame_has_standard_errors_where_they_are_asked_for() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load("cornell");
    resize(scene, SIZE_PX[0], SIZE_PX[1]);
    let options = init!(camlux_render_options { on_device: 1 });
    for stderr_layer in [1, 0] {
        let indirect = init!(camlux_indirect {
            target_error: 0.3,
            stderr_layer: stderr_layer
        });
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_set_indirect(scene, &indirect) });
        let frame = render(renderer, scene);
        let found = layers(frame);
        let errors = found
            .iter()
            .find(|(layer, _)| *layer == CAMLUX_LAYER_STDERR);
        assert_eq!(errors.is_some(), stderr_layer == 1);
        let mut view = init!(camlux_view {});
        let mut staying = null_mut();
        let mut image = init!(camlux_vulkan_image {});
        // SAFETY: all pointers are valid.
        let viewed = unsafe {
            ok(camlux_renderer_render(
                renderer,
                scene,
                &options,
                &mut staying,
            ));
            [
                camlux_frame_view(frame, CAMLUX_LAYER_STDERR, &mut view),
                camlux_frame_get_vulkan_image(staying, CAMLUX_LAYER_STDERR, &mut image),
            ]
        };
        if let Some((_, values)) = errors {
            assert_eq!(viewed, [CAMLUX_OK; 2]);
            assert_eq!((view.channels, values.len()), (3, view.size_bytes / 4));
            let values = values.iter().map(|&bits| f32::from_bits(bits));
            assert!(values.into_iter().all(|value| value >= 0.0));
        } else {
            assert_eq!(viewed, [CAMLUX_ERROR_INVALID_ARGUMENT; 2]);
        }
        for frame in [frame, staying] {
            ok(camlux_frame_release(frame));
        }
    }
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}

fn set_pose(scene: *mut camlux_scene, part: i32, index: u32, position_m: DVec3, turn: DQuat) {
    let pose = init!(camlux_pose {
        position_m: position_m.to_array(),
        orientation_xyzw: turn.to_array(),
    });
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_set_pose(scene, part, index, &pose) });
}

#[test]
fn a_moved_camera_is_a_scene_built_that_way_and_draws_no_maps() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, SIZE_PX[0], SIZE_PX[1]);
    let renderer = device.renderer();
    let first = render(renderer, scene);
    assert!(passes(first).iter().any(|pass| pass == "rsm"));
    // Half a turn about x: the optical frame's +z points along -z, and its +y (down) along -y.
    let position_m = DVec3::new(0.1, 1.1, 3.0);
    set_pose(
        scene,
        CAMLUX_PART_CAMERA,
        0,
        position_m,
        DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
    );
    let second = render(renderer, scene);
    for pass in passes(second) {
        assert!(pass != "rsm" && pass != "vpl", "{pass}");
    }
    let mut expected = engine_scene("cornell");
    expected.camera.position_m = position_m;
    expected.camera.look_at_m = position_m - DVec3::Z;
    expected.camera.up = DVec3::Y;
    assert!(layers(second) == engine_frame(&expected));
    assert!(layers(second) != layers(first));
    ok(camlux_renderer_release(renderer));
    for frame in [first, second] {
        ok(camlux_frame_release(frame));
    }
    ok(camlux_scene_release(scene));
}

#[test]
fn a_moved_light_is_a_scene_built_that_way() {
    let device = Device::open();
    let scene = load("cornell_spot");
    resize(scene, SIZE_PX[0], SIZE_PX[1]);
    let renderer = device.renderer();
    let first = render(renderer, scene);
    // A quarter turn about x takes +z to -y.
    let turn = DQuat::from_xyzw(0.5_f64.sqrt(), 0.0, 0.0, 0.5_f64.sqrt());
    let moved_m = DVec3::new(0.2, 1.5, -0.1);
    set_pose(scene, CAMLUX_PART_LIGHT, 0, moved_m, turn);
    let second = render(renderer, scene);
    assert!(passes(second).iter().any(|pass| pass == "light_rays"));
    let mut expected = engine_scene("cornell_spot");
    let lamp = expected.lights[0].lamp_mut().expect("it is a spot light");
    lamp.position_m = moved_m;
    // The quaternion is rounded, so the expected axis is the one that the interface returns.
    let mut light = init!(camlux_light {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_light(scene, 0, &mut light) });
    lamp.direction = DVec3::from(light.direction);
    assert!(lamp.direction.distance(DVec3::NEG_Y) < 1e-15, "{lamp:?}");
    assert!(layers(second) == engine_frame(&expected));
    assert!(layers(second) != layers(first));
    ok(camlux_renderer_release(renderer));
    for frame in [first, second] {
        ok(camlux_frame_release(frame));
    }
    ok(camlux_scene_release(scene));
}

#[test]
fn a_moved_instance_is_a_scene_built_that_way() {
    let device = Device::open();
    let mut expected = engine_scene("glossy");
    expected.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 8));
    let scene = from_arrays(&expected);
    let renderer = device.renderer();
    let first = render(renderer, scene);
    assert!(passes(first).iter().any(|pass| pass == "rsm"));
    // Half a turn about y: x and z change their signs, exactly.
    let by_m = DVec3::new(0.25, 0.5, -0.125);
    let last = expected.meshes.len() - 1;
    set_pose(
        scene,
        CAMLUX_PART_INSTANCE,
        last as u32,
        by_m,
        DQuat::from_xyzw(0.0, 1.0, 0.0, 0.0),
    );
    let second = render(renderer, scene);
    let turned = |v: &DVec3| DVec3::new(-v.x, v.y, -v.z);
    let mesh = Mesh::clone(&expected.meshes[last]);
    expected.meshes[last] = Mesh {
        positions_m: mesh.positions_m.iter().map(|p| turned(p) + by_m).collect(),
        normals: mesh.normals.iter().map(turned).collect(),
        ..mesh
    }
    .into();
    assert!(layers(second) == engine_frame(&expected));
    assert!(layers(second) != layers(first));
    // With the instance moved back, the frame equals the first.
    set_pose(
        scene,
        CAMLUX_PART_INSTANCE,
        last as u32,
        DVec3::ZERO,
        DQuat::IDENTITY,
    );
    let third = render(renderer, scene);
    assert!(layers(third) == layers(first));
    // Nothing has moved since, so the RSM is used again.
    let fourth = render(renderer, scene);
    assert!(passes(fourth).iter().all(|pass| pass != "rsm"));
    ok(camlux_renderer_release(renderer));
    for frame in [first, second, third, fourth] {
        ok(camlux_frame_release(frame));
    }
    ok(camlux_scene_release(scene));
}

#[test]
fn a_view_is_what_a_copy_and_the_files_have() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, SIZE_PX[0], SIZE_PX[1]);
    let renderer = device.renderer();
    let frame = render(renderer, scene);
    // The frame outlives its renderer and its scene.
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
    let of_view = &layers(frame)[0].1;
    let row = SIZE_PX[0] as usize * 3;
    let stride = row + 5;
    let mut copied = vec![7.0_f32; stride * SIZE_PX[1] as usize];
    let bytes = size_of_val(copied.as_slice());
    // SAFETY: the memory has `bytes` bytes.
    ok(unsafe {
        camlux_frame_copy(
            frame,
            CAMLUX_LAYER_RADIANCE,
            copied.as_mut_ptr().cast(),
            bytes,
            stride * 4,
        )
    });
    for (line, of_view) in copied.chunks(stride).zip(of_view.chunks(row)) {
        assert!(
            line[..row]
                .iter()
                .map(|v| v.to_bits())
                .eq(of_view.iter().copied())
        );
        assert_eq!(line[row..], [7.0; 5]);
    }
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["all.exr", "one.exr", "plain.exr", "look.png"] {
        let path = folder.path().join(name);
        let path = std::ffi::CString::new(path.to_str().expect("UTF-8")).expect("no NUL");
        let one = init!(camlux_exr_options {
            layers: &CAMLUX_LAYER_DEPTH,
            layer_count: 1
        });
        let plain = camlux_exr_options { plain: 1, ..one };
        // SAFETY: a string, and no options or a struct of that size.
        ok(unsafe {
            match name {
                "plain.exr" => camlux_frame_write_exr(frame, path.as_ptr(), &plain),
                "all.exr" => camlux_frame_write_exr(frame, path.as_ptr(), null()),
                "one.exr" => camlux_frame_write_exr(frame, path.as_ptr(), &one),
                _ => camlux_frame_write_png(frame, path.as_ptr()),
            }
        });
    }
    let read = |name: &str| camlux::output::LayeredImage::read(folder.path().join(name));
    let all = read("all.exr").expect("an image");
    let values = all.layer("radiance").expect("the layer").values.iter();
    assert!(
        values
            .map(|value| value.to_bits())
            .eq(of_view.iter().copied())
    );
    let [one, plain] = ["one.exr", "plain.depth.exr"].map(|name| read(name).expect("an image"));
    assert_eq!(one.layers().len(), 1);
    assert_eq!(one.layers(), plain.layers());
    let png = std::fs::read(folder.path().join("look.png")).expect("a file");
    assert!(png.starts_with(b"\x89PNG"));
    // SAFETY: strings of the library.
    let text = |text: *const c_char| unsafe { CStr::from_ptr(text) }.to_owned();
    let depth = view(frame, CAMLUX_LAYER_DEPTH);
    assert_eq!(
        (text(depth.name), text(depth.unit)),
        (c"depth".into(), c"m".into())
    );
    assert_eq!((depth.channels, depth.format), (1, CAMLUX_FORMAT_F32));
    assert_eq!(
        view(frame, CAMLUX_LAYER_INSTANCE_ID).format,
        CAMLUX_FORMAT_U32
    );
    ok(camlux_frame_release(frame));
}

/// What a progress callback has seen, and after how many reports it cancels.
#[derive(Default)]
struct Watch {
    reports: u32,
    last_fraction: f64,
    stop_after: Option<u32>,
    /// If not 0, the callback tries to render with it.
    renderer: usize,
    scene: usize,
    busy: i32,
}

unsafe extern "C" fn watch(fraction: f64, pass: *const c_char, user: *mut c_void) -> i32 {
    // SAFETY: the test's own value, which only this callback uses during the render.
    let watch = unsafe { &mut *user.cast::<Watch>() };
    assert!((0.0..=1.0).contains(&fraction) && fraction >= watch.last_fraction);
    // SAFETY: the string is valid during the call.
    assert!(!unsafe { CStr::from_ptr(pass) }.is_empty());
    watch.reports += 1;
    watch.last_fraction = fraction;
    if watch.renderer != 0 {
        let mut frame = null_mut();
        let renderer = std::ptr::without_provenance_mut(watch.renderer);
        let scene = std::ptr::without_provenance_mut(watch.scene);
        // SAFETY: it points to a pointer.
        watch.busy = unsafe { camlux_renderer_render(renderer, scene, null(), &mut frame) };
    }
    i32::from(Some(watch.reports) == watch.stop_after)
}

#[test]
fn progress_is_told_and_can_end_a_render() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, SIZE_PX[0], SIZE_PX[1]);
    let renderer = device.renderer();
    let whole = render(renderer, scene);
    for stop_after in [Some(1), Some(2), None] {
        let mut seen = Watch {
            stop_after,
            renderer: renderer.addr(),
            scene: scene.addr(),
            ..Watch::default()
        };
        let options = init!(camlux_render_options {
            progress: Some(watch),
            progress_user: (&raw mut seen).cast(),
            // So that it is drawn. Sums do not depend on it.
            seed: 3
        });
        let mut frame = null_mut();
        // SAFETY: a struct of that size, and a pointer to a pointer.
        let status = unsafe { camlux_renderer_render(renderer, scene, &options, &mut frame) };
        assert_eq!(seen.busy, CAMLUX_ERROR_BUSY);
        match stop_after {
            None => {
                ok(status);
                assert!(seen.reports > 2);
                assert!(layers(frame) == layers(whole));
                ok(camlux_frame_release(frame));
            }
            Some(reports) => {
                fails(status, CAMLUX_CANCELLED, "cancelled");
                assert_eq!(seen.reports, reports);
                assert!(frame.is_null());
            }
        }
    }
    ok(camlux_frame_release(whole));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

fn new_token() -> *mut camlux_cancel_token {
    let mut token = null_mut();
    // SAFETY: it points to a pointer.
    ok(unsafe { camlux_cancel_token_create(&mut token) });
    token
}

/// A render that begins after its token was cancelled is cancelled, too.
#[test]
fn a_cancel_before_the_render_is_not_lost() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, 8, 8);
    plain_sum(scene, 8);
    let renderer = device.renderer();
    let token = new_token();
    let mut seen = Watch::default();
    let options = init!(camlux_render_options {
        progress: Some(watch),
        progress_user: (&raw mut seen).cast(),
        cancel_token: token,
    });
    let mut frame = null_mut();
    // SAFETY: a struct of that size, and a pointer to a pointer.
    let mut render = || unsafe { camlux_renderer_render(renderer, scene, &options, &mut frame) };
    ok(render());
    ok(camlux_cancel_token_cancel(token));
    // The token stays cancelled.
    fails(render(), CAMLUX_CANCELLED, "cancelled");
    fails(render(), CAMLUX_CANCELLED, "cancelled");
    ok(camlux_cancel_token_release(token));
    fails(render(), CAMLUX_ERROR_INVALID_HANDLE, "camlux_cancel_token");
    ok(camlux_frame_release(frame));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

/// Reports that a render has begun, and holds it until the test has cancelled it.
struct Pause {
    begun: Sender<()>,
    cancelled: Receiver<()>,
}

unsafe extern "C" fn pause(_: f64, _: *const c_char, user: *mut c_void) -> i32 {
    // SAFETY: the test's own value, which only this callback uses during the render.
    let pause = unsafe { &*user.cast::<Pause>() };
    pause.begun.send(()).expect("the other thread listens");
    pause.cancelled.recv().expect("the other thread cancels");
    0
}

#[test]
fn a_cancel_ends_the_render_under_way_and_no_other() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, 8, 8);
    plain_sum(scene, 8);
    let renderer = device.renderer();
    let token = new_token();
    let handle = token.addr();
    let (begun, is_begun) = channel();
    let (cancel, cancelled) = channel();
    let mut pausing = Pause { begun, cancelled };
    let options = init!(camlux_render_options {
        cancel_token: token,
        progress: Some(pause),
        progress_user: (&raw mut pausing).cast(),
    });
    let mut frame = null_mut();
    let status = std::thread::scope(|scope| {
        scope.spawn(move || {
            is_begun.recv().expect("the render reports");
            let token = std::ptr::without_provenance_mut(handle);
            ok(camlux_cancel_token_cancel(token));
            cancel.send(()).expect("the render waits");
        });
        // SAFETY: a struct of that size, and a pointer to a pointer.
        unsafe { camlux_renderer_render(renderer, scene, &options, &mut frame) }
    });
    fails(status, CAMLUX_CANCELLED, "cancelled");
    ok(camlux_frame_release(render(renderer, scene)));
    ok(camlux_cancel_token_release(token));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

#[test]
fn area_lights_from_c_are_those_of_the_engine() {
    let device = Device::open();
    let renderer = device.renderer();
    let size_m = [0.4, 0.2];
    for shape in [
        AreaShape::Rectangle { size_m },
        AreaShape::Disc { radius_m: 0.2 },
    ] {
        let mut expected = engine_scene("cornell");
        expected.lights = vec![
            Light::area(
                DVec3::new(0.1, 1.7, 0.2),
                DVec3::new(0.1, -1.0, 0.0),
                DVec3::new(0.3, 0.0, -1.0),
                shape,
                [9.0, 8.0, 7.0],
            )
            .into(),
        ];
        expected.indirect = None;
        let built = from_arrays(&expected);
        let mut light = init!(camlux_light {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_scene_get_light(built, 0, &mut light) });
        let [width_m, height_m] = light.size_m;
        assert_eq!(
            (light.kind, light.up),
            (CAMLUX_LIGHT_AREA, [0.3, 0.0, -1.0])
        );
        match shape {
            AreaShape::Rectangle { .. } => assert_eq!([width_m, height_m], size_m),
            AreaShape::Disc { radius_m } => assert_eq!(light.radius_m, radius_m),
        }
        let frame = render(renderer, built);
        assert!(layers(frame) == engine_frame(&expected));
        let mut stats = init!(camlux_frame_stats {});
        // SAFETY: it points to a struct of that size.
        ok(unsafe { camlux_frame_get_stats(frame, &mut stats) });
        let estimated = stats.estimated_area_light_error;
        assert!((1e-4..=0.02).contains(&estimated), "{estimated}");
        ok(camlux_frame_release(frame));
        ok(camlux_scene_release(built));
    }
    ok(camlux_renderer_release(renderer));
}
