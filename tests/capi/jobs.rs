//! Jobs: their frames equal those of a render, and they can fail, be cancelled or be abandoned.

use std::{
    ffi::{c_char, c_void},
    ptr::{null, null_mut},
    sync::mpsc::{Receiver, Sender, channel},
    time::Duration,
};

use crate::host::*;
use camlux::capi::*;

fn submit(
    renderer: *mut camlux_renderer,
    scene: *mut camlux_scene,
    options: &camlux_render_options,
) -> *mut camlux_job {
    let mut job = null_mut();
    // SAFETY: a struct of that size, and a pointer to a pointer.
    ok(unsafe { camlux_renderer_submit(renderer, scene, options, &mut job) });
    job
}

fn wait(job: *mut camlux_job) -> (camlux_status, *mut camlux_frame) {
    let mut frame = null_mut();
    // SAFETY: a pointer to a pointer.
    let status = unsafe { camlux_job_wait(job, &mut frame) };
    (status, frame)
}

fn is_done(job: *mut camlux_job) -> bool {
    let mut done = -1;
    // SAFETY: a pointer to a number.
    ok(unsafe { camlux_job_poll(job, &mut done) });
    done == 1
}

/// A job whose render waits at each progress report until the test lets it go on.
struct Paused {
    job: *mut camlux_job,
    begun: Receiver<()>,
    go_on: Sender<()>,
    gates: Box<Gates>,
}

struct Gates {
    begun: Sender<()>,
    go_on: Receiver<()>,
}

unsafe extern "C" fn stop_at_gate(_: f64, _: *const c_char, user: *mut c_void) -> i32 {
    // SAFETY: the test's own value, which only this callback uses during the render.
    let gates = unsafe { &*user.cast::<Gates>() };
    if gates.begun.send(()).is_ok() {
        // An error means that the test has dropped its end, so there is nothing to wait for.
        let _ = gates.go_on.recv();
    }
    0
}

fn submit_paused(
    renderer: *mut camlux_renderer,
    scene: *mut camlux_scene,
    token: *mut camlux_cancel_token,
) -> Paused {
    let (begun, is_begun) = channel();
    let (go_on, goes_on) = channel();
    let mut gates = Box::new(Gates {
        begun,
        go_on: goes_on,
    });
    let options = init!(camlux_render_options {
        progress: Some(stop_at_gate),
        progress_user: (&raw mut *gates).cast(),
        cancel_token: token,
    });
    let job = submit(renderer, scene, &options);
    is_begun.recv().expect("the render reports");
    Paused {
        job,
        begun: is_begun,
        go_on,
        gates,
    }
}

impl Paused {
    /// Lets the render finish.
    fn release(self) -> *mut camlux_job {
        drop(self.begun);
        drop(self.go_on);
        let (job, gates) = (self.job, self.gates);
        while !is_done(job) {
            std::thread::yield_now();
        }
        drop(gates);
        job
    }
}

fn small_scene() -> *mut camlux_scene {
    let scene = load("cornell");
    resize(scene, 16, 16);
    plain_sum(scene, 8);
    scene
}

#[test]
fn a_job_renders_the_scene_as_it_was() {
    let device = Device::open();
    let (scene, renderer) = (small_scene(), device.renderer());
    let expected = render(renderer, scene);
    let paused = submit_paused(renderer, scene, null_mut());
    assert!(!is_done(paused.job));
    // This change affects only the next frame.
    resize(scene, 8, 8);
    let mut other = null_mut();
    // SAFETY: a pointer to a pointer.
    let status = unsafe { camlux_renderer_render(renderer, scene, null(), &mut other) };
    fails(status, CAMLUX_ERROR_BUSY, "the renderer is rendering");
    let mut second = null_mut();
    // SAFETY: a pointer to a pointer.
    let status = unsafe { camlux_renderer_submit(renderer, scene, null(), &mut second) };
    fails(status, CAMLUX_ERROR_BUSY, "the renderer is rendering");
    assert!(other.is_null() && second.is_null());

    let job = paused.release();
    let (status, frame) = wait(job);
    ok(status);
    assert!(layers(frame) == layers(expected));
    let (status, none) = wait(job);
    fails(status, CAMLUX_ERROR_INVALID_ARGUMENT, "already returned");
    assert!(none.is_null() && is_done(job));
    ok(camlux_job_release(job));
    // The frame outlives the job, and the renderer is free.
    assert!(layers(frame) == layers(expected));
    ok(camlux_frame_release(render(renderer, scene)));
    for frame in [frame, expected] {
        ok(camlux_frame_release(frame));
    }
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

#[test]
fn a_render_that_fails_says_so_each_time() {
    let device = Device::open();
    let renderer = device.renderer();
    let without_sensor = new_scene();
    let tof = init!(camlux_tof {
        frequency_count: 1,
        frequencies_hz: [2e7, 0.0, 0.0, 0.0]
    });
    // SAFETY: a struct of that size.
    ok(unsafe { camlux_scene_set_tof(without_sensor, &tof) });
    let job = submit(renderer, without_sensor, &Default::default());
    for _ in 0..2 {
        let (status, frame) = wait(job);
        fails(status, CAMLUX_ERROR_SCENE, "");
        assert!(frame.is_null());
    }
    ok(camlux_job_release(job));

    let scene = small_scene();
    let mut token = null_mut();
    // SAFETY: a pointer to a pointer.
    ok(unsafe { camlux_cancel_token_create(&mut token) });
    let paused = submit_paused(renderer, scene, token);
    ok(camlux_cancel_token_cancel(token));
    let job = paused.release();
    fails(wait(job).0, CAMLUX_CANCELLED, "cancelled");
    ok(camlux_job_release(job));
    ok(camlux_cancel_token_release(token));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
    ok(camlux_scene_release(without_sensor));
}

/// Releasing its last handle cancels a job and frees its renderer.
#[test]
fn an_abandoned_job_is_cancelled() {
    let device = Device::open();
    let (scene, renderer) = (small_scene(), device.renderer());
    let paused = submit_paused(renderer, scene, null_mut());
    ok(camlux_job_retain(paused.job));
    ok(camlux_job_release(paused.job));
    assert!(!is_done(paused.job));
    let Paused {
        job,
        begun,
        go_on,
        gates,
    } = paused;
    let handle = job.addr();
    std::thread::scope(|scope| {
        let releasing = scope.spawn(move || {
            ok(camlux_job_release(std::ptr::without_provenance_mut(handle)));
        });
        // The release waits for the render to end.
        while !releasing.is_finished() {
            go_on.send(()).expect("the callback listens");
            let _ = begun.recv_timeout(Duration::from_millis(5));
        }
    });
    drop(gates);
    ok(camlux_frame_release(render(renderer, scene)));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

#[test]
fn waiting_for_a_job_ends_with_it_or_with_the_time() {
    let device = Device::open();
    let (scene, renderer) = (small_scene(), device.renderer());
    let paused = submit_paused(renderer, scene, null_mut());
    let wait_for = |job, milliseconds| {
        let mut done = -1;
        // SAFETY: a pointer to a number.
        let status = unsafe { camlux_job_wait_for(job, milliseconds, &mut done) };
        (status, done)
    };
    for milliseconds in [0.0, 5.0] {
        assert_eq!(wait_for(paused.job, milliseconds), (CAMLUX_OK, 0));
    }
    for wrong in [-1.0, f64::NAN] {
        let (status, done) = wait_for(paused.job, wrong);
        fails(status, CAMLUX_ERROR_INVALID_ARGUMENT, "milliseconds is");
        assert_eq!(done, -1);
    }
    let job = paused.release();
    for milliseconds in [0.0, f64::INFINITY] {
        assert_eq!(wait_for(job, milliseconds), (CAMLUX_OK, 1));
    }
    let (status, frame) = wait(job);
    ok(status);
    assert_eq!(wait_for(job, 0.0), (CAMLUX_OK, 1));

    // It waits for an end that is still to come.
    let job = submit(renderer, scene, &Default::default());
    assert_eq!(wait_for(job, f64::INFINITY), (CAMLUX_OK, 1));
    assert!(is_done(job));
    ok(camlux_job_release(job));
    ok(camlux_frame_release(frame));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}

/// Waits for its own job in the callback.
unsafe extern "C" fn wait_in_callback(_: f64, _: *const c_char, user: *mut c_void) -> i32 {
    // SAFETY: the test's own value, which outlives the render.
    let gates = unsafe { &*user.cast::<(Receiver<usize>, Sender<camlux_status>)>() };
    let Ok(job) = gates.0.recv() else {
        return 0;
    };
    let mut done = -1;
    // SAFETY: a pointer to a number.
    let status = unsafe {
        camlux_job_wait_for(
            std::ptr::without_provenance_mut(job),
            f64::INFINITY,
            &mut done,
        )
    };
    let _ = gates.1.send(status);
    0
}

#[test]
fn a_job_does_not_wait_for_itself() {
    let device = Device::open();
    let (scene, renderer) = (small_scene(), device.renderer());
    let (job_sender, job_receiver) = channel();
    let (status_sender, status_receiver) = channel();
    let mut gates = Box::new((job_receiver, status_sender));
    let options = init!(camlux_render_options {
        progress: Some(wait_in_callback),
        progress_user: (&raw mut *gates).cast(),
    });
    let job = submit(renderer, scene, &options);
    job_sender.send(job.addr()).expect("the callback listens");
    drop(job_sender);
    assert_eq!(status_receiver.recv(), Ok(CAMLUX_ERROR_BUSY));
    let (status, frame) = wait(job);
    ok(status);
    ok(camlux_frame_release(frame));
    ok(camlux_job_release(job));
    ok(camlux_renderer_release(renderer));
    ok(camlux_scene_release(scene));
}
