//! How the C interface treats invalid handles, NULL and misaligned pointers, and structs of other versions.

use std::ptr::{null, null_mut, without_provenance_mut};

use crate::host::*;
use camlux::capi::*;

const HANDLE: i32 = CAMLUX_ERROR_INVALID_HANDLE;

/// The name of a call, and the call with a given handle and NULL for all other pointers.
type Call = (&'static str, fn(usize) -> camlux_status);

macro_rules! call {
    ($name:ident($($argument:expr),*)) => {
        (stringify!($name), |handle| {
            // SAFETY: every call checks for NULL.
            #[allow(unused_unsafe, reason = "not all are unsafe")]
            unsafe { $name(without_provenance_mut(handle) $(, $argument)*) }
        })
    };
}

fn device_calls() -> Vec<Call> {
    vec![
        call!(camlux_device_retain()),
        call!(camlux_device_info_of(null_mut())),
        call!(camlux_device_validation_count(null_mut())),
        call!(camlux_renderer_create(null_mut())),
    ]
}

fn scene_calls() -> Vec<Call> {
    vec![
        call!(camlux_scene_retain()),
        call!(camlux_scene_validate()),
        call!(camlux_scene_get_counts(null_mut())),
        call!(camlux_scene_get_bounds(null_mut())),
        call!(camlux_scene_set_camera(null())),
        call!(camlux_scene_get_camera(null_mut())),
        call!(camlux_scene_set_sensor(null())),
        call!(camlux_scene_set_indirect(null())),
        call!(camlux_scene_set_direct(null())),
        call!(camlux_scene_set_tof(null())),
        call!(camlux_scene_get_sensor(null_mut(), null_mut())),
        call!(camlux_scene_get_indirect(null_mut(), null_mut())),
        call!(camlux_scene_get_direct(null_mut())),
        call!(camlux_scene_get_tof(
            null_mut(),
            null_mut(),
            null_mut(),
            0,
            null_mut()
        )),
        call!(camlux_scene_add_texture(null(), null_mut())),
        call!(camlux_scene_add_material(null(), null_mut())),
        call!(camlux_scene_set_material(0, null())),
        call!(camlux_scene_add_mesh(null(), null_mut())),
        call!(camlux_scene_add_instance(0, null(), null_mut())),
        call!(camlux_scene_set_pose(0, 0, null())),
        call!(camlux_scene_set_poses(1, null(), 1, null(), 72)),
        call!(camlux_scene_get_pose(0, 0, null_mut())),
        call!(camlux_scene_set_visible(0, 0, 1)),
        call!(camlux_scene_get_visible(1, 0, null_mut())),
        call!(camlux_scene_remove(0, 0)),
        call!(camlux_scene_set_mesh(0, null())),
        call!(camlux_scene_set_texture(0, null())),
        call!(camlux_scene_get_material(0, null_mut())),
        call!(camlux_scene_add_light(null(), null_mut())),
        call!(camlux_scene_set_light(0, null())),
        call!(camlux_scene_get_light(0, null_mut())),
    ]
}

fn renderer_calls() -> Vec<Call> {
    vec![
        call!(camlux_renderer_retain()),
        call!(camlux_renderer_render(null_mut(), null(), null_mut())),
        call!(camlux_renderer_submit(null_mut(), null(), null_mut())),
        call!(camlux_renderer_render_cameras(
            null_mut(),
            null(),
            1,
            8,
            null(),
            null_mut()
        )),
    ]
}

fn frame_calls() -> Vec<Call> {
    vec![
        call!(camlux_frame_retain()),
        call!(camlux_frame_layer_count(null_mut())),
        call!(camlux_frame_get_layer(0, null_mut())),
        call!(camlux_frame_view(0, null_mut())),
        call!(camlux_frame_copy(0, null_mut(), 0, 0)),
        call!(camlux_frame_write_exr(null(), null())),
        call!(camlux_frame_write_png(null())),
        call!(camlux_frame_get_stats(null_mut())),
        call!(camlux_frame_get_pass(0, null_mut())),
        call!(camlux_frame_copy_to_shared(0, null_mut(), 0)),
    ]
}

fn token_calls() -> Vec<Call> {
    vec![
        call!(camlux_cancel_token_retain()),
        call!(camlux_cancel_token_cancel()),
    ]
}

fn job_calls() -> Vec<Call> {
    vec![
        call!(camlux_job_retain()),
        call!(camlux_job_poll(null_mut())),
        call!(camlux_job_wait(null_mut())),
        call!(camlux_job_wait_for(0.0, null_mut())),
    ]
}

fn shared_memory_calls() -> Vec<Call> {
    vec![
        call!(camlux_shared_memory_retain()),
        call!(camlux_shared_memory_get_info(null_mut())),
        call!(camlux_shared_memory_export_fd(null_mut())),
    ]
}

fn release_calls() -> [Call; 7] {
    [
        call!(camlux_device_release()),
        call!(camlux_scene_release()),
        call!(camlux_renderer_release()),
        call!(camlux_frame_release()),
        call!(camlux_cancel_token_release()),
        call!(camlux_job_release()),
        call!(camlux_shared_memory_release()),
    ]
}

#[test]
fn wrong_handles_are_found_out() {
    let device = Device::open();
    let (scene, renderer, token) = (fast_scene(8), device.renderer(), new_token());
    let frame = renderer.render(&scene);
    let job = renderer.try_submit(&scene, &Default::default());
    let job = job.expect("it begins");
    // SAFETY: it points to a pointer.
    let shared: Owned<camlux_shared_memory> =
        Owned::new(|memory| unsafe { camlux_shared_memory_create(device.0, 64, memory) });
    let live = [
        device.0.addr(),
        scene.raw().addr(),
        renderer.raw().addr(),
        frame.raw().addr(),
        token.raw().addr(),
        job.raw().addr(),
        shared.raw().addr(),
    ];
    // These are released below, and other objects then take their slots.
    let stale = &live[1..5];
    let calls = [
        device_calls(),
        scene_calls(),
        renderer_calls(),
        frame_calls(),
        token_calls(),
        job_calls(),
        shared_memory_calls(),
    ];
    for (kind, calls) in calls.iter().enumerate() {
        let release = release_calls()[kind];
        assert_eq!(release.1(0), CAMLUX_OK, "releasing NULL is fine");
        for (name, call) in calls.iter().chain([&release]) {
            if *name != release.0 {
                fails(call(0), HANDLE, "NULL");
            }
            for (other, &handle) in live.iter().enumerate() {
                if other != kind {
                    fails(call(handle), HANDLE, "is a camlux_");
                }
            }
            for made_up in [1, 7, 0xdead_beef, 0x7ffe_0000_1234, live[kind] ^ 1 << 32] {
                fails(call(made_up), HANDLE, "not a handle");
            }
            // A slot of the table, or a generation, that never existed.
            for made_up in [usize::MAX, live[kind] ^ 0x00ff_0000, live[kind] ^ 1 << 40] {
                fails(call(made_up), HANDLE, "released, or was never created");
            }
            assert!(last_error().starts_with(name), "{}", last_error());
        }
    }
    drop((shared, job, token, frame, renderer, scene));
    let _others = [(); 4].map(|()| new_scene());
    for &handle in stale {
        for (_, call) in scene_calls()
            .iter()
            .chain(&renderer_calls())
            .chain(&frame_calls())
            .chain(&token_calls())
        {
            assert_eq!(call(handle), HANDLE);
        }
        for (_, release) in release_calls() {
            assert_eq!(release(handle), HANDLE);
        }
    }
}

#[test]
fn references_are_counted() {
    let owned = new_scene();
    let scene = owned.raw();
    ok(camlux_scene_retain(scene));
    ok(camlux_scene_release(scene));
    ok(camlux_scene_validate(scene));
    drop(owned);
    fails(camlux_scene_release(scene), HANDLE, "has been released");
}

#[test]
fn null_arguments_are_named() {
    let scene = new_scene();
    let handle = scene.raw().addr();
    for (name, call) in scene_calls() {
        match name {
            "camlux_scene_retain" => {
                ok(call(handle));
                ok(camlux_scene_release(scene.raw()));
            }
            "camlux_scene_validate" => ok(call(handle)),
            "camlux_scene_set_visible" | "camlux_scene_remove" => {
                fails(call(handle), ARGUMENT, "part is 0");
            }
            "camlux_scene_add_instance" => fails(call(handle), ARGUMENT, "no mesh 0 among 0"),
            // These arguments are optional.
            "camlux_scene_set_sensor"
            | "camlux_scene_set_tof"
            | "camlux_scene_set_indirect"
            | "camlux_scene_set_direct" => {
                ok(call(handle));
            }
            _ => fails(call(handle), ARGUMENT, "is NULL"),
        }
    }
    // SAFETY: nulls, and a struct of that size.
    unsafe {
        let mut light = init!(camlux_light {});
        let missing = camlux_scene_get_light(scene.raw(), 0, &mut light);
        fails(missing, ARGUMENT, "no light 0 among 0");
        fails(camlux_scene_create(null_mut()), ARGUMENT, "scene is NULL");
        let nowhere = camlux_device_create(null(), null_mut());
        fails(nowhere, ARGUMENT, "device is NULL");
        fails(camlux_device_count(null_mut()), ARGUMENT, "count is NULL");
        fails(camlux_device_get_info(0, null_mut()), ARGUMENT, "is NULL");
        fails(camlux_handle_count(null_mut()), ARGUMENT, "count is NULL");
        fails(camlux_set_log(5, None, null_mut()), ARGUMENT, "level is 5");
        let unnamed = camlux_scene_load_file(null(), null_mut());
        fails(unnamed, ARGUMENT, "path is NULL");
    }
}

#[test]
fn messages_are_a_threads_own() {
    fails(camlux_scene_validate(null_mut()), HANDLE, "NULL");
    std::thread::spawn(|| assert_eq!(last_error(), ""))
        .join()
        .expect("no panic");
    // A successful call keeps the message.
    ok(camlux_scene_release(null_mut()));
    assert!(last_error().contains("NULL"));
}

/// A struct of zeros with its size: frames would share one noise, contrasts would be 0, and no light would reach the sensor.
#[test]
fn a_struct_of_zeros_is_refused() {
    /// A struct of zeros that has all members which the error of a zero would name.
    fn zeros<T: CStruct>(fill: impl FnOnce(&mut T)) -> T {
        // SAFETY: any bytes are a valid struct.
        let mut value: T = unsafe { std::mem::zeroed() };
        // SAFETY: a struct begins with its size.
        unsafe { (&raw mut value).cast::<u32>().write(size_of::<T>() as u32) };
        fill(&mut value);
        value
    }
    let scene = new_scene();
    let device = Device::open();
    let renderer = device.renderer();
    let options = zeros(|o: &mut camlux_render_options| o.submission_target_ms = 500);
    let tof = zeros(|tof: &mut camlux_tof| {
        (tof.frequency_count, tof.phase_count) = (1, 4);
        (tof.frequencies_hz[0], tof.band_weights[0]) = (20e6, 1.0);
    });
    let sensor = zeros(|sensor: &mut camlux_sensor| {
        (sensor.pixel_pitch_um, sensor.exposure_time_s) = ([10.0; 2], 1e-3);
    });
    let rendered = renderer.try_render(&scene, &options).unwrap_err();
    fails(rendered, ARGUMENT, "begin with CAMLUX_RENDER_OPTIONS_INIT");
    fails(scene.set_tof(&tof), ARGUMENT, "begin with CAMLUX_TOF_INIT");
    let words = "the camlux_sensor is not initialised";
    fails(scene.set_sensor(&sensor), ARGUMENT, words);
    let mut camera = zeros(|_: &mut camlux_camera| {});
    // SAFETY: a struct of that size.
    let found = unsafe { camlux_scene_get_camera(scene.raw(), &mut camera) };
    fails(found, ARGUMENT, "begin with CAMLUX_CAMERA_INIT");
}

#[test]
fn struct_sizes_are_checked() {
    let scene = new_scene();
    let mut room = [0_u64; 600];
    let at = room.as_mut_ptr();
    let set = |bytes: u32, beyond: u64| {
        let camera = init!(camlux_camera {
            struct_size: CAMLUX_INITIALISED | bytes,
            width_px: 77
        });
        // SAFETY: `room` is large enough for both, and for every size that is not refused.
        unsafe {
            at.cast::<camlux_camera>().write(camera);
            at.cast::<u8>()
                .add(size_of::<camlux_camera>())
                .cast::<u64>()
                .write(beyond);
            camlux_scene_set_camera(scene.raw(), at.cast())
        }
    };
    let known = size_of::<camlux_camera>() as u32;
    // The struct has 128 bytes in version 1.
    for bytes in [0, 1, 127, 4097, 1 << 30, u32::MAX] {
        fails(set(bytes, 0), ARGUMENT, "CAMLUX_CAMERA_INIT");
    }
    fails(set(known + 8, 1), ARGUMENT, "newer");
    fails(set(known + 1, 1), ARGUMENT, "newer");
    let unchanged = scene.camera().width_px;
    assert_eq!(unchanged, 640, "a call that fails changes nothing");
    ok(set(known + 8, 0));
    ok(set(known, 1));
    let camera = scene.camera();
    let size = CAMLUX_INITIALISED + known;
    assert_eq!((camera.width_px, camera.struct_size), (77, size));
    // A result struct of a newer version is filled up to the known size.
    room[..known as usize / 8 + 1].fill(u64::MAX);
    room[0] = u64::from(size + 8);
    // SAFETY: `room` has at least that size.
    ok(unsafe { camlux_scene_get_camera(scene.raw(), room.as_mut_ptr().cast()) });
    assert_eq!(room[0] as u32, size + 8);
    assert_eq!(room[known as usize / 8], u64::MAX);
}

#[test]
fn misaligned_structs_and_results_are_found_out() {
    let scene = new_scene();
    let mut room = [0_u64; 200];
    let off = room.as_mut_ptr().cast::<u8>().wrapping_add(1);
    let refused = |status| fails(status, ARGUMENT, "aligned");
    // SAFETY: misaligned pointers are refused before they are used.
    unsafe {
        refused(camlux_scene_set_camera(scene.raw(), off.cast()));
        refused(camlux_scene_get_counts(scene.raw(), off.cast()));
        let light = init!(camlux_light {});
        refused(camlux_scene_add_light(scene.raw(), &light, off.cast()));
        refused(camlux_handle_count(off.cast()));
        refused(camlux_scene_create(off.cast()));
    }
    assert_eq!(scene.counts().lights, 0);
}
