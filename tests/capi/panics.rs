//! Panics inside of calls.

use std::{
    panic::{self, panic_any},
    ptr::{null, null_mut},
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
    thread,
};

use crate::host::*;
use camlux::capi::*;

type Call = (&'static str, fn() -> camlux_status);

/// The name of each call, and the call with NULL for all pointers.
macro_rules! calls {
    ($($name:ident($($argument:expr),*)),* $(,)?) => {
        [$((stringify!($name), || {
            // SAFETY: every call checks for NULL.
            #[allow(unused_unsafe, reason = "not all are unsafe")]
            unsafe { $name($($argument),*) }
        })),*]
    };
}

#[test]
fn a_panic_in_any_call_becomes_a_status() {
    let calls: [Call; 82] = calls![
        camlux_set_log(0, None, null_mut()),
        camlux_handle_count(null_mut()),
        camlux_device_retain(null_mut()),
        camlux_device_release(null_mut()),
        camlux_device_count(null_mut()),
        camlux_device_get_info(0, null_mut()),
        camlux_device_create(null(), null_mut()),
        camlux_device_info_of(null_mut(), null_mut()),
        camlux_device_validation_count(null_mut(), null_mut()),
        camlux_scene_retain(null_mut()),
        camlux_scene_release(null_mut()),
        camlux_scene_create(null_mut()),
        camlux_scene_load_file(null(), null_mut()),
        camlux_scene_validate(null_mut()),
        camlux_scene_get_counts(null_mut(), null_mut()),
        camlux_scene_get_bounds(null_mut(), null_mut()),
        camlux_scene_set_camera(null_mut(), null()),
        camlux_scene_get_camera(null_mut(), null_mut()),
        camlux_scene_set_sensor(null_mut(), null()),
        camlux_scene_set_sensor_noise(null_mut(), null()),
        camlux_scene_set_vignetting_map(null_mut(), null()),
        camlux_scene_set_indirect(null_mut(), null()),
        camlux_scene_set_direct(null_mut(), null()),
        camlux_scene_set_tof(null_mut(), null()),
        camlux_scene_get_sensor(null_mut(), null_mut(), null_mut()),
        camlux_scene_get_sensor_noise(null_mut(), null_mut(), null_mut()),
        camlux_scene_get_indirect(null_mut(), null_mut(), null_mut()),
        camlux_scene_get_direct(null_mut(), null_mut()),
        camlux_scene_get_tof(
            null_mut(),
            null_mut(),
            null_mut(),
            null_mut(),
            0,
            null_mut()
        ),
        camlux_scene_get_visible(null_mut(), 0, 0, null_mut()),
        camlux_scene_add_texture(null_mut(), null(), null_mut()),
        camlux_scene_add_material(null_mut(), null(), null_mut()),
        camlux_scene_set_material(null_mut(), 0, null()),
        camlux_scene_add_mesh(null_mut(), null(), null_mut()),
        camlux_scene_add_instance(null_mut(), 0, null(), null_mut()),
        camlux_scene_set_pose(null_mut(), 0, 0, null()),
        camlux_scene_set_poses(null_mut(), 0, null(), 0, null(), 0),
        camlux_scene_get_pose(null_mut(), 0, 0, null_mut()),
        camlux_scene_set_visible(null_mut(), 0, 0, 1),
        camlux_scene_remove(null_mut(), 0, 0),
        camlux_scene_set_mesh(null_mut(), 0, null()),
        camlux_scene_set_texture(null_mut(), 0, null()),
        camlux_scene_get_material(null_mut(), 0, null_mut()),
        camlux_scene_add_light(null_mut(), null(), null_mut()),
        camlux_scene_set_light(null_mut(), 0, null()),
        camlux_scene_get_light(null_mut(), 0, null_mut()),
        camlux_renderer_retain(null_mut()),
        camlux_renderer_release(null_mut()),
        camlux_renderer_create(null_mut(), null_mut()),
        camlux_renderer_render(null_mut(), null_mut(), null(), null_mut()),
        camlux_renderer_foretell_ms(null_mut(), null_mut(), null_mut()),
        camlux_renderer_prepare(null_mut(), null_mut(), null_mut()),
        camlux_pose_from_matrix(null(), 0, 0, null_mut()),
        camlux_renderer_render_cameras(null_mut(), null_mut(), null(), 0, 0, null(), null_mut()),
        camlux_renderer_submit(null_mut(), null_mut(), null(), null_mut()),
        camlux_job_poll(null_mut(), null_mut()),
        camlux_job_wait(null_mut(), null_mut()),
        camlux_job_wait_for(null_mut(), 0.0, null_mut()),
        camlux_job_retain(null_mut()),
        camlux_job_release(null_mut()),
        camlux_cancel_token_create(null_mut()),
        camlux_cancel_token_cancel(null_mut()),
        camlux_cancel_token_retain(null_mut()),
        camlux_cancel_token_release(null_mut()),
        camlux_frame_retain(null_mut()),
        camlux_frame_release(null_mut()),
        camlux_frame_layer_count(null_mut(), null_mut()),
        camlux_frame_get_layer(null_mut(), 0, null_mut()),
        camlux_frame_view(null_mut(), 0, null_mut()),
        camlux_frame_copy(null_mut(), 0, null_mut(), 0, 0),
        camlux_frame_write_exr(null_mut(), null(), null()),
        camlux_frame_write_png(null_mut(), null()),
        camlux_frame_get_stats(null_mut(), null_mut()),
        camlux_frame_get_pass(null_mut(), 0, null_mut()),
        camlux_device_create_from_vulkan(null(), null_mut()),
        camlux_frame_get_vulkan_image(null_mut(), 0, null_mut()),
        camlux_frame_copy_to_shared(null_mut(), 0, null_mut(), 0),
        camlux_shared_memory_create(null_mut(), 0, null_mut()),
        camlux_shared_memory_get_info(null_mut(), null_mut()),
        camlux_shared_memory_export_fd(null_mut(), null_mut()),
        camlux_shared_memory_retain(null_mut()),
        camlux_shared_memory_release(null_mut()),
    ];
    for (name, call) in calls {
        let status = with_panic(|| panic!("asked for by a test"), call);
        assert_eq!(status, CAMLUX_ERROR_INTERNAL, "{name}");
        let message = last_error();
        assert!(message.starts_with(&format!("{name}: internal error: asked for by a test")));
    }
    // The list has every function of the header.
    let header = include_str!("../../include/camlux.h");
    let declared = header
        .lines()
        .filter(|line| line.starts_with("camlux_status camlux_"));
    assert_eq!(declared.count(), calls.len());
}

/// Makes a call that runs `hook` first, which panics.
fn with_panic(hook: fn(), call: fn() -> camlux_status) -> camlux_status {
    before_each_call(hook);
    let status = call();
    before_each_call(|| ());
    status
}

fn validate() -> camlux_status {
    camlux_scene_validate(null_mut())
}

#[test]
fn a_panic_with_any_payload_is_caught() {
    let formatted = with_panic(|| panic!("{} things", 2), validate);
    fails(formatted, CAMLUX_ERROR_INTERNAL, "2 things");
    let odd = with_panic(|| panic_any(7_u8), validate);
    fails(odd, CAMLUX_ERROR_INTERNAL, "a panic");
}

/// The process's panic hook also runs for a panic inside a call.
#[test]
fn the_panic_hook_stays() {
    static HEARD: AtomicU32 = AtomicU32::new(0);
    let here = thread::current().id();
    let before = Arc::new(panic::take_hook());
    let others = before.clone();
    panic::set_hook(Box::new(move |info| {
        if thread::current().id() != here {
            return others(info);
        }
        HEARD.fetch_add(1, Ordering::Relaxed);
    }));
    let status = with_panic(|| panic!("in a call"), validate);
    panic::set_hook(Box::new(move |info| before(info)));
    assert_eq!(status, CAMLUX_ERROR_INTERNAL);
    assert_eq!(HEARD.load(Ordering::Relaxed), 1);
}
