//! Lights that move with the camera, lights that are removed, and lamps that are all off.

use std::ptr::null_mut;

use crate::host::*;
use camlux::{
    Scene,
    capi::*,
    glam::{DQuat, DVec3},
    scene::{Carrier, Light},
};

const ARGUMENT: camlux_status = CAMLUX_ERROR_INVALID_ARGUMENT;

/// The corner, whose light is at the lens, without indirect light.
fn corner() -> Scene {
    let path = scene_file("tof_corner");
    let path = path.to_str().expect("a UTF-8 path");
    let mut scene = Scene::load(path.as_ref()).expect("a demo scene loads");
    scene.camera.resolution_px = [16, 12];
    scene.indirect = None;
    scene
}

fn light_of(scene: *mut camlux_scene, index: u32) -> camlux_light {
    let mut light = init!(camlux_light {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_light(scene, index, &mut light) });
    light
}

fn pose_of(scene: *mut camlux_scene, part: i32) -> camlux_pose {
    let mut pose = init!(camlux_pose {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_pose(scene, part, 0, &mut pose) });
    pose
}

fn set_pose(scene: *mut camlux_scene, part: i32, position_m: [f64; 3], orientation: DQuat) {
    let pose = init!(camlux_pose {
        position_m: position_m,
        orientation_xyzw: orientation.to_array(),
    });
    // SAFETY: a struct of that size.
    ok(unsafe { camlux_scene_set_pose(scene, part, 0, &pose) });
}

fn add(scene: *mut camlux_scene, light: &camlux_light) -> u32 {
    let mut index = u32::MAX;
    // SAFETY: a struct of that size, and a pointer to a number.
    ok(unsafe { camlux_scene_add_light(scene, light, &mut index) });
    index
}

#[test]
fn a_light_of_the_camera_moves_with_it() {
    let device = Device::open();
    let renderer = device.renderer();
    let mut expected = corner();
    // The light of the file, and the same from numbers.
    for scene in [load("tof_corner"), from_arrays(&expected)] {
        resize(scene, 16, 12);
        // SAFETY: NULL is allowed.
        ok(unsafe { camlux_scene_set_indirect(scene, std::ptr::null()) });
        let mut light = light_of(scene, 0);
        assert_eq!(light.relative_to, CAMLUX_RELATIVE_TO_CAMERA);
        assert_eq!(light.position_m, [0.0; 3]);
        light.position_m = [0.1, -0.2, 0.3];
        // SAFETY: a struct of that size.
        ok(unsafe { camlux_scene_set_light(scene, 0, &light) });

        let turn = pose_of(scene, CAMLUX_PART_CAMERA).orientation_xyzw;
        let turn = DQuat::from_rotation_y(0.2) * DQuat::from_array(turn);
        let camera_m = DVec3::new(1.7, 1.4, 1.8);
        set_pose(scene, CAMLUX_PART_CAMERA, camera_m.to_array(), turn);
        let world_m = camera_m + turn * DVec3::from(light.position_m);
        let seen = pose_of(scene, CAMLUX_PART_LIGHT).position_m;
        assert!(DVec3::from(seen).distance(world_m) < 1e-12, "{seen:?}");
        let carried = render(renderer, scene);

        // A pose in the world ends it, and stays to the last digit when the camera moves.
        set_pose(scene, CAMLUX_PART_LIGHT, seen, DQuat::IDENTITY);
        assert_eq!(light_of(scene, 0).relative_to, CAMLUX_RELATIVE_TO_WORLD);
        let fixed = render(renderer, scene);
        assert!(layers(carried) == layers(fixed));
        set_pose(scene, CAMLUX_PART_LIGHT, [9.0; 3], DQuat::IDENTITY);
        set_pose(scene, CAMLUX_PART_CAMERA, [1.6, 1.3, 1.9], turn);
        assert_eq!(light_of(scene, 0).position_m, [9.0; 3]);
        for frame in [carried, fixed] {
            ok(camlux_frame_release(frame));
        }

        light.relative_to = 2;
        // SAFETY: a struct of that size.
        let unknown = unsafe { camlux_scene_set_light(scene, 0, &light) };
        fails(unknown, ARGUMENT, "relative_to is 2");
        ok(camlux_scene_release(scene));
    }

    // Each camera of one call carries the light.
    let scene = from_arrays(&expected);
    let mut camera = init!(camlux_camera {});
    // SAFETY: it points to a struct of that size.
    ok(unsafe { camlux_scene_get_camera(scene, &mut camera) });
    let mut cameras = [camera; 2];
    cameras[1].position_m[0] -= 0.3;
    let mut frames = [null_mut(); 2];
    // SAFETY: the arrays have that length.
    ok(unsafe {
        camlux_renderer_render_cameras(
            renderer,
            scene,
            cameras.as_ptr(),
            2,
            size_of::<camlux_camera>(),
            std::ptr::null(),
            frames.as_mut_ptr(),
        )
    });
    for (camera, frame) in cameras.iter().zip(frames) {
        expected.camera.position_m = camera.position_m.into();
        let mut fixed = expected.clone();
        assert_eq!(fixed.lights[0].relative_to, Some(Carrier::Camera));
        fixed.lights[0] = Light::point(camera.position_m.into(), [1.0; 3]).into();
        let fixed = from_arrays(&fixed);
        let alone = render(renderer, fixed);
        assert!(layers(frame) == layers(alone));
        for frame in [frame, alone] {
            ok(camlux_frame_release(frame));
        }
        ok(camlux_scene_release(fixed));
    }
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}

/// A new light that takes the index of a removed one is modulated, even if time of flight was set between.
#[test]
fn a_new_light_inherits_nothing() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = from_arrays(&corner());
    let mut light = light_of(scene, 0);
    let second = add(scene, &light);
    ok(camlux_scene_remove(scene, CAMLUX_PART_LIGHT, second));
    let mut tof = corner().tof.expect("it has one");
    tof.ambient_lights = vec![second as usize];
    set_tof(scene, &tof);
    let amplitude = |scene| {
        let frame = render(renderer, scene);
        let view = view(frame, CAMLUX_LAYER_TOF_AMPLITUDE);
        // SAFETY: the view has at least one value.
        let first = f64::from(unsafe { *view.data.cast::<f32>() });
        ok(camlux_frame_release(frame));
        first
    };
    let alone = amplitude(scene);
    light.power_w = [2.0; 3];
    assert_eq!(add(scene, &light), second);
    let both = amplitude(scene);
    assert!((both / alone - 3.0).abs() < 1e-3, "{alone} {both}");
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}

#[test]
fn lamps_that_are_off_leave_depth_and_ids() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load("tof_corner");
    resize(scene, 16, 12);
    let lit = render(renderer, scene);
    let visible = |is| ok(camlux_scene_set_visible(scene, CAMLUX_PART_LIGHT, 0, is));
    let removed = |_| ok(camlux_scene_remove(scene, CAMLUX_PART_LIGHT, 0));
    let black = |_| {
        let mut light = light_of(scene, 0);
        light.power_w = [0.0; 3];
        // SAFETY: a struct of that size.
        ok(unsafe { camlux_scene_set_light(scene, 0, &light) });
    };
    let turn_off: [&dyn Fn(i32); 3] = [&visible, &black, &removed];
    for off in turn_off {
        off(0);
        ok(camlux_scene_validate(scene));
        let dark = render(renderer, scene);
        for ((layer, values), (_, before)) in layers(dark).iter().zip(layers(lit)) {
            match *layer {
                CAMLUX_LAYER_DEPTH | CAMLUX_LAYER_INSTANCE_ID | CAMLUX_LAYER_NORMAL => {
                    assert!(*values == before, "{layer}");
                }
                CAMLUX_LAYER_RADIANCE | CAMLUX_LAYER_INDIRECT | CAMLUX_LAYER_TOF_AMPLITUDE => {
                    assert!(values.iter().all(|&bits| bits == 0), "{layer}");
                }
                CAMLUX_LAYER_TOF_RANGE => {
                    let is_nan = |&bits: &u32| f32::from_bits(bits).is_nan();
                    assert!(values.iter().all(is_nan));
                }
                _ => {}
            }
        }
        let estimate = stats(dark).estimated_error;
        assert!(estimate.is_nan() && stats(dark).ray_count == 0);
        ok(camlux_frame_release(dark));
    }
    ok(camlux_frame_release(lit));
    ok(camlux_scene_release(scene));
    ok(camlux_renderer_release(renderer));
}
