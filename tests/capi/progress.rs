//! Progress reports of a render, and how a host ends it.

use std::{
    ffi::{CStr, c_char, c_void},
    ptr::{null, null_mut},
    sync::mpsc::{Receiver, Sender, channel},
};

use crate::host::*;
use camlux::capi::*;

/// What a progress callback has seen, and after how many reports it cancels.
#[derive(Default)]
struct Watch {
    reports: u32,
    last_fraction: f64,
    stop_after: Option<u32>,
    /// If not 0, the callback tries to render with it.
    renderer: usize,
    scene: usize,
    busy: i32,
}

unsafe extern "C" fn watch(fraction: f64, pass: *const c_char, user: *mut c_void) -> i32 {
    // SAFETY: the test's own value, which only this callback uses during the render.
    let watch = unsafe { &mut *user.cast::<Watch>() };
    assert!((0.0..=1.0).contains(&fraction) && fraction >= watch.last_fraction);
    // SAFETY: the string is valid during the call.
    assert!(!unsafe { CStr::from_ptr(pass) }.is_empty());
    watch.reports += 1;
    watch.last_fraction = fraction;
    if watch.renderer != 0 {
        let mut frame = null_mut();
        let renderer = std::ptr::without_provenance_mut(watch.renderer);
        let scene = std::ptr::without_provenance_mut(watch.scene);
        // SAFETY: it points to a pointer.
        watch.busy = unsafe { camlux_renderer_render(renderer, scene, null(), &mut frame) };
    }
    i32::from(Some(watch.reports) == watch.stop_after)
}

#[test]
fn progress_is_told_and_can_end_a_render() {
    let device = Device::open();
    let scene = load_at("cornell", [24, 20]);
    let renderer = device.renderer();
    let whole = renderer.render(&scene);
    for stop_after in [Some(1), Some(2), None] {
        let mut seen = Watch {
            stop_after,
            renderer: renderer.raw().addr(),
            scene: scene.raw().addr(),
            ..Watch::default()
        };
        let options = init!(camlux_render_options {
            progress: Some(watch),
            progress_user: (&raw mut seen).cast(),
            // So that it is drawn. Sums do not depend on it.
            seed: 3
        });
        let rendered = renderer.try_render(&scene, &options);
        assert_eq!(seen.busy, CAMLUX_ERROR_BUSY);
        match (stop_after, rendered) {
            (None, Ok(frame)) => {
                assert!(seen.reports > 2);
                assert!(frame.layers() == whole.layers());
            }
            (Some(reports), Err(status)) => {
                fails(status, CAMLUX_CANCELLED, "cancelled");
                assert_eq!(seen.reports, reports);
            }
            (_, rendered) => panic!("{stop_after:?}: {rendered:?}, {}", last_error()),
        }
    }
}

/// A render that begins after its token was cancelled is cancelled, too.
#[test]
fn a_cancel_before_the_render_is_not_lost() {
    let device = Device::open();
    let scene = fast_scene(8);
    let renderer = device.renderer();
    let token = new_token();
    let mut seen = Watch::default();
    let options = init!(camlux_render_options {
        progress: Some(watch),
        progress_user: (&raw mut seen).cast(),
        cancel_token: token.raw(),
    });
    let render = || renderer.try_render(&scene, &options);
    render().expect("it is not cancelled yet");
    ok(camlux_cancel_token_cancel(token.raw()));
    // The token stays cancelled.
    for _ in 0..2 {
        fails(render().unwrap_err(), CAMLUX_CANCELLED, "cancelled");
    }
    drop(token);
    let of_no_token = render().unwrap_err();
    fails(
        of_no_token,
        CAMLUX_ERROR_INVALID_HANDLE,
        "camlux_cancel_token",
    );
}

/// Reports that a render has begun, and holds it until the test has cancelled it.
struct Pause {
    begun: Sender<()>,
    cancelled: Receiver<()>,
}

unsafe extern "C" fn pause(_: f64, _: *const c_char, user: *mut c_void) -> i32 {
    // SAFETY: the test's own value, which only this callback uses during the render.
    let pause = unsafe { &*user.cast::<Pause>() };
    pause.begun.send(()).expect("the other thread listens");
    pause.cancelled.recv().expect("the other thread cancels");
    0
}

#[test]
fn a_cancel_ends_the_render_under_way_and_no_other() {
    let device = Device::open();
    let scene = fast_scene(8);
    let renderer = device.renderer();
    let token = new_token();
    let (begun, is_begun) = channel();
    let (cancel, cancelled) = channel();
    let mut pausing = Pause { begun, cancelled };
    let options = init!(camlux_render_options {
        cancel_token: token.raw(),
        progress: Some(pause),
        progress_user: (&raw mut pausing).cast(),
    });
    let rendered = std::thread::scope(|scope| {
        let token = &token;
        scope.spawn(move || {
            is_begun.recv().expect("the render reports");
            ok(camlux_cancel_token_cancel(token.raw()));
            cancel.send(()).expect("the render waits");
        });
        renderer.try_render(&scene, &options)
    });
    fails(rendered.unwrap_err(), CAMLUX_CANCELLED, "cancelled");
    renderer.render(&scene);
}
