//! Tests that need to look inside; the others call the interface, in `tests/capi` and `tests/c`.

use std::{
    cell::Cell,
    ffi::CStr,
    panic,
    ptr::{null, null_mut},
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
};

use super::{abi::c_struct, args, status::ffi_guard, *};

thread_local! {
    static PANICS: Cell<bool> = const { Cell::new(false) };
}

/// What goes wrong in a test instead of a call's own work.
pub(super) fn panic_where_asked() {
    assert!(!PANICS.get(), "asked for by a test");
}

fn last_error() -> String {
    // SAFETY: a string of this thread.
    let message = unsafe { CStr::from_ptr(camlux_last_error()) };
    message.to_string_lossy().into_owned()
}

type Call = (&'static str, fn() -> camlux_status);

/// Each call's name, and the call with nothing but nulls.
macro_rules! calls {
    ($($name:ident($($argument:expr),*)),* $(,)?) => {
        [$((stringify!($name), || {
            // SAFETY: nulls are fine everywhere.
            #[allow(unused_unsafe, reason = "not all are unsafe")]
            unsafe { $name($($argument),*) }
        })),*]
    };
}

#[test]
fn a_panic_in_any_call_becomes_a_status() {
    let calls: [Call; 50] = calls![
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
        camlux_scene_set_indirect(null_mut(), null()),
        camlux_scene_set_direct(null_mut(), null()),
        camlux_scene_add_texture(null_mut(), null(), null_mut()),
        camlux_scene_add_material(null_mut(), null(), null_mut()),
        camlux_scene_set_material(null_mut(), 0, null()),
        camlux_scene_add_mesh(null_mut(), null(), null_mut()),
        camlux_scene_add_instance(null_mut(), 0, null(), null_mut()),
        camlux_scene_set_pose(null_mut(), 0, 0, null()),
        camlux_scene_add_light(null_mut(), null(), null_mut()),
        camlux_scene_set_light(null_mut(), 0, null()),
        camlux_scene_get_light(null_mut(), 0, null_mut()),
        camlux_renderer_retain(null_mut()),
        camlux_renderer_release(null_mut()),
        camlux_renderer_create(null_mut(), null_mut()),
        camlux_renderer_render(null_mut(), null_mut(), null(), null_mut()),
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
    ];
    for (name, call) in calls {
        PANICS.set(true);
        let status = call();
        PANICS.set(false);
        assert_eq!(status, CAMLUX_ERROR_INTERNAL, "{name}");
        let message = last_error();
        assert!(message.starts_with(&format!("{name}: internal error: asked for by a test")));
    }
    // None is forgotten.
    let header = include_str!("../../include/camlux.h");
    let declared = header
        .lines()
        .filter(|line| line.starts_with("camlux_status camlux_"));
    assert_eq!(declared.count(), calls.len());
}

#[test]
fn a_panic_with_any_payload_is_caught() {
    let formatted = || panic!("{} things", 2);
    assert_eq!(ffi_guard("test", formatted), CAMLUX_ERROR_INTERNAL);
    assert!(last_error().contains("2 things"));
    let odd = || std::panic::panic_any(7_u8);
    assert_eq!(ffi_guard("test", odd), CAMLUX_ERROR_INTERNAL);
    assert!(last_error().contains("a panic"));
}

/// The hook is the process's: it hears of a panic inside of a call as of any other.
#[test]
fn the_panic_hook_stays() {
    static HEARD: AtomicU32 = AtomicU32::new(0);
    let here = std::thread::current().id();
    let before = Arc::new(panic::take_hook());
    let others = before.clone();
    panic::set_hook(Box::new(move |info| {
        if std::thread::current().id() != here {
            return others(info);
        }
        HEARD.fetch_add(1, Ordering::Relaxed);
    }));
    let status = ffi_guard("test", || panic!("in a call"));
    panic::set_hook(Box::new(move |info| before(info)));
    assert_eq!(status, CAMLUX_ERROR_INTERNAL);
    assert_eq!(HEARD.load(Ordering::Relaxed), 1);
}

/// A struct that a later version has made longer.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
struct Grown {
    struct_size: u32,
    first: u32,
    added: u64,
}

c_struct! { Grown, 8, {
    first: 1,
    added: 2,
} }

#[test]
fn a_struct_of_an_old_program_has_defaults_for_what_was_added() {
    let mut room = Grown {
        struct_size: 8,
        first: 5,
        added: 6,
    };
    // SAFETY: it points to as much.
    let read = unsafe { args::read(&raw const room) }.map_err(|failure| failure.message);
    let expected = Grown {
        struct_size: 8,
        first: 5,
        added: 2,
    };
    assert_eq!(read, Ok(expected));
    let result = Grown {
        struct_size: 16,
        first: 7,
        added: 8,
    };
    // SAFETY: as above.
    let written = unsafe { args::write(&raw mut room, || Ok(result)) };
    assert!(written.is_ok());
    let expected = Grown {
        struct_size: 8,
        first: 7,
        added: 6,
    };
    assert_eq!(
        room, expected,
        "what an old program has behind its struct is its own"
    );
    for bytes in [7, 9, 12] {
        room.struct_size = bytes;
        // SAFETY: as above.
        let is_read = unsafe { args::read(&raw const room) }.is_ok();
        assert_eq!(is_read, bytes >= 8, "{bytes}");
    }
}
