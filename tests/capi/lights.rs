//! Lights that move with the camera, lights that are removed, and lamps that are all off.

use crate::host::*;
use camlux::{
    capi::*,
    glam::{DQuat, DVec3},
    scene::{Carrier, Light},
};

/// The corner, whose light is at the lens, without indirect light.
fn corner() -> camlux::Scene {
    let mut scene = engine_scene("tof_corner", [16, 12]);
    scene.indirect = None;
    scene
}

#[test]
fn a_light_of_the_camera_moves_with_it() {
    let device = Device::open();
    let renderer = device.renderer();
    let mut expected = corner();
    // The light of the file, and the same from numbers.
    for scene in [load("tof_corner"), from_arrays(&expected)] {
        scene.resize(16, 12);
        scene.unset_indirect();
        let mut light = scene.light(0);
        assert_eq!(light.relative_to, CAMLUX_RELATIVE_TO_CAMERA);
        assert_eq!(light.position_m, [0.0; 3]);
        light.position_m = [0.1, -0.2, 0.3];
        ok(scene.set_light(0, &light));

        let turn = scene.pose(CAMLUX_PART_CAMERA, 0).orientation_xyzw;
        let turn = DQuat::from_rotation_y(0.2) * DQuat::from_array(turn);
        let camera_m = DVec3::new(1.7, 1.4, 1.8);
        scene.place(CAMLUX_PART_CAMERA, 0, camera_m, turn);
        let world_m = camera_m + turn * DVec3::from(light.position_m);
        let seen = DVec3::from(scene.pose(CAMLUX_PART_LIGHT, 0).position_m);
        assert!(seen.distance(world_m) < 1e-12, "{seen:?}");
        let carried = renderer.render(&scene);

        // A pose in the world ends it, and stays to the last digit when the camera moves.
        scene.place(CAMLUX_PART_LIGHT, 0, seen, DQuat::IDENTITY);
        assert_eq!(scene.light(0).relative_to, CAMLUX_RELATIVE_TO_WORLD);
        let fixed = renderer.render(&scene);
        assert!(carried.layers() == fixed.layers());
        let (far_m, near_m) = (DVec3::splat(9.0), DVec3::new(1.6, 1.3, 1.9));
        scene.place(CAMLUX_PART_LIGHT, 0, far_m, DQuat::IDENTITY);
        scene.place(CAMLUX_PART_CAMERA, 0, near_m, turn);
        assert_eq!(scene.light(0).position_m, [9.0; 3]);

        light.relative_to = 2;
        fails(scene.set_light(0, &light), ARGUMENT, "relative_to is 2");
    }

    // Each camera of one call carries the light.
    let scene = from_arrays(&expected);
    let camera = scene.camera();
    let mut cameras = [camera; 2];
    cameras[1].position_m[0] -= 0.3;
    let frames = renderer.render_cameras(&scene, &cameras, &Default::default());
    for (camera, frame) in cameras.iter().zip(frames.expect("they render")) {
        expected.camera.position_m = camera.position_m.into();
        let mut fixed = expected.clone();
        assert_eq!(fixed.lights[0].relative_to, Some(Carrier::Camera));
        fixed.lights[0] = Light::point(camera.position_m.into(), [1.0; 3]).into();
        let fixed = from_arrays(&fixed);
        let alone = renderer.render(&fixed);
        assert!(frame.layers() == alone.layers());
    }
}

/// A new light that takes the index of a removed one is modulated, even if time of flight was set between.
#[test]
fn a_new_light_inherits_nothing() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = from_arrays(&corner());
    let mut light = scene.light(0);
    let second = scene.add_light(&light).expect("it is added");
    ok(camlux_scene_remove(scene.raw(), CAMLUX_PART_LIGHT, second));
    let mut tof = corner().tof.expect("it has one");
    tof.ambient_lights = vec![second as usize];
    set_tof(&scene, &tof);
    let amplitude = || {
        let frame = renderer.render(&scene);
        f64::from(f32::from_bits(frame.words(CAMLUX_LAYER_TOF_AMPLITUDE)[0]))
    };
    let alone = amplitude();
    light.power_w = [2.0; 3];
    assert_eq!(scene.add_light(&light), Ok(second));
    let both = amplitude();
    assert!((both / alone - 3.0).abs() < 1e-3, "{alone} {both}");
}

#[test]
fn lamps_that_are_off_leave_depth_and_ids() {
    let device = Device::open();
    let renderer = device.renderer();
    let scene = load_at("tof_corner", [16, 12]);
    let lit = renderer.render(&scene);
    let visible = |is| {
        ok(camlux_scene_set_visible(
            scene.raw(),
            CAMLUX_PART_LIGHT,
            0,
            is,
        ))
    };
    let removed = |_| ok(camlux_scene_remove(scene.raw(), CAMLUX_PART_LIGHT, 0));
    let black = |_| {
        let mut light = scene.light(0);
        light.power_w = [0.0; 3];
        ok(scene.set_light(0, &light));
    };
    let turn_off: [&dyn Fn(i32); 3] = [&visible, &black, &removed];
    for off in turn_off {
        off(0);
        ok(scene.validate());
        let dark = renderer.render(&scene);
        for ((layer, values), (_, before)) in dark.layers().iter().zip(lit.layers()) {
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
        let estimate = dark.stats().estimated_error;
        assert!(estimate.is_nan() && dark.stats().ray_count == 0);
    }
}
