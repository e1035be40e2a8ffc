//! The process-wide log of the C interface.

use std::{
    ffi::{CStr, c_char, c_void},
    ptr::{null, null_mut},
    sync::{
        Mutex,
        atomic::{AtomicI32, Ordering},
    },
};

use crate::host::*;
use camlux::capi::*;

static MESSAGES: Mutex<Vec<(i32, String)>> = Mutex::new(Vec::new());
static INNER_STATUS: AtomicI32 = AtomicI32::new(0);

unsafe extern "C" fn collect(level: i32, message: *const c_char, user: *mut c_void) {
    assert_eq!(user.addr(), 1234);
    // SAFETY: the string is valid during the call.
    let text = unsafe { CStr::from_ptr(message) };
    let text = text.to_str().expect("UTF-8").to_owned();
    MESSAGES.lock().expect("no panic").push((level, text));
    // SAFETY: no callback.
    let status = unsafe { camlux_set_log(CAMLUX_LOG_OFF, None, null_mut()) };
    INNER_STATUS.store(status, Ordering::Relaxed);
}

/// The renderer and the scene of a render whose callback renders with them.
type Inner = (*mut camlux_renderer, *mut camlux_scene);

unsafe extern "C" fn render_again(_: f64, _: *const c_char, user: *mut c_void) -> i32 {
    // SAFETY: the test's own value.
    let (renderer, scene) = unsafe { *user.cast::<Inner>() };
    let mut frame = null_mut();
    // SAFETY: it points to a pointer.
    let status = unsafe { camlux_renderer_render(renderer, scene, null(), &mut frame) };
    assert_eq!(status, CAMLUX_ERROR_BUSY);
    1
}

fn render_inside_a_render(renderer: *mut camlux_renderer, scene: *mut camlux_scene) {
    let mut inner: Inner = (renderer, scene);
    let options = init!(camlux_render_options {
        progress: Some(render_again),
        progress_user: (&raw mut inner).cast(),
    });
    let mut frame = null_mut();
    // SAFETY: a struct of that size, and a pointer to a pointer.
    let status = unsafe { camlux_renderer_render(renderer, scene, &options, &mut frame) };
    assert_eq!(status, CAMLUX_CANCELLED);
}

/// Moves a time-of-flight camera, once with a light that is relative to it and once away from its light.
fn leave_a_light_behind(renderer: *mut camlux_renderer) {
    let scene = load("tof_corner");
    resize(scene, 9, 9);
    for relative_to in [CAMLUX_RELATIVE_TO_CAMERA, CAMLUX_RELATIVE_TO_WORLD] {
        let mut camera = init!(camlux_camera {});
        // SAFETY: structs of their sizes.
        unsafe {
            ok(camlux_scene_set_indirect(scene, null()));
            ok(camlux_scene_get_camera(scene, &mut camera));
            let mut light = init!(camlux_light {
                power_w: [1.0; 3],
                relative_to: relative_to
            });
            if relative_to == CAMLUX_RELATIVE_TO_WORLD {
                light.position_m = camera.position_m;
            }
            ok(camlux_scene_set_light(scene, 0, &light));
            ok(camlux_frame_release(render(renderer, scene)));
            for _ in 0..2 {
                camera.position_m[0] -= 0.25;
                ok(camlux_scene_set_camera(scene, &camera));
                ok(camlux_frame_release(render(renderer, scene)));
            }
        }
    }
    ok(camlux_scene_release(scene));
}

/// Renders without a visible light, with a material and an instance that have no name.
fn hide_all_lights(renderer: *mut camlux_renderer) {
    let scene = load("cornell");
    resize(scene, 9, 9);
    let bright = init!(camlux_material {
        kd: [0.9; 3],
        ks: [0.5; 3],
        shininess: 9.0
    });
    let (mut material, mut mesh) = (0, 0);
    // SAFETY: structs of their size, and pointers to numbers.
    unsafe {
        ok(camlux_scene_set_indirect(scene, null()));
        ok(camlux_scene_add_material(scene, &bright, &mut material));
        ok(camlux_scene_add_mesh(
            scene,
            &init!(camlux_mesh {}),
            &mut mesh,
        ));
        ok(camlux_scene_add_instance(scene, mesh, null(), null_mut()));
        let mut counts = init!(camlux_scene_counts {});
        ok(camlux_scene_get_counts(scene, &mut counts));
        for light in 0..counts.lights {
            ok(camlux_scene_set_visible(scene, CAMLUX_PART_LIGHT, light, 0));
        }
        let warnings = [
            format!("material {material} reflects more than it receives"),
            format!(
                "mesh \"instance {}\" has no triangles",
                counts.instances - 1
            ),
            "all lights are hidden, so every frame is black".into(),
            "the image is black: all lights are hidden; show one by camlux_scene_set_visible"
                .into(),
        ];
        ok(camlux_frame_release(render(renderer, scene)));
        let messages = MESSAGES.lock().expect("no panic");
        for warning in warnings {
            let is_it = |(level, text): &&(i32, String)| {
                *level == CAMLUX_LOG_WARNING && text.contains(&warning)
            };
            assert_eq!(
                messages.iter().filter(is_it).count(),
                1,
                "{warning}: {messages:?}"
            );
        }
        let says_none = |(_, text): &(i32, String)| text.contains("there is no light");
        assert!(!messages.iter().any(says_none), "{messages:?}");
    }
    ok(camlux_scene_release(scene));
}

#[test]
fn the_log_has_what_its_level_asks_for() {
    let user = std::ptr::without_provenance_mut(1234);
    // SAFETY: a function of that type.
    ok(unsafe { camlux_set_log(CAMLUX_LOG_DEBUG, Some(collect), user) });
    let device = Device::open();
    let scene = load("cornell");
    resize(scene, 8, 8);
    plain_sum(scene, 8);
    let dark = init!(camlux_light {});
    // SAFETY: a struct of that size; no index requested.
    ok(unsafe { camlux_scene_add_light(scene, &dark, null_mut()) });
    let renderer = device.renderer();
    ok(camlux_frame_release(render(renderer, scene)));
    ok(camlux_frame_release(render(renderer, scene)));
    assert_eq!(camlux_scene_release(null_mut()), CAMLUX_OK);
    fails(
        camlux_scene_validate(null_mut()),
        CAMLUX_ERROR_INVALID_HANDLE,
        "NULL",
    );
    render_inside_a_render(renderer, scene);
    leave_a_light_behind(renderer);
    hide_all_lights(renderer);
    // SAFETY: no callback.
    ok(unsafe { camlux_set_log(CAMLUX_LOG_DEBUG, None, null_mut()) });
    ok(camlux_frame_release(render(renderer, scene)));
    let messages = std::mem::take(&mut *MESSAGES.lock().expect("no panic"));
    let count = |level, words: &str| {
        let is_it = |(l, text): &&(i32, String)| *l == level && text.contains(words);
        messages.iter().filter(is_it).count()
    };
    assert_eq!(count(CAMLUX_LOG_INFO, "opened"), 1);
    assert!(
        count(CAMLUX_LOG_INFO, "rendered 8 x 8 px") == 2,
        "{messages:?}"
    );
    assert_eq!(
        count(CAMLUX_LOG_WARNING, "light 1 (point) emits nothing"),
        1
    );
    assert_eq!(
        count(CAMLUX_LOG_WARNING, "light 0 was at the lens"),
        1,
        "{messages:?}"
    );
    assert!(count(CAMLUX_LOG_DEBUG, "pass gbuffer") >= 2);
    assert!(
        count(
            CAMLUX_LOG_ERROR,
            "camlux_scene_validate: the camlux_scene is NULL"
        ) == 1
    );
    assert_eq!(INNER_STATUS.load(Ordering::Relaxed), CAMLUX_ERROR_BUSY);
    let busy = "camlux_renderer_render: the renderer is rendering";
    assert_eq!(count(CAMLUX_LOG_INFO, busy), 1);
    assert_eq!(count(CAMLUX_LOG_ERROR, busy), 0);
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}
