//! Values that the C interface refuses: the status, the message, and that nothing changes.

use std::ptr::{null, null_mut};

use crate::host::*;
use camlux::capi::*;

const NAN: f64 = f64::NAN;

#[test]
fn cameras_and_sensors_are_checked() {
    let scene = new_scene();
    let camera = |change| scene.set_camera(&with(change));
    fails(camera(|c| c.width_px = 0), SCENE, "0 x 480");
    let words = "lens has no distortion";
    fails(camera(|c| c.distortion = [-0.1; 8]), ARGUMENT, words);
    let words = "set lens to CAMLUX_LENS_RATIONAL";
    fails(camera(|c| c.prism_tilt[5] = 0.1), ARGUMENT, words);
    fails(camera(|c| c.lens = 9), ARGUMENT, "lens is 9");
    fails(
        camera(|c| c.lens = CAMLUX_LENS_FOV_X),
        SCENE,
        "fov_x_deg is 0",
    );
    let flat = |c: &mut camlux_camera| c.lens = CAMLUX_LENS_ORTHOGRAPHIC;
    fails(
        camera(flat),
        SCENE,
        "height_m of the image is 0; give a finite value above 0",
    );
    let skewed = |c: &mut camlux_camera| {
        (c.lens, c.fx_px, c.fy_px, c.skew_px) = (CAMLUX_LENS_INTRINSICS, 1.0, 1.0, NAN);
    };
    fails(camera(skewed), SCENE, "skew_px is NaN");
    fails(camera(|c| c.position_m[0] = NAN), SCENE, "position");
    fails(camera(|c| c.look_at_m = [0.0; 3]), SCENE, "look_at");
    fails(camera(|c| c.up = [0.0, 0.0, 2.0]), SCENE, "parallel");
    fails(camera(|c| c.fov_y_deg = NAN), SCENE, "fov_y_deg");
    fails(camera(|c| c.fov_y_deg = 180.0), SCENE, "fov_y_deg");
    fails(camera(|c| c.lens = CAMLUX_LENS_INTRINSICS), SCENE, "fx");
    let sensor = |change| scene.set_sensor(&with(change));
    fails(sensor(|_| ()), SCENE, "pixel_pitch_um");
    let unexposed = |s: &mut camlux_sensor| {
        (s.pixel_pitch_um, s.exposure_time_s) = ([1.0; 2], NAN);
    };
    fails(sensor(unexposed), SCENE, "exposure_time_s");
    fails(sensor(|s| s.reserved = 1), ARGUMENT, "reserved");
    fails(sensor(|s| s.reserved_end = 1), ARGUMENT, "reserved");
    let words = "has_vignetting is 2; give 0 or 1";
    fails(sensor(|s| s.has_vignetting = 2), ARGUMENT, words);
    let vignetted = |s: &mut camlux_sensor| {
        (s.pixel_pitch_um, s.exposure_time_s) = ([1.0; 2], 1e-3);
        (s.vignetting, s.has_vignetting) = ([-0.3, 0.0, 0.0], 1);
    };
    fails(
        sensor(vignetted),
        SCENE,
        "vignetting is given without an f_number",
    );
    let direct = scene.set_direct(&with(|d| d.shadow = 3));
    fails(direct, ARGUMENT, "shadow is 3");
}

#[test]
fn indirect_light_is_checked() {
    let scene = new_scene();
    let indirect = |change| scene.set_indirect(&with(change));
    fails(indirect(|i| i.estimator = 3), ARGUMENT, "estimator is 3");
    fails(indirect(|i| i.bounces = 17), SCENE, "bounces");
    let words = "stderr_layer is 2; give 0 or 1";
    fails(indirect(|i| i.stderr_layer = 2), ARGUMENT, words);
    let words = "error_norm is 2; give one of CAMLUX_NORM_IMAGE (0), CAMLUX_NORM_LOCAL (1)";
    fails(indirect(|i| i.error_norm = 2), ARGUMENT, words);
    fails(indirect(|i| i.target_error = NAN), SCENE, "target_error");
    fails(indirect(|i| i.target_error = 0.6), SCENE, "target_error");
    let words = "max_ms is -1; give finite milliseconds above 0";
    fails(indirect(|i| i.max_ms = -1.0), SCENE, words);
    fails(indirect(|i| i.max_ms = NAN), SCENE, "max_ms is NaN");
    let words = "interpolation_error";
    fails(indirect(|i| i.interpolation_error = NAN), SCENE, words);
    let gather = CAMLUX_ESTIMATOR_FINAL_GATHER;
    let average = CAMLUX_ESTIMATOR_RSM_AVERAGE;
    let radiosity = CAMLUX_ESTIMATOR_INSTANT_RADIOSITY;
    for estimator in [gather, average, radiosity] {
        let plain = init!(camlux_indirect {
            estimator: estimator
        });
        ok(scene.set_indirect(&plain));
        let refuses = |change: fn(&mut camlux_indirect), words| {
            let mut sum = camlux_indirect {
                rsm_size: 8,
                ..plain
            };
            change(&mut sum);
            fails(scene.set_indirect(&sum), SCENE, words);
        };
        if estimator != average {
            let words = "interpolation_error is 0.05";
            refuses(|i| i.interpolation_error = 0.05, words);
        }
        if estimator != gather {
            refuses(|i| i.target_error = 0.05, "target_error is 0.05");
            refuses(|i| i.error_norm = 1, "error_norm is 1, but");
            refuses(|i| i.max_ms = 9.0, "max_ms is 9, but");
            let words = "target_range_error_mm is 9, but";
            refuses(|i| i.target_range_error_mm = 9.0, words);
            refuses(|i| i.max_rays = 9, "max_rays is 9, but");
            refuses(|i| i.stderr_layer = 1, "stderr_layer is 1, but");
        }
    }
}

#[test]
fn parts_are_checked() {
    let scene = new_scene();
    let plain = init!(camlux_material {});
    scene.add_material(&plain).expect("it is added");
    let light = |change| scene.add_light(&with(change)).unwrap_err();
    fails(light(|l| l.kind = 9), ARGUMENT, "kind is 9");
    fails(light(|l| l.power_w = [NAN; 3]), SCENE, "power_w");
    fails(light(|l| l.power_w = [-1.0; 3]), SCENE, "power_w");
    let far = |l: &mut camlux_light| l.position_m = [f64::INFINITY; 3];
    fails(light(far), SCENE, "position");
    let words = "direction";
    fails(light(|l| l.kind = CAMLUX_LIGHT_DIRECTIONAL), SCENE, words);
    let without_cone = |l: &mut camlux_light| {
        (l.kind, l.direction) = (CAMLUX_LIGHT_SPOT, [0.0, 0.0, 1.0]);
    };
    fails(light(without_cone), SCENE, "outer");
    let missing = scene.set_light(0, &init!(camlux_light {}));
    fails(missing, ARGUMENT, "no light 0 among 0");
    let material = |change| scene.add_material(&with(change)).unwrap_err();
    fails(material(|m| m.kd = [NAN; 3]), SCENE, "kd");
    fails(material(|m| m.kd = [1.5; 3]), SCENE, "kd");
    fails(material(|m| m.ks = [0.5; 3]), SCENE, "shininess");
    fails(material(|m| m.kd_texture = 1), SCENE, "kd_texture");
    let missing = scene.set_material(1, &plain);
    fails(missing, ARGUMENT, "material 1 among 1");
    for (part, index, words) in [
        (3, 0, "part is 3"),
        (CAMLUX_PART_CAMERA, 1, "index 0"),
        (CAMLUX_PART_LIGHT, 0, "no light 0"),
        (CAMLUX_PART_INSTANCE, 7, "no instance 7"),
    ] {
        let pose = init!(camlux_pose {});
        fails(scene.set_pose(part, index, &pose), ARGUMENT, words);
    }
    let pose = |change| scene.set_pose(CAMLUX_PART_CAMERA, 0, &with(change));
    let words = "unit quaternion";
    fails(pose(|p| p.orientation_xyzw = [0.0; 4]), SCENE, words);
    fails(pose(|p| p.orientation_xyzw = [NAN; 4]), SCENE, words);
    fails(pose(|p| p.position_m = [NAN; 3]), SCENE, "finite");
    fails(pose(|p| p.position_m = [1e13; 3]), SCENE, "position");
    fails(pose(|p| p.reserved = 1), ARGUMENT, "reserved");
}

/// A call that would move an instance out of range fails and names the instance.
#[test]
fn an_instance_too_far_out_is_named() {
    let scene = load("cornell");
    let counts = scene.counts();
    let last = counts.instances - 1;
    let at = |x| {
        init!(camlux_pose {
            position_m: [x, 0.0, 0.0]
        })
    };
    let set = |x| scene.set_pose(CAMLUX_PART_INSTANCE, last, &at(x));
    let far = "1000000000000000000000000000000";
    let words = format!("instance {last}: position_m is [{far}, 0, 0]");
    fails(set(1e30), SCENE, &words);
    // The position is in range, but a corner of the instance's box is not.
    let words = format!("instance {last}: a corner of its box is");
    fails(set(1e12), SCENE, &words);
    // SAFETY: a struct of that size; no index requested.
    let added = unsafe { camlux_scene_add_instance(scene.raw(), 0, &at(1e12), null_mut()) };
    let words = format!("instance {}: a corner", counts.instances);
    fails(added, SCENE, &words);
    ok(set(9e11));
    ok(scene.validate());
    assert_eq!(scene.counts().instances, counts.instances);
}

/// Messages use the words of the C interface, not the keys of a scene file.
#[test]
fn messages_have_the_words_of_c() {
    let scene = new_scene();
    let textured = init!(camlux_material { kd_texture: 3 });
    let words =
        "kd_texture is 3, but the number of textures is 0; give what camlux_scene_add_texture gave";
    fails(scene.add_material(&textured).unwrap_err(), SCENE, words);
    let camera = with(|c: &mut camlux_camera| c.lens = CAMLUX_LENS_INTRINSICS);
    fails(scene.set_camera(&camera), SCENE, "camera: fx_px is 0");
}

#[test]
fn files_and_devices_that_are_not_there_are_named() {
    let mut scene = null_mut();
    for (path, status, words) in [
        (c"/no/such.toml", SCENE, "/no/such.toml"),
        (c"\xff\xfe", ARGUMENT, "UTF-8"),
        (c"", ARGUMENT, "path is empty"),
    ] {
        // SAFETY: a string, and a pointer to a pointer.
        let loaded = unsafe { camlux_scene_load_file(path.as_ptr(), &mut scene) };
        fails(loaded, status, words);
    }
    let mut device = null_mut();
    let create = |options: camlux_device_options, device| {
        // SAFETY: a struct of that size, and a pointer to a pointer.
        unsafe { camlux_device_create(&options, device) }
    };
    let mut by_name = init!(camlux_device_options {
        choice: CAMLUX_DEVICE_NAME
    });
    fails(create(by_name, &mut device), ARGUMENT, "name is NULL");
    for (choice, name) in [
        (CAMLUX_DEVICE_NAME, c"no such GPU"),
        (CAMLUX_DEVICE_UUID, c"00112233-4455-6677-8899-aabbccddeeff"),
        (CAMLUX_DEVICE_PCI, c"ff:1f.7"),
    ] {
        (by_name.choice, by_name.name) = (choice, name.as_ptr());
        let says = name.to_str().unwrap();
        fails(create(by_name, &mut device), CAMLUX_ERROR_NO_DEVICE, says);
    }
    let by_index = init!(camlux_device_options {
        choice: CAMLUX_DEVICE_INDEX,
        index: 99
    });
    fails(create(by_index, &mut device), CAMLUX_ERROR_NO_DEVICE, "99");
    let unknown = create(with(|d| d.choice = 7), &mut device);
    fails(unknown, ARGUMENT, "choice is 7");
    let unknown = create(with(|d| d.validation = 2), &mut device);
    fails(unknown, ARGUMENT, "validation is 2");
    let mut info = init!(camlux_device_info {});
    let mut count = 0;
    // SAFETY: a struct of that size, and a pointer to a number.
    unsafe {
        let missing = camlux_device_get_info(99, &mut info);
        fails(missing, ARGUMENT, "no device 99");
        ok(camlux_device_count(&mut count));
        ok(camlux_device_get_info(0, &mut info));
    }
    assert!(count > 0 && info.name[0] != 0 && info.max_image_px > 0);
    assert!(scene.is_null() && device.is_null());
    let by_uuid = init!(camlux_device_options {
        choice: CAMLUX_DEVICE_UUID,
        name: info.uuid.as_ptr()
    });
    ok(create(by_uuid, &mut device));
    ok(camlux_device_release(device));
}

#[test]
fn renders_are_checked() {
    let device = Device::open();
    let scene = fast_scene(8);
    let renderer = device.renderer();
    let render = |change| renderer.try_render(&scene, &with(change)).map(drop);
    let never = render(|o| o.submission_target_ms = 0).unwrap_err();
    fails(never, ARGUMENT, "is 0");
    // SAFETY: NULL is refused.
    let nowhere =
        unsafe { camlux_renderer_render(renderer.raw(), scene.raw(), null(), null_mut()) };
    fails(nowhere, ARGUMENT, "frame is NULL");
    scene.resize(100_000, 8);
    let large = render(|_| ()).unwrap_err();
    fails(large, CAMLUX_ERROR_DEVICE_LIMIT, "100000");
}

#[test]
fn frames_are_checked() {
    let device = Device::open();
    let scene = fast_scene(8);
    scene.unset_sensor();
    let frame = device.renderer().render(&scene);
    for (layer, words) in [
        (CAMLUX_LAYER_ENERGY, "camlux_scene_set_sensor"),
        (CAMLUX_LAYER_TOF_RANGE, "no layer tof0.range"),
        (40, "layer is 40"),
        (-1, "layer is -1"),
    ] {
        let mut view = init!(camlux_view {});
        // SAFETY: it points to a struct of that size.
        let viewed = unsafe { camlux_frame_view(frame.raw(), layer, &mut view) };
        fails(viewed, ARGUMENT, words);
    }
    let mut room = [0.0_f32; 192];
    let to = room.as_mut_ptr().cast();
    let copy = |bytes, stride| {
        // SAFETY: the memory has at least that many bytes, or the call is refused.
        unsafe { camlux_frame_copy(frame.raw(), CAMLUX_LAYER_RADIANCE, to, bytes, stride) }
    };
    ok(copy(768, 0));
    fails(copy(767, 0), ARGUMENT, "do not fit in 767");
    fails(copy(768, 95), ARGUMENT, "a row has 96");
    fails(copy(768, 100), ARGUMENT, "do not fit");
    fails(copy(768, usize::MAX), ARGUMENT, "do not fit");
    let (mut layer, mut pass) = (0, init!(camlux_pass_time {}));
    // SAFETY: a number, and a struct of that size.
    unsafe {
        let missing = camlux_frame_get_layer(frame.raw(), 99, &mut layer);
        fails(missing, ARGUMENT, "no layer 99");
        let missing = camlux_frame_get_pass(frame.raw(), 99, &mut pass);
        fails(missing, ARGUMENT, "no pass 99");
    }
}

#[test]
fn files_of_frames_are_checked() {
    let device = Device::open();
    let scene = fast_scene(8);
    scene.unset_sensor();
    let frame = device.renderer().render(&scene);
    let exr = |path: &std::ffi::CStr, options| {
        // SAFETY: a string, and a struct of its size.
        unsafe { camlux_frame_write_exr(frame.raw(), path.as_ptr(), options) }
    };
    let png = |path: &std::ffi::CStr| {
        // SAFETY: a string.
        unsafe { camlux_frame_write_png(frame.raw(), path.as_ptr()) }
    };
    let (output, words) = (CAMLUX_ERROR_OUTPUT, "/no/such/folder");
    fails(exr(c"/no/such/folder/x.exr", null()), output, words);
    fails(png(c"/no/such/folder/x.png"), output, words);
    // A file is what its name says.
    for wrong in [c"x.jpg", c"x", c".exr", c"x.exr.png"] {
        fails(exr(wrong, null()), ARGUMENT, "end it with .exr");
    }
    for wrong in [c"x.exr", c"x.jpg"] {
        fails(png(wrong), ARGUMENT, "end it with .png");
    }
    let half = with(|o: &mut camlux_exr_options| o.half = 2);
    fails(exr(c"x.exr", &half), ARGUMENT, "half is 2");
    let nowhere = with(|o: &mut camlux_exr_options| o.layer_count = 2);
    let words = "layers is NULL, but layer_count is 2";
    fails(exr(c"x.exr", &nowhere), ARGUMENT, words);
    for (layer, words) in [
        (
            CAMLUX_LAYER_DEPTH_MEAN,
            "no layer depth_mean; set samples of camlux_camera",
        ),
        (
            CAMLUX_LAYER_ENERGY,
            "no layer energy; call camlux_scene_set_sensor",
        ),
        (
            CAMLUX_LAYER_DN,
            "no layer dn; call camlux_scene_set_sensor_noise, and set neither bayer nor monochrome of camlux_sensor",
        ),
        (
            CAMLUX_LAYER_RAW_DN,
            "no layer raw_dn; call camlux_scene_set_sensor_noise, and set bayer or monochrome of camlux_sensor",
        ),
        (
            CAMLUX_LAYER_TOF_PHASOR,
            "no layer tof0.phasor; call camlux_scene_set_tof",
        ),
        (40, "layer is 40"),
    ] {
        let layers = [CAMLUX_LAYER_DEPTH, layer];
        let options = init!(camlux_exr_options {
            layers: layers.as_ptr(),
            layer_count: 2
        });
        fails(exr(c"x.exr", &options), ARGUMENT, words);
    }
}
