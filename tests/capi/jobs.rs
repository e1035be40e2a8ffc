//! Jobs: their frames equal those of a render, and they can fail, be cancelled or be abandoned.

use std::{
    ffi::{c_char, c_void},
    ptr::null_mut,
    sync::mpsc::{Receiver, Sender, channel},
    time::Duration,
};

use crate::host::*;
use camlux::capi::*;

type Job = Owned<camlux_job>;

fn wait(job: &Job) -> Result<Frame, camlux_status> {
    // SAFETY: a pointer to a pointer.
    Owned::try_new(|frame| unsafe { camlux_job_wait(job.raw(), frame) })
}

fn is_done(job: &Job) -> bool {
    let mut done = -1;
    // SAFETY: a pointer to a number.
    ok(unsafe { camlux_job_poll(job.raw(), &mut done) });
    done == 1
}

/// A job whose render waits at each progress report until the test lets it go on.
struct Paused {
    job: Job,
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

fn submit_paused(renderer: &Renderer, scene: &Scene, token: *mut camlux_cancel_token) -> Paused {
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
    let job = renderer.try_submit(scene, &options).expect("it begins");
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
    fn release(self) -> Job {
        drop(self.begun);
        drop(self.go_on);
        let (job, gates) = (self.job, self.gates);
        while !is_done(&job) {
            std::thread::yield_now();
        }
        drop(gates);
        job
    }
}

#[test]
fn a_job_renders_the_scene_as_it_was() {
    let device = Device::open();
    let (scene, renderer) = (fast_scene(16), device.renderer());
    let expected = renderer.render(&scene);
    let paused = submit_paused(&renderer, &scene, null_mut());
    assert!(!is_done(&paused.job));
    // This change affects only the next frame.
    scene.resize(8, 8);
    let options = Default::default();
    let other = renderer.try_render(&scene, &options).unwrap_err();
    fails(other, CAMLUX_ERROR_BUSY, "the renderer is rendering");
    let second = renderer.try_submit(&scene, &options).unwrap_err();
    fails(second, CAMLUX_ERROR_BUSY, "the renderer is rendering");

    let job = paused.release();
    let frame = wait(&job).expect("it has a frame");
    assert!(frame.layers() == expected.layers());
    let again = wait(&job).unwrap_err();
    fails(again, CAMLUX_ERROR_INVALID_ARGUMENT, "already returned");
    assert!(is_done(&job));
    drop(job);
    // The frame outlives the job, and the renderer is free.
    assert!(frame.layers() == expected.layers());
    renderer.render(&scene);
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
    ok(without_sensor.set_tof(&tof));
    let job = renderer.try_submit(&without_sensor, &Default::default());
    let job = job.expect("it begins");
    for _ in 0..2 {
        fails(wait(&job).unwrap_err(), CAMLUX_ERROR_SCENE, "");
    }
    drop(job);

    let scene = fast_scene(16);
    let token = new_token();
    let paused = submit_paused(&renderer, &scene, token.raw());
    ok(camlux_cancel_token_cancel(token.raw()));
    let job = paused.release();
    fails(wait(&job).unwrap_err(), CAMLUX_CANCELLED, "cancelled");
}

/// Releasing its last handle cancels a job and frees its renderer.
#[test]
fn an_abandoned_job_is_cancelled() {
    let device = Device::open();
    let (scene, renderer) = (fast_scene(16), device.renderer());
    let paused = submit_paused(&renderer, &scene, null_mut());
    ok(camlux_job_retain(paused.job.raw()));
    ok(camlux_job_release(paused.job.raw()));
    assert!(!is_done(&paused.job));
    let Paused {
        job,
        begun,
        go_on,
        gates,
    } = paused;
    std::thread::scope(|scope| {
        let releasing = scope.spawn(move || drop(job));
        // The release waits for the render to end.
        while !releasing.is_finished() {
            go_on.send(()).expect("the callback listens");
            let _ = begun.recv_timeout(Duration::from_millis(5));
        }
    });
    drop(gates);
    renderer.render(&scene);
}

#[test]
fn waiting_for_a_job_ends_with_it_or_with_the_time() {
    let device = Device::open();
    let (scene, renderer) = (fast_scene(16), device.renderer());
    let paused = submit_paused(&renderer, &scene, null_mut());
    let wait_for = |job: &Job, milliseconds| {
        let mut done = -1;
        // SAFETY: a pointer to a number.
        let status = unsafe { camlux_job_wait_for(job.raw(), milliseconds, &mut done) };
        (status, done)
    };
    for milliseconds in [0.0, 5.0] {
        assert_eq!(wait_for(&paused.job, milliseconds), (CAMLUX_OK, 0));
    }
    for wrong in [-1.0, f64::NAN] {
        let (status, done) = wait_for(&paused.job, wrong);
        fails(status, CAMLUX_ERROR_INVALID_ARGUMENT, "milliseconds is");
        assert_eq!(done, -1);
    }
    let job = paused.release();
    for milliseconds in [0.0, f64::INFINITY] {
        assert_eq!(wait_for(&job, milliseconds), (CAMLUX_OK, 1));
    }
    wait(&job).expect("it has a frame");
    assert_eq!(wait_for(&job, 0.0), (CAMLUX_OK, 1));

    // It waits for an end that is still to come.
    let job = renderer.try_submit(&scene, &Default::default());
    let job = job.expect("it begins");
    assert_eq!(wait_for(&job, f64::INFINITY), (CAMLUX_OK, 1));
    assert!(is_done(&job));
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
    let (scene, renderer) = (fast_scene(16), device.renderer());
    let (job_sender, job_receiver) = channel();
    let (status_sender, status_receiver) = channel();
    let mut gates = Box::new((job_receiver, status_sender));
    let options = init!(camlux_render_options {
        progress: Some(wait_in_callback),
        progress_user: (&raw mut *gates).cast(),
    });
    let job = renderer.try_submit(&scene, &options).expect("it begins");
    job_sender
        .send(job.raw().addr())
        .expect("the callback listens");
    drop(job_sender);
    assert_eq!(status_receiver.recv(), Ok(CAMLUX_ERROR_BUSY));
    wait(&job).expect("it has a frame");
}
