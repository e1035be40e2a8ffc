//! Values that the C interface refuses: the status, the message, and that nothing changes.

use std::ptr::{null, null_mut};

use crate::host::*;
use camlux::capi::*;

const ARGUMENT: i32 = CAMLUX_ERROR_INVALID_ARGUMENT;
const SCENE: i32 = CAMLUX_ERROR_SCENE;

#[test]
fn values_are_checked() {
    let scene = new_scene();
    // SAFETY: a struct of that size; no index requested.
    ok(unsafe { camlux_scene_add_material(scene, &init!(camlux_material {}), null_mut()) });
    let nan = f64::NAN;
    // SAFETY: structs of their size; no index requested.
    unsafe {
        let camera = |camera: camlux_camera| camlux_scene_set_camera(scene, &camera);
        fails(
            camera(init!(camlux_camera { width_px: 0 })),
            SCENE,
            "0 x 480",
        );
        fails(
            camera(init!(camlux_camera {
                distortion: [-0.1; 8]
            })),
            ARGUMENT,
            "lens has no distortion",
        );
        fails(
            camera(init!(camlux_camera { lens: 9 })),
            ARGUMENT,
            "lens is 9",
        );
        fails(
            camera(init!(camlux_camera {
                position_m: [nan, 0.0, 0.0]
            })),
            SCENE,
            "position",
        );
        fails(
            camera(init!(camlux_camera {
                look_at_m: [0.0; 3]
            })),
            SCENE,
            "look_at",
        );
        fails(
            camera(init!(camlux_camera {
                up: [0.0, 0.0, 2.0]
            })),
            SCENE,
            "parallel",
        );
        fails(
            camera(init!(camlux_camera { fov_y_deg: nan })),
            SCENE,
            "fov_y_deg",
        );
        fails(
            camera(init!(camlux_camera { fov_y_deg: 180.0 })),
            SCENE,
            "fov_y_deg",
        );
        fails(
            camera(init!(camlux_camera {
                lens: CAMLUX_LENS_INTRINSICS
            })),
            SCENE,
            "fx",
        );
        let sensor = |sensor: camlux_sensor| camlux_scene_set_sensor(scene, &sensor);
        fails(sensor(init!(camlux_sensor {})), SCENE, "pixel_pitch_um");
        fails(
            sensor(init!(camlux_sensor {
                pixel_pitch_um: [1.0; 2],
                exposure_time_s: nan
            })),
            SCENE,
            "exposure_time_s",
        );
        fails(
            sensor(init!(camlux_sensor { reserved: 1 })),
            ARGUMENT,
            "reserved",
        );
        let indirect = |indirect: camlux_indirect| camlux_scene_set_indirect(scene, &indirect);
        fails(
            indirect(init!(camlux_indirect { estimator: 3 })),
            ARGUMENT,
            "estimator is 3",
        );
        fails(
            indirect(init!(camlux_indirect { reserved: 1 })),
            ARGUMENT,
            "reserved",
        );
        fails(
            indirect(init!(camlux_indirect { stderr_layer: 2 })),
            ARGUMENT,
            "stderr_layer is 2; give 0 or 1",
        );
        fails(
            indirect(init!(camlux_indirect { error_norm: 2 })),
            ARGUMENT,
            "error_norm is 2; give one of CAMLUX_NORM_IMAGE (0), CAMLUX_NORM_LOCAL (1)",
        );
        fails(
            indirect(init!(camlux_indirect { target_error: nan })),
            SCENE,
            "target_error",
        );
        fails(
            indirect(init!(camlux_indirect { target_error: 0.6 })),
            SCENE,
            "target_error",
        );
        fails(
            indirect(init!(camlux_indirect { max_ms: -1.0 })),
            SCENE,
            "max_ms is -1; give finite milliseconds above 0",
        );
        fails(
            indirect(init!(camlux_indirect { max_ms: nan })),
            SCENE,
            "max_ms is NaN",
        );
        fails(
            indirect(init!(camlux_indirect {
                interpolation_error: nan
            })),
            SCENE,
            "interpolation_error",
        );
        for estimator in [
            CAMLUX_ESTIMATOR_RSM_AVERAGE,
            CAMLUX_ESTIMATOR_INSTANT_RADIOSITY,
        ] {
            let without_size = init!(camlux_indirect {
                estimator: estimator
            });
            ok(indirect(without_size));
            let sum = init!(camlux_indirect {
                estimator: estimator,
                rsm_size: 8,
                target_error: 0.05
            });
            fails(indirect(sum), SCENE, "target_error is 0.05");
            let sum = init!(camlux_indirect {
                estimator: estimator,
                rsm_size: 8
            });
            let with_norm = camlux_indirect {
                error_norm: CAMLUX_NORM_LOCAL,
                ..sum
            };
            fails(indirect(with_norm), SCENE, "error_norm is 1, but");
            let with_ms = camlux_indirect { max_ms: 9.0, ..sum };
            fails(indirect(with_ms), SCENE, "max_ms is 9, but");
            let with_range = camlux_indirect {
                target_range_error_mm: 9.0,
                ..sum
            };
            fails(
                indirect(with_range),
                SCENE,
                "target_range_error_mm is 9, but",
            );
            let with_rays = camlux_indirect { max_rays: 9, ..sum };
            fails(indirect(with_rays), SCENE, "max_rays is 9, but");
            let with_stderr = camlux_indirect {
                stderr_layer: 1,
                ..sum
            };
            fails(indirect(with_stderr), SCENE, "stderr_layer is 1, but");
        }
        for estimator in [
            CAMLUX_ESTIMATOR_FINAL_GATHER,
            CAMLUX_ESTIMATOR_INSTANT_RADIOSITY,
        ] {
            let not_interpolated = init!(camlux_indirect {
                estimator: estimator,
                rsm_size: 8,
                interpolation_error: 0.05
            });
            fails(
                indirect(not_interpolated),
                SCENE,
                "interpolation_error is 0.05",
            );
        }
        fails(
            camlux_scene_set_direct(scene, &init!(camlux_direct { shadow: 3 })),
            ARGUMENT,
            "shadow is 3",
        );
        let light = |light: camlux_light| camlux_scene_add_light(scene, &light, null_mut());
        fails(
            light(init!(camlux_light { kind: 9 })),
            ARGUMENT,
            "kind is 9",
        );
        fails(
            light(init!(camlux_light { power_w: [nan; 3] })),
            SCENE,
            "power_w",
        );
        fails(
            light(init!(camlux_light { power_w: [-1.0; 3] })),
            SCENE,
            "power_w",
        );
        fails(
            light(init!(camlux_light {
                position_m: [f64::INFINITY; 3]
            })),
            SCENE,
            "position",
        );
        fails(
            light(init!(camlux_light {
                kind: CAMLUX_LIGHT_DIRECTIONAL
            })),
            SCENE,
            "direction",
        );
        let direction = [0.0, 0.0, 1.0];
        fails(
            light(init!(camlux_light {
                kind: CAMLUX_LIGHT_SPOT,
                direction: direction
            })),
            SCENE,
            "outer",
        );
        fails(
            camlux_scene_set_light(scene, 0, &init!(camlux_light {})),
            ARGUMENT,
            "no light 0 among 0",
        );
        let material =
            |material: camlux_material| camlux_scene_add_material(scene, &material, null_mut());
        fails(
            material(init!(camlux_material { kd: [nan; 3] })),
            SCENE,
            "kd",
        );
        fails(
            material(init!(camlux_material { kd: [1.5; 3] })),
            SCENE,
            "kd",
        );
        fails(
            material(init!(camlux_material { ks: [0.5; 3] })),
            SCENE,
            "shininess",
        );
        fails(
            material(init!(camlux_material { kd_texture: 1 })),
            SCENE,
            "kd_texture",
        );
        fails(
            camlux_scene_set_material(scene, 1, &init!(camlux_material {})),
            ARGUMENT,
            "material 1 among 1",
        );
        let pose =
            |part, index, pose: camlux_pose| camlux_scene_set_pose(scene, part, index, &pose);
        fails(pose(3, 0, init!(camlux_pose {})), ARGUMENT, "part is 3");
        fails(
            pose(CAMLUX_PART_CAMERA, 1, init!(camlux_pose {})),
            ARGUMENT,
            "index 0",
        );
        fails(
            pose(CAMLUX_PART_LIGHT, 0, init!(camlux_pose {})),
            ARGUMENT,
            "no light 0",
        );
        fails(
            pose(CAMLUX_PART_INSTANCE, 7, init!(camlux_pose {})),
            ARGUMENT,
            "no instance 7",
        );
        fails(
            pose(
                0,
                0,
                init!(camlux_pose {
                    orientation_xyzw: [0.0; 4]
                }),
            ),
            SCENE,
            "unit quaternion",
        );
        fails(
            pose(
                0,
                0,
                init!(camlux_pose {
                    orientation_xyzw: [nan; 4]
                }),
            ),
            SCENE,
            "unit quaternion",
        );
        fails(
            pose(
                0,
                0,
                init!(camlux_pose {
                    position_m: [nan; 3]
                }),
            ),
            SCENE,
            "finite",
        );
        fails(
            pose(
                0,
                0,
                init!(camlux_pose {
                    position_m: [1e13; 3]
                }),
            ),
            SCENE,
            "position",
        );
        fails(
            pose(0, 0, init!(camlux_pose { reserved: 1 })),
            ARGUMENT,
            "reserved",
        );
    }
    ok(camlux_scene_release(scene));
}

/// A call that would move an instance out of range fails and names the instance.
#[test]
fn an_instance_too_far_out_is_named() {
    let scene = load("cornell");
    let mut counts = init!(camlux_scene_counts {});
    // SAFETY: structs of their size; no index requested.
    unsafe {
        ok(camlux_scene_get_counts(scene, &mut counts));
        let last = counts.instances - 1;
        let at = |x| {
            init!(camlux_pose {
                position_m: [x, 0.0, 0.0]
            })
        };
        let words = format!("instance {last}: position_m is [1e30, 0, 0]");
        let moved = camlux_scene_set_pose(scene, CAMLUX_PART_INSTANCE, last, &at(1e30));
        fails(
            moved,
            SCENE,
            &words.replace("1e30", "1000000000000000000000000000000"),
        );
        // The position is in range, but a corner of the instance's box is not.
        let edge = at(1e12);
        let moved = camlux_scene_set_pose(scene, CAMLUX_PART_INSTANCE, last, &edge);
        fails(
            moved,
            SCENE,
            &format!("instance {last}: a corner of its box is"),
        );
        let added = camlux_scene_add_instance(scene, 0, &edge, null_mut());
        fails(
            added,
            SCENE,
            &format!("instance {}: a corner", counts.instances),
        );
        ok(camlux_scene_set_pose(
            scene,
            CAMLUX_PART_INSTANCE,
            last,
            &at(9e11),
        ));
        ok(camlux_scene_validate(scene));
        let mut after = counts;
        ok(camlux_scene_get_counts(scene, &mut after));
        assert_eq!(after.instances, counts.instances);
    }
    ok(camlux_scene_release(scene));
}

/// Messages use the words of the C interface, not the keys of a scene file.
#[test]
fn messages_have_the_words_of_c() {
    let scene = new_scene();
    let textured = init!(camlux_material { kd_texture: 3 });
    let intrinsics = init!(camlux_camera {
        lens: CAMLUX_LENS_INTRINSICS
    });
    // SAFETY: structs of their size; no index requested.
    unsafe {
        fails(
            camlux_scene_add_material(scene, &textured, null_mut()),
            SCENE,
            "kd_texture is 3, but the number of textures is 0; give what camlux_scene_add_texture gave",
        );
        fails(
            camlux_scene_set_camera(scene, &intrinsics),
            SCENE,
            "camera: fx_px is 0",
        );
    }
    ok(camlux_scene_release(scene));
}

#[test]
fn files_and_devices_that_are_not_there_are_named() {
    let mut scene = null_mut();
    let mut device = null_mut();
    let mut info = init!(camlux_device_info {});
    // SAFETY: strings, structs of their size, and pointers to pointers.
    unsafe {
        fails(
            camlux_scene_load_file(c"/no/such.toml".as_ptr(), &mut scene),
            SCENE,
            "/no/such.toml",
        );
        fails(
            camlux_scene_load_file(c"\xff\xfe".as_ptr(), &mut scene),
            ARGUMENT,
            "UTF-8",
        );
        fails(
            camlux_scene_load_file(c"".as_ptr(), &mut scene),
            ARGUMENT,
            "path is empty",
        );
        let create =
            |options: camlux_device_options, device| camlux_device_create(&options, device);
        let by_name = init!(camlux_device_options {
            choice: CAMLUX_DEVICE_NAME
        });
        fails(create(by_name, &mut device), ARGUMENT, "name is NULL");
        let by_name = init!(camlux_device_options {
            choice: CAMLUX_DEVICE_NAME,
            name: c"no such GPU".as_ptr()
        });
        fails(
            create(by_name, &mut device),
            CAMLUX_ERROR_NO_DEVICE,
            "no such GPU",
        );
        for (choice, name) in [
            (CAMLUX_DEVICE_UUID, c"00112233-4455-6677-8899-aabbccddeeff"),
            (CAMLUX_DEVICE_PCI, c"ff:1f.7"),
        ] {
            let options = init!(camlux_device_options {
                choice: choice,
                name: name.as_ptr()
            });
            let says = name.to_str().unwrap();
            fails(create(options, &mut device), CAMLUX_ERROR_NO_DEVICE, says);
        }
        let by_index = init!(camlux_device_options {
            choice: CAMLUX_DEVICE_INDEX,
            index: 99
        });
        fails(create(by_index, &mut device), CAMLUX_ERROR_NO_DEVICE, "99");
        fails(
            create(init!(camlux_device_options { choice: 7 }), &mut device),
            ARGUMENT,
            "choice is 7",
        );
        fails(
            create(init!(camlux_device_options { validation: 2 }), &mut device),
            ARGUMENT,
            "validation is 2",
        );
        fails(
            camlux_device_get_info(99, &mut info),
            ARGUMENT,
            "no device 99",
        );
        let mut count = 0;
        ok(camlux_device_count(&mut count));
        assert!(count > 0);
        ok(camlux_device_get_info(0, &mut info));
        assert!(info.name[0] != 0 && info.max_image_px > 0);
        let mut same = null_mut();
        let by_uuid = init!(camlux_device_options {
            choice: CAMLUX_DEVICE_UUID,
            name: info.uuid.as_ptr()
        });
        ok(create(by_uuid, &mut same));
        camlux_device_release(same);
    }
    assert!(scene.is_null() && device.is_null());
}

#[test]
fn frames_are_checked() {
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, 8, 8);
    plain_sum(scene, 8);
    let renderer = device.renderer();
    let mut frame = null_mut();
    // SAFETY: structs of their size, and memory of at least the size that each call says.
    unsafe {
        let render = |options: camlux_render_options, frame| {
            camlux_renderer_render(renderer, scene, &options, frame)
        };
        fails(
            render(
                init!(camlux_render_options {
                    submission_target_ms: 0
                }),
                &mut frame,
            ),
            ARGUMENT,
            "is 0",
        );
        fails(
            render(init!(camlux_render_options {}), null_mut()),
            ARGUMENT,
            "frame is NULL",
        );
        resize(scene, 100_000, 8);
        fails(
            camlux_renderer_render(renderer, scene, null(), &mut frame),
            CAMLUX_ERROR_DEVICE_LIMIT,
            "100000",
        );
        assert!(frame.is_null());
        resize(scene, 8, 8);
        ok(camlux_scene_set_sensor(scene, null()));
        frame = crate::host::render(renderer, scene);
        let mut view = init!(camlux_view {});
        fails(
            camlux_frame_view(frame, CAMLUX_LAYER_ENERGY, &mut view),
            ARGUMENT,
            "camlux_scene_set_sensor",
        );
        fails(
            camlux_frame_view(frame, CAMLUX_LAYER_TOF_RANGE, &mut view),
            ARGUMENT,
            "no layer tof0.range",
        );
        fails(
            camlux_frame_view(frame, 15, &mut view),
            ARGUMENT,
            "layer is 15",
        );
        fails(
            camlux_frame_view(frame, -1, &mut view),
            ARGUMENT,
            "layer is -1",
        );
        let mut room = [0.0_f32; 192];
        let to = room.as_mut_ptr().cast();
        let copy =
            |bytes, stride| camlux_frame_copy(frame, CAMLUX_LAYER_RADIANCE, to, bytes, stride);
        ok(copy(768, 0));
        fails(copy(767, 0), ARGUMENT, "do not fit in 767");
        fails(copy(768, 95), ARGUMENT, "a row has 96");
        fails(copy(768, 100), ARGUMENT, "do not fit");
        fails(copy(768, usize::MAX), ARGUMENT, "do not fit");
        let mut layer = 0;
        fails(
            camlux_frame_get_layer(frame, 99, &mut layer),
            ARGUMENT,
            "no layer 99",
        );
        let mut pass = init!(camlux_pass_time {});
        fails(
            camlux_frame_get_pass(frame, 99, &mut pass),
            ARGUMENT,
            "no pass 99",
        );
        let path = c"/no/such/folder/x.exr".as_ptr();
        fails(
            camlux_frame_write_exr(frame, path, null()),
            CAMLUX_ERROR_OUTPUT,
            "/no/such/folder",
        );
        fails(
            camlux_frame_write_png(frame, c"/no/such/folder/x.png".as_ptr()),
            CAMLUX_ERROR_OUTPUT,
            "/no/such/folder",
        );
        // A file is what its name says.
        for wrong in [c"x.jpg", c"x", c".exr", c"x.exr.png"] {
            fails(
                camlux_frame_write_exr(frame, wrong.as_ptr(), null()),
                ARGUMENT,
                "end it with .exr",
            );
        }
        for wrong in [c"x.exr", c"x.jpg"] {
            fails(
                camlux_frame_write_png(frame, wrong.as_ptr()),
                ARGUMENT,
                "end it with .png",
            );
        }
        let exr = |options: camlux_exr_options| {
            camlux_frame_write_exr(frame, c"x.exr".as_ptr(), &options)
        };
        fails(
            exr(init!(camlux_exr_options { half: 2 })),
            ARGUMENT,
            "half is 2",
        );
        fails(
            exr(init!(camlux_exr_options { layer_count: 2 })),
            ARGUMENT,
            "layers is NULL, but layer_count is 2",
        );
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
            fails(exr(options), ARGUMENT, words);
        }
    }
    ok(camlux_frame_release(frame));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}
