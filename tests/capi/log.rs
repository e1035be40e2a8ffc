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

fn render_inside_a_render(renderer: &Renderer, scene: &Scene) {
    let mut inner: Inner = (renderer.raw(), scene.raw());
    let options = init!(camlux_render_options {
        progress: Some(render_again),
        progress_user: (&raw mut inner).cast(),
    });
    let status = renderer.try_render(scene, &options).unwrap_err();
    assert_eq!(status, CAMLUX_CANCELLED);
}

/// Moves a time-of-flight camera, once with a light that is relative to it and once away from its light.
fn leave_a_light_behind(renderer: &Renderer) {
    let scene = load_at("tof_corner", [9, 9]);
    scene.unset_indirect();
    for relative_to in [CAMLUX_RELATIVE_TO_CAMERA, CAMLUX_RELATIVE_TO_WORLD] {
        let mut camera = scene.camera();
        let mut light = init!(camlux_light {
            power_w: [1.0; 3],
            relative_to: relative_to
        });
        if relative_to == CAMLUX_RELATIVE_TO_WORLD {
            light.position_m = camera.position_m;
        }
        ok(scene.set_light(0, &light));
        renderer.render(&scene);
        for _ in 0..2 {
            camera.position_m[0] -= 0.25;
            ok(scene.set_camera(&camera));
            renderer.render(&scene);
        }
    }
}

/// Renders without a visible light, with a material and an instance that have no name.
fn hide_all_lights(renderer: &Renderer) {
    let scene = load_at("cornell", [9, 9]);
    scene.unset_indirect();
    let bright = init!(camlux_material {
        kd: [0.9; 3],
        ks: [0.5; 3],
        shininess: 9.0
    });
    let material = scene.add_material(&bright).expect("it is added");
    let mesh = scene.add_mesh(&init!(camlux_mesh {})).expect("it is added");
    // SAFETY: the pose and the index may be NULL.
    ok(unsafe { camlux_scene_add_instance(scene.raw(), mesh, null(), null_mut()) });
    let counts = scene.counts();
    for light in 0..counts.lights {
        ok(camlux_scene_set_visible(
            scene.raw(),
            CAMLUX_PART_LIGHT,
            light,
            0,
        ));
    }
    renderer.render(&scene);
    let messages = MESSAGES.lock().expect("no panic");
    for warning in [
        format!("material {material} reflects more than it receives"),
        format!(
            "mesh \"instance {}\" has no triangles",
            counts.instances - 1
        ),
        "all lights are hidden, so every frame is black".into(),
        "the image is black: all lights are hidden; show one by camlux_scene_set_visible".into(),
    ] {
        let is_it = |(level, text): &&(i32, String)| {
            *level == CAMLUX_LOG_WARNING && text.contains(&warning)
        };
        let count = messages.iter().filter(is_it).count();
        assert_eq!(count, 1, "{warning}: {messages:?}");
    }
    let says_none = |(_, text): &(i32, String)| text.contains("there is no light");
    assert!(!messages.iter().any(says_none), "{messages:?}");
}

#[test]
fn the_log_has_what_its_level_asks_for() {
    let user = std::ptr::without_provenance_mut(1234);
    // SAFETY: a function of that type.
    ok(unsafe { camlux_set_log(CAMLUX_LOG_DEBUG, Some(collect), user) });
    let device = Device::open();
    let scene = fast_scene(8);
    let dark = init!(camlux_light {});
    scene.add_light(&dark).expect("it is added");
    let renderer = device.renderer();
    renderer.render(&scene);
    renderer.render(&scene);
    assert_eq!(camlux_scene_release(null_mut()), CAMLUX_OK);
    fails(
        camlux_scene_validate(null_mut()),
        CAMLUX_ERROR_INVALID_HANDLE,
        "NULL",
    );
    render_inside_a_render(&renderer, &scene);
    leave_a_light_behind(&renderer);
    hide_all_lights(&renderer);
    // SAFETY: no callback.
    ok(unsafe { camlux_set_log(CAMLUX_LOG_DEBUG, None, null_mut()) });
    renderer.render(&scene);
    let messages = std::mem::take(&mut *MESSAGES.lock().expect("no panic"));
    let count = |level, words: &str| {
        let is_it = |(l, text): &&(i32, String)| *l == level && text.contains(words);
        messages.iter().filter(is_it).count()
    };
    let (of_null, busy) = (
        "camlux_scene_validate: the camlux_scene is NULL",
        "camlux_renderer_render: the renderer is rendering",
    );
    for (level, words, due) in [
        (CAMLUX_LOG_INFO, "opened", 1),
        (CAMLUX_LOG_INFO, "rendered 8 x 8 px", 2),
        (CAMLUX_LOG_WARNING, "light 1 (point) emits nothing", 1),
        (CAMLUX_LOG_WARNING, "light 0 was at the lens", 1),
        (CAMLUX_LOG_ERROR, of_null, 1),
        (CAMLUX_LOG_INFO, busy, 1),
        (CAMLUX_LOG_ERROR, busy, 0),
    ] {
        assert_eq!(count(level, words), due, "{words}: {messages:?}");
    }
    assert!(count(CAMLUX_LOG_DEBUG, "pass gbuffer") >= 2);
    assert_eq!(INNER_STATUS.load(Ordering::Relaxed), CAMLUX_ERROR_BUSY);
}
