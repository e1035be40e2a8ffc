//! Measured lamps and projectors from C: their frames equal those of the engine.

use std::{
    f64::consts::TAU,
    ffi::CString,
    path::Path,
    ptr::{null, null_mut},
};

use camlux::{
    Device as EngineDevice, DeviceOptions, RenderOptions, Renderer, Scene,
    scene::{Pattern, Profile},
};

use crate::host::*;
use camlux::capi::*;

/// A demo scene, small and without the bounce.
fn engine_scene(name: &str) -> Scene {
    let path = scene_file(name);
    let mut scene = Scene::load(Path::new(path.to_str().expect("UTF-8"))).expect("it loads");
    scene.camera.resolution_px = [24, 18];
    scene.camera.pixel_sampling = None;
    scene.indirect = None;
    scene
}

fn file(name: &str) -> CString {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("scenes")
        .join(name);
    CString::new(path.to_str().expect("UTF-8")).expect("no NUL")
}

/// The light of a demo scene, in C.
fn light_of(name: &str) -> camlux_light {
    let scene = load(name);
    let mut light = init!(camlux_light {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_light(scene, 0, &mut light) });
    ok(camlux_scene_release(scene));
    assert!(light.pattern.is_null() && light.image.is_null());
    light
}

/// Asserts that a scene under this light, added and set, looks as the engine's.
fn assert_looks_like(expected: &Scene, light: camlux_light) {
    let engine = EngineDevice::open(&DeviceOptions::default()).expect("there is a device");
    let mut renderer = Renderer::new(&engine).expect("it is made");
    let due = renderer.render(expected, &mut RenderOptions::default());
    let due = layers_of(&due.expect("it renders"));
    let without = Scene {
        lights: Vec::new(),
        ..expected.clone()
    };
    let scene = from_arrays(&without);
    let device = Device::open();
    let renderer = device.renderer();
    let mut index = 9;
    // SAFETY: structs of their size, with valid pointers.
    ok(unsafe { camlux_scene_add_light(scene, &light, &mut index) });
    let frame = render(renderer, scene);
    assert!(layers(frame) == due);
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
    let mut read = init!(camlux_light {});
    // SAFETY: structs of their size.
    unsafe {
        ok(camlux_scene_set_light(scene, index, &dim));
        ok(camlux_scene_set_light(scene, index, &kept));
        ok(camlux_scene_get_light(scene, index, &mut read));
    }
    let placed = |light: &camlux_light| (light.kind, light.position_m, light.direction, light.up);
    assert_eq!(placed(&read), placed(&light));
    let again = render(renderer, scene);
    assert!(layers(again) == due);
    for frame in [frame, again] {
        ok(camlux_frame_release(frame));
    }
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

#[test]
fn a_lamp_from_a_file_is_that_of_the_scene_file() {
    let path = file("lamp.ies");
    let pattern = init!(camlux_pattern {
        path: path.as_ptr()
    });
    let mut light = light_of("lamp");
    light.pattern = &pattern;
    assert_looks_like(&engine_scene("lamp"), light);
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
    let mut expected = engine_scene("lamp");
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
    assert_looks_like(&engine_scene("projector"), light);
}

#[test]
fn a_projector_from_an_array_is_that_of_the_engine() {
    let expected = engine_scene("projector");
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
    let add = |light: &camlux_light| {
        // SAFETY: structs of their size, with valid pointers.
        unsafe { camlux_scene_add_light(scene, light, null_mut()) }
    };
    let (argument, of_scene) = (CAMLUX_ERROR_INVALID_ARGUMENT, CAMLUX_ERROR_SCENE);
    let (mut lamp, mut projector) = (light_of("lamp"), light_of("projector"));
    fails(add(&lamp), argument, "pattern is NULL");
    fails(add(&projector), argument, "image is NULL");
    let (gammas, planes, values) = ([0.0, 90.0], [0.0], [1.0, 1.0]);
    let whole = init!(camlux_pattern {
        gammas_deg: gammas.as_ptr(),
        gamma_count: 2,
        planes_deg: planes.as_ptr(),
        plane_count: 1,
        intensities: values.as_ptr(),
    });
    let missing = c"no such lamp.ies";
    let with = |change: fn(&mut camlux_pattern)| {
        let mut pattern = whole;
        change(&mut pattern);
        pattern
    };
    for (pattern, status, words) in [
        (
            with(|pattern| pattern.gamma_count = 1),
            argument,
            "give a path, or",
        ),
        (
            with(|pattern| pattern.intensities = null()),
            argument,
            "intensities is NULL",
        ),
        (
            with(|pattern| pattern.encoding = 7),
            argument,
            "encoding is 7",
        ),
        (
            with(|pattern| pattern.struct_size = 8),
            argument,
            "struct_size",
        ),
        (
            camlux_pattern {
                path: missing.as_ptr(),
                ..whole
            },
            argument,
            "only one of them",
        ),
        (
            init!(camlux_pattern {
                path: missing.as_ptr()
            }),
            of_scene,
            "no such lamp.ies",
        ),
        (
            camlux_pattern {
                gammas_deg: values.as_ptr(),
                ..whole
            },
            of_scene,
            "pattern: gammas_deg do not increase",
        ),
    ] {
        lamp.pattern = &pattern;
        fails(add(&lamp), status, words);
    }
    lamp.pattern = &whole;
    ok(add(&lamp));
    let pixels = [0.5_f32; 2];
    let whole = init!(camlux_projected_image {
        width_px: 2,
        height_px: 1,
        values: pixels.as_ptr(),
        fov_y_deg: 20.0
    });
    for (image, status, words) in [
        (
            init!(camlux_projected_image { fov_y_deg: 20.0 }),
            argument,
            "give a path, or",
        ),
        (
            camlux_projected_image {
                fov_y_deg: 0.0,
                ..whole
            },
            of_scene,
            "fov_y_deg is 0",
        ),
        (
            camlux_projected_image {
                lens: CAMLUX_LENS_FISHEYE,
                ..whole
            },
            argument,
            "lens is 3",
        ),
        (
            camlux_projected_image { lens: 1, ..whole },
            of_scene,
            "fx_px, fy_px",
        ),
        (
            camlux_projected_image {
                reserved: 1,
                ..whole
            },
            argument,
            "reserved",
        ),
        (
            camlux_projected_image {
                path: missing.as_ptr(),
                ..whole
            },
            argument,
            "only one of them",
        ),
        (
            camlux_projected_image {
                values: null(),
                ..whole
            },
            argument,
            "values is NULL",
        ),
        (
            camlux_projected_image {
                row_stride_bytes: 4,
                ..whole
            },
            argument,
            "stride",
        ),
    ] {
        projector.image = &image;
        fails(add(&projector), status, words);
    }
    projector.image = &whole;
    ok(add(&projector));
    ok(camlux_scene_release(scene));
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
        // SAFETY: structs of their size; no index requested.
        unsafe {
            ok(camlux_scene_add_light(scene, &light, null_mut()));
            light.radius_m = 0.0;
            light.size_m = [0.1, 0.2];
            let status = camlux_scene_add_light(scene, &light, null_mut());
            fails(status, CAMLUX_ERROR_SCENE, "up is [0, 0, 0]");
        }
    }
    ok(camlux_scene_release(scene));
}
