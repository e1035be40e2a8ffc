//! Frames through the C interface equal the engine's bit for bit, whatever the host makes its scene from.

use std::{
    f64::consts::FRAC_PI_2,
    ffi::{CStr, c_char},
    ptr::null,
};

use crate::host::*;
use camlux::{
    capi::*,
    glam::{DQuat, DVec3},
    scene::{
        AreaShape, Distortion, Encoding, Intrinsics, Lens, Light, PixelFilter, PixelSampling,
        Texels, Vignetting,
    },
};

const SIZE_PX: [u32; 2] = [24, 20];

#[test]
fn a_scene_from_arrays_is_that_of_the_file() {
    let device = Device::open();
    for name in ["cornell", "textured"] {
        let expected = engine_scene(name, SIZE_PX);
        let loaded = load_at(name, SIZE_PX);
        let built = from_arrays(&expected);
        let renderer = device.renderer();
        let [of_file, of_arrays] = [loaded, built].map(|scene| renderer.render(&scene));
        assert!(of_file.layers() == of_arrays.layers(), "{name}");
        assert!(of_file.layers() == engine_frame(&expected), "{name}");
    }
}

#[test]
fn a_measured_lamp_comes_with_its_scene() {
    let device = Device::open();
    let renderer = device.renderer();
    let mut expected = engine_scene("lamp", SIZE_PX);
    let scene = load_at("lamp", SIZE_PX);
    assert_eq!(scene.light(0).kind, CAMLUX_LIGHT_PATTERN);
    let before = renderer.render(&scene);
    assert!(before.layers() == engine_frame(&expected));
    // The lamp now shines upwards.
    let position_m = DVec3::new(0.1, 0.5, 0.0);
    let turn = DQuat::from_rotation_x(-FRAC_PI_2);
    scene.place(CAMLUX_PART_LIGHT, 0, position_m, turn);
    let light = &mut expected.lights[0];
    *light.position_m_mut().expect("it has one") = position_m;
    *light.direction_mut().expect("it has one") = turn * DVec3::Z;
    *light.up_mut().expect("it has one") = turn * DVec3::NEG_Y;
    let after = renderer.render(&scene);
    assert!(after.layers() == engine_frame(&expected));
    assert!(after.layers() != before.layers());
}

#[test]
fn a_lens_and_maps_of_normals_and_alpha_from_c_are_those_of_the_engine() {
    let device = Device::open();
    let renderer = device.renderer();
    let rational = [
        -0.2, 0.05, 0.002, -0.001, 0.01, 0.02, 0.003, 0.004, 0.01, -0.002, 0.003, 0.004, 0.05,
        -0.03,
    ];
    let mut images = Vec::new();
    for distortion in [
        Distortion::Rational(rational),
        Distortion::Fisheye([0.05, -0.01, 0.002, 0.001]),
    ] {
        let mut expected = engine_scene("textured", SIZE_PX);
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
            intrinsics: Intrinsics {
                skew: 1.5,
                ..expected.camera.intrinsics_px()
            },
            distortion,
        };
        let is_fisheye = matches!(distortion, Distortion::Fisheye(_));
        let sensor = expected.sensor.as_mut().expect("the scene has one");
        sensor.f_number = Some(2.0);
        // The principal point is 36 half diagonals away from the pixels.
        sensor.vignetting = is_fisheye.then_some(Vignetting([-3e-4, 1e-7, -5e-11]));
        let (samples, filter) = (3, PixelFilter::Gaussian);
        expected.camera.pixel_sampling = is_fisheye.then_some(PixelSampling { samples, filter });
        let built = from_arrays(&expected);
        let frame = renderer.render(&built);
        assert!(frame.layers() == engine_frame(&expected), "{distortion:?}");
        images.push(frame.layers());
        let camera = built.camera();
        let sampling = (camera.samples, camera.filter);
        let due = if is_fisheye {
            (3, CAMLUX_FILTER_GAUSSIAN)
        } else {
            (1, CAMLUX_FILTER_BOX)
        };
        assert_eq!(sampling, due);
        let found = [&camera.distortion[..], &camera.prism_tilt].concat();
        let coefficients = distortion.coefficients();
        assert_eq!(found[..coefficients.len()], *coefficients);
        assert_eq!(camera.skew_px, 1.5);
    }
    assert!(images[0] != images[1]);
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
        let mut expected = engine_scene("cornell", SIZE_PX);
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
        let light = built.light(0);
        let [width_m, height_m] = light.size_m;
        assert_eq!(
            (light.kind, light.up),
            (CAMLUX_LIGHT_AREA, [0.3, 0.0, -1.0])
        );
        match shape {
            AreaShape::Rectangle { .. } => assert_eq!([width_m, height_m], size_m),
            AreaShape::Disc { radius_m } => assert_eq!(light.radius_m, radius_m),
        }
        let frame = renderer.render(&built);
        assert!(frame.layers() == engine_frame(&expected));
        let estimated = frame.stats().estimated_area_light_error;
        assert!((1e-4..=0.02).contains(&estimated), "{estimated}");
    }
}

#[test]
fn a_frame_foretells_those_that_are_like_it() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load_at("cornell", SIZE_PX);
    let foretold = || {
        let mut milliseconds = -1.0;
        // SAFETY: it points to a number.
        ok(unsafe { camlux_renderer_foretell_ms(renderer.raw(), scene.raw(), &mut milliseconds) });
        milliseconds
    };
    assert_eq!(foretold(), 0.0);
    renderer.render(&scene);
    let alike = foretold();
    scene.resize(2 * SIZE_PX[0], 2 * SIZE_PX[1]);
    assert!(foretold() > alike && alike > 0.0);
    let indirect = init!(camlux_indirect {
        estimator: CAMLUX_ESTIMATOR_FINAL_GATHER,
        target_error: 0.1,
    });
    ok(scene.set_indirect(&indirect));
    assert_eq!(foretold(), 0.0);
}

/// An error that a frame does not estimate is NaN, so that the result of a VPL sum is never read as exact.
#[test]
fn each_estimator_estimates_its_own_error() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load_at("cornell", SIZE_PX);
    let estimated = |indirect: camlux_indirect| {
        ok(scene.set_indirect(&indirect));
        let stats = renderer.render(&scene).stats();
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
    assert_eq!([average, radiosity].map(estimated), [nothing; 2]);
    let interpolated = camlux_indirect {
        interpolation_error: 0.1,
        ..average
    };
    let of_the_sum = ([true, false], CAMLUX_STOP_NONE);
    assert_eq!(estimated(interpolated), of_the_sum);
    let gathered = init!(camlux_indirect { target_error: 0.1 });
    let of_the_bounce = ([false, true], CAMLUX_STOP_TARGET_MET);
    assert_eq!(estimated(gathered), of_the_bounce);
}

/// Holds on the host, and for a frame that stays on the device. The next frame that does not request the layer has none.
#[test]
fn a_frame_has_standard_errors_where_they_are_asked_for() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load_at("cornell", SIZE_PX);
    let options = init!(camlux_render_options { on_device: 1 });
    for stderr_layer in [1, 0] {
        let indirect = init!(camlux_indirect {
            target_error: 0.3,
            stderr_layer: stderr_layer
        });
        ok(scene.set_indirect(&indirect));
        let frame = renderer.render(&scene);
        let found = frame.layers();
        let errors = found
            .iter()
            .find(|(layer, _)| *layer == CAMLUX_LAYER_STDERR);
        assert_eq!(errors.is_some(), stderr_layer == 1);
        let mut view = init!(camlux_view {});
        let mut image = init!(camlux_vulkan_image {});
        let staying = renderer.try_render(&scene, &options).expect("it renders");
        // SAFETY: all pointers are valid.
        let viewed = unsafe {
            [
                camlux_frame_view(frame.raw(), CAMLUX_LAYER_STDERR, &mut view),
                camlux_frame_get_vulkan_image(staying.raw(), CAMLUX_LAYER_STDERR, &mut image),
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
    }
}

#[test]
fn a_view_is_what_a_copy_and_the_files_have() {
    let device = Device::open();
    let scene = load_at("cornell", SIZE_PX);
    let renderer = device.renderer();
    let frame = renderer.render(&scene);
    // The frame outlives its renderer and its scene.
    drop(renderer);
    drop(scene);
    let of_view = &frame.layers()[0].1;
    let row = SIZE_PX[0] as usize * 3;
    let stride = row + 5;
    let mut copied = vec![7.0_f32; stride * SIZE_PX[1] as usize];
    let bytes = size_of_val(copied.as_slice());
    // SAFETY: the memory has `bytes` bytes.
    ok(unsafe {
        camlux_frame_copy(
            frame.raw(),
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
    for name in ["all.exr", "one.exr", "plain.exr", "parts.exr", "look.png"] {
        let path = c_path(&folder.path().join(name));
        let one = init!(camlux_exr_options {
            layers: &CAMLUX_LAYER_DEPTH,
            layer_count: 1
        });
        let plain = camlux_exr_options { plain: 1, ..one };
        let parts = init!(camlux_exr_options { multipart: 1 });
        // SAFETY: a string, and no options or a struct of that size.
        ok(unsafe {
            match name {
                "plain.exr" => camlux_frame_write_exr(frame.raw(), path.as_ptr(), &plain),
                "parts.exr" => camlux_frame_write_exr(frame.raw(), path.as_ptr(), &parts),
                "all.exr" => camlux_frame_write_exr(frame.raw(), path.as_ptr(), null()),
                "one.exr" => camlux_frame_write_exr(frame.raw(), path.as_ptr(), &one),
                _ => camlux_frame_write_png(frame.raw(), path.as_ptr()),
            }
        });
    }
    let read = |name: &str| camlux::output::LayeredImage::read(folder.path().join(name));
    let all = read("all.exr").expect("an image");
    assert_eq!(read("parts.exr").expect("an image").layers(), all.layers());
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
    let depth = frame.view(CAMLUX_LAYER_DEPTH);
    assert_eq!(
        (text(depth.name), text(depth.unit)),
        (c"depth".into(), c"m".into())
    );
    assert_eq!((depth.channels, depth.format), (1, CAMLUX_FORMAT_F32));
    assert_eq!(
        frame.view(CAMLUX_LAYER_INSTANCE_ID).format,
        CAMLUX_FORMAT_U32
    );
}
