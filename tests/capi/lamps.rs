//! Measured lamps and projectors from C: their frames equal those of the engine.

use std::{f64::consts::TAU, ptr::null};

use crate::host::*;
use camlux::{
    capi::*,
    scene::{Pattern, Profile},
};

/// A demo scene, small and without the bounce.
fn direct_scene(name: &str) -> camlux::Scene {
    let mut scene = engine_scene(name, [24, 18]);
    scene.camera.pixel_sampling = None;
    scene.indirect = None;
    scene
}

/// The light of a demo scene, in C.
fn light_of(name: &str) -> camlux_light {
    let light = load(name).light(0);
    assert!(light.pattern.is_null() && light.image.is_null());
    light
}

/// Asserts that a scene under this light, added and set, looks as the engine's.
fn assert_looks_like(expected: &camlux::Scene, light: camlux_light) {
    let due = engine_frame(expected);
    let without = camlux::Scene {
        lights: Vec::new(),
        ..expected.clone()
    };
    let scene = from_arrays(&without);
    let device = Device::open();
    let renderer = device.renderer();
    let index = scene.add_light(&light).expect("it is added");
    assert!(renderer.render(&scene).layers() == due);
    // Without its pattern, the new light keeps that of the old one.
    let kept = camlux_light {
        pattern: null(),
        image: null(),
        ..light
    };
    let dim = camlux_light {
        power_w: [0.0; 3],
        ..kept
    };
    ok(scene.set_light(index, &dim));
    ok(scene.set_light(index, &kept));
    let placed = |light: &camlux_light| (light.kind, light.position_m, light.direction, light.up);
    assert_eq!(placed(&scene.light(index)), placed(&light));
    assert!(renderer.render(&scene).layers() == due);
}

#[test]
fn a_lamp_from_a_file_is_that_of_the_scene_file() {
    let path = file("lamp.ies");
    let pattern = init!(camlux_pattern {
        path: path.as_ptr()
    });
    let mut light = light_of("lamp");
    light.pattern = &pattern;
    assert_looks_like(&direct_scene("lamp"), light);
}

#[test]
fn a_lamp_from_arrays_is_that_of_the_engine() {
    let gammas_deg = [0.0, 30.0, 60.0, 90.0];
    // Half a turn, which is mirrored.
    let planes_deg = [0.0, 90.0, 180.0];
    let intensities = [
        [40.0, 30.0, 10.0, 0.0],
        [40.0, 20.0, 5.0, 0.0],
        [40.0, 35.0, 20.0, 0.0],
    ];
    let pattern = init!(camlux_pattern {
        gammas_deg: gammas_deg.as_ptr(),
        gamma_count: 4,
        planes_deg: planes_deg.as_ptr(),
        plane_count: 3,
        intensities: intensities.as_ptr().cast(),
    });
    let mut light = light_of("lamp");
    light.pattern = &pattern;
    let mut expected = direct_scene("lamp");
    let lamp = expected.lights[0].lamp_mut().expect("the scene has a lamp");
    let turn = [0, 1, 2, 1, 0].map(|plane| intensities[plane].map(|value| value / 40.0));
    lamp.profile = Profile::from(Pattern {
        gammas_rad: gammas_deg.map(f64::to_radians).to_vec(),
        planes_rad: [0.0, 90.0, 180.0, 270.0]
            .map(f64::to_radians)
            .into_iter()
            .chain([TAU])
            .collect(),
        intensities: turn.concat(),
        peak: 40.0,
    });
    assert_looks_like(&expected, light);
}

#[test]
fn a_projector_from_a_file_is_that_of_the_scene_file() {
    let path = file("stripes.png");
    let image = init!(camlux_projected_image {
        path: path.as_ptr(),
        fov_y_deg: 32.0
    });
    let mut light = light_of("projector");
    light.image = &image;
    assert_looks_like(&direct_scene("projector"), light);
}

#[test]
fn a_projector_from_an_array_is_that_of_the_engine() {
    let expected = direct_scene("projector");
    let Some(Profile::Projected(of_file)) = expected.lights[0].lamp().map(|lamp| &lamp.profile)
    else {
        panic!("the scene has a projector");
    };
    let [width_px, height_px] = of_file.size_px;
    // Rows with a gap.
    let rows = of_file.values.chunks(width_px as usize);
    let values: Vec<f32> = rows
        .flat_map(|row| row.iter().copied().chain([7.0]))
        .collect();
    let image = init!(camlux_projected_image {
        width_px: width_px,
        height_px: height_px,
        values: values.as_ptr(),
        row_stride_bytes: 4 * (width_px as usize + 1),
        lens: CAMLUX_LENS_INTRINSICS,
        fx_px: of_file.intrinsics.fx,
        fy_px: of_file.intrinsics.fy,
        cx_px: of_file.intrinsics.cx,
        cy_px: of_file.intrinsics.cy,
    });
    let mut light = light_of("projector");
    light.image = &image;
    assert_looks_like(&expected, light);
}

#[test]
fn lamps_and_projectors_without_a_shape_are_refused() {
    let scene = new_scene();
    let (mut lamp, mut projector) = (light_of("lamp"), light_of("projector"));
    let refused = |light: &camlux_light| scene.add_light(light).unwrap_err();
    fails(refused(&lamp), ARGUMENT, "pattern is NULL");
    fails(refused(&projector), ARGUMENT, "image is NULL");
    let (gammas, planes, values) = ([0.0, 90.0], [0.0], [1.0, 1.0]);
    let whole = init!(camlux_pattern {
        gammas_deg: gammas.as_ptr(),
        gamma_count: 2,
        planes_deg: planes.as_ptr(),
        plane_count: 1,
        intensities: values.as_ptr(),
    });
    let missing = c"no such lamp.ies".as_ptr();
    let mut refuses = |change: &dyn Fn(&mut camlux_pattern), status, words| {
        let mut pattern = whole;
        change(&mut pattern);
        lamp.pattern = &pattern;
        fails(refused(&lamp), status, words);
    };
    refuses(&|p| p.gamma_count = 1, ARGUMENT, "give a path, or");
    refuses(&|p| p.intensities = null(), ARGUMENT, "intensities is NULL");
    refuses(&|p| p.encoding = 7, ARGUMENT, "encoding is 7");
    refuses(&|p| p.struct_size = 8, ARGUMENT, "struct_size");
    refuses(&|p| p.path = missing, ARGUMENT, "only one of them");
    let only_path = init!(camlux_pattern { path: missing });
    refuses(&|p| *p = only_path, SCENE, "no such lamp.ies");
    let words = "pattern: gammas_deg do not increase";
    refuses(&|p| p.gammas_deg = values.as_ptr(), SCENE, words);
    lamp.pattern = &whole;
    scene.add_light(&lamp).expect("it is added");
    let pixels = [0.5_f32; 2];
    let whole = init!(camlux_projected_image {
        width_px: 2,
        height_px: 1,
        values: pixels.as_ptr(),
        fov_y_deg: 20.0
    });
    let mut refuses = |change: &dyn Fn(&mut camlux_projected_image), status, words| {
        let mut image = whole;
        change(&mut image);
        projector.image = &image;
        fails(refused(&projector), status, words);
    };
    let nothing = init!(camlux_projected_image { fov_y_deg: 20.0 });
    refuses(&|i| *i = nothing, ARGUMENT, "give a path, or");
    refuses(&|i| i.fov_y_deg = 0.0, SCENE, "fov_y_deg is 0");
    refuses(&|i| i.lens = CAMLUX_LENS_FISHEYE, ARGUMENT, "lens is 3");
    refuses(&|i| i.lens = 1, SCENE, "fx_px, fy_px");
    refuses(&|i| i.reserved = 1, ARGUMENT, "reserved");
    refuses(&|i| i.path = missing, ARGUMENT, "only one of them");
    refuses(&|i| i.values = null(), ARGUMENT, "values is NULL");
    refuses(&|i| i.row_stride_bytes = 4, ARGUMENT, "stride");
    projector.image = &whole;
    scene.add_light(&projector).expect("it is added");
}

/// From an array with a stride, and from a file with the same values: both give the scene that Rust gives.
#[test]
fn a_vignetting_map_is_an_array_or_a_file() {
    let scene = load("cornell");
    let mut sensor = init!(camlux_sensor {
        pixel_pitch_um: [3.0; 2],
        exposure_time_s: 1e-3
    });
    ok(scene.set_sensor(&sensor));
    // Two rows of three values, each with one value behind.
    let values = [0.5_f32, 1.0, 0.5, -1.0, 0.25, 0.75, 0.25, -1.0];
    let whole = init!(camlux_vignetting_map {
        width_px: 3,
        height_px: 2,
        values: values.as_ptr(),
        row_stride_bytes: 16
    });
    let validate = || camlux_scene_validate(scene.raw());
    // SAFETY: NULL, or a struct of its size with pointers to what it states.
    let set = |map| unsafe { camlux_scene_set_vignetting_map(scene.raw(), map) };
    ok(set(&whole));
    fails(validate(), SCENE, "vignetting is given without an f_number");
    sensor.f_number = 2.0;
    ok(scene.set_sensor(&sensor));
    ok(validate());
    sensor.has_vignetting = 1;
    ok(scene.set_sensor(&sensor));
    fails(validate(), SCENE, "set has_vignetting to 0");
    ok(set(null()));
    ok(validate());
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("flat.png");
    image::GrayImage::from_pixel(2, 2, image::Luma([51]))
        .save(&file)
        .expect("it is written");
    let path = c_path(&file);
    let of_file = init!(camlux_vignetting_map {
        path: path.as_ptr()
    });
    ok(set(&of_file));
    let refuses = |change: &dyn Fn(&mut camlux_vignetting_map), status, words| {
        let mut map = whole;
        change(&mut map);
        fails(set(&map), status, words);
    };
    refuses(&|m| m.row_stride_bytes = 12, SCENE, "pixel (0, 1) is -1");
    refuses(&|m| m.width_px = 0, ARGUMENT, "give a path, or an array");
    refuses(&|m| m.reserved = 1, ARGUMENT, "reserved");
    refuses(&|m| m.path = path.as_ptr(), ARGUMENT, "only one of them");
    refuses(&|m| m.values = null(), ARGUMENT, "values is NULL");
    let missing = init!(camlux_vignetting_map {
        path: c"no such flat.png".as_ptr()
    });
    fails(set(&missing), SCENE, "no such flat.png");
}

/// A disc needs no direction of its height, wherever it points; a rectangle does.
#[test]
fn a_disc_needs_no_up() {
    let scene = new_scene();
    for direction in [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]] {
        let mut light = init!(camlux_light {
            kind: CAMLUX_LIGHT_AREA,
            direction: direction,
            radius_m: 0.1
        });
        scene.add_light(&light).expect("it is added");
        light.radius_m = 0.0;
        light.size_m = [0.1, 0.2];
        let rectangle = scene.add_light(&light).unwrap_err();
        fails(rectangle, SCENE, "up is [0, 0, 0]");
    }
}
