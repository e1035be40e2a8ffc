//! Frames of one scene from several cameras.

use std::{
    ops::ControlFlow,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc,
    },
    thread,
};

use crate::{
    Error, Plan, Progress, RenderOptions, Renderer, Result, Scene, output::Frame, scene::Camera,
};

impl Renderer {
    /// Renders a scene from several cameras, each as if it were the scene's own. What rays hit is computed once. A light that is relative to the
    /// camera moves to each of them. All frames have the same index, and each camera has its own noise: `options.camera_index` is that of the
    /// first.
    ///
    /// On a GPU several frames render at a time ([`Plan::frames_in_flight`]), each in images of its own. The renderer keeps these images.
    /// `options.progress` is called on the caller's thread.
    ///
    /// # Errors
    /// Those of [`Renderer::render`], and the place of the first camera that failed. There are no frames then.
    pub fn render_cameras(
        &mut self,
        scene: &Scene,
        cameras: &[Camera],
        options: &mut RenderOptions,
    ) -> std::result::Result<Vec<Frame>, (usize, Error)> {
        let pixels = |camera: &&Camera| camera.resolution_px.map(u64::from).iter().product::<u64>();
        let device = self.device.info();
        let in_flight = cameras.iter().max_by_key(pixels).and_then(|largest| {
            let scene = seen_by(scene, largest);
            // A scene that has no plan fails when it is rendered.
            let plan = Plan::new(&scene, device).ok()?;
            Some(plan.frames_in_flight(&scene, device, true))
        });
        let in_flight = in_flight.unwrap_or(1);
        self.render_at_once(in_flight.min(cameras.len()), scene, cameras, options)
    }

    /// Renders so many frames at a time.
    fn render_at_once(
        &mut self,
        in_flight: usize,
        scene: &Scene,
        cameras: &[Camera],
        options: &mut RenderOptions,
    ) -> std::result::Result<Vec<Frame>, (usize, Error)> {
        let mut others = std::mem::take(&mut self.others);
        let missing = in_flight.saturating_sub(1 + others.len());
        for _ in 0..missing {
            others.push(Renderer::new(&self.device).map_err(|error| (0, error))?);
        }
        let frame_index = options.frame_index.unwrap_or(self.next_frame_index);
        let (next, is_failed, ends) = (
            AtomicUsize::new(0),
            AtomicBool::new(false),
            AtomicBool::new(false),
        );
        let frames: Vec<Option<Result<Frame>>> = cameras.iter().map(|_| None).collect();
        let frames = Mutex::new(frames);
        let (sender, reports) = mpsc::channel();
        // Without the caller's function, which stays on the caller's thread.
        let RenderOptions {
            keep_partial,
            repeat_unchanged,
            submission_target,
            gather_kernel,
            tracer,
            seed,
            camera_index,
            layers,
            ..
        } = *options;
        let render = |renderer: &mut Renderer, reports: mpsc::Sender<(usize, Progress)>| {
            while !is_failed.load(Ordering::Relaxed) {
                let place = next.fetch_add(1, Ordering::Relaxed);
                let Some(camera) = cameras.get(place) else {
                    break;
                };
                let mut report = |progress: Progress| {
                    // The caller's thread waits for these reports.
                    let _ = reports.send((place, progress));
                    match ends.load(Ordering::Relaxed) {
                        true => ControlFlow::Break(()),
                        false => ControlFlow::Continue(()),
                    }
                };
                let mut options = RenderOptions {
                    progress: Some(&mut report),
                    keep_partial,
                    repeat_unchanged,
                    submission_target,
                    gather_kernel,
                    tracer,
                    seed,
                    frame_index: Some(frame_index),
                    camera_index: camera_index + place as u32,
                    layers,
                };
                let frame = renderer.render(&seen_by(scene, camera), &mut options);
                is_failed.fetch_or(frame.is_err(), Ordering::Relaxed);
                lock(&frames)[place] = Some(frame);
            }
        };
        thread::scope(|scope| {
            let in_flight = others.iter_mut().take(in_flight.saturating_sub(1));
            for renderer in in_flight.chain([&mut *self]) {
                let (render, sender) = (&render, sender.clone());
                scope.spawn(move || render(renderer, sender));
            }
            drop(sender);
            let mut fractions = vec![0.0; cameras.len()];
            for (place, progress) in reports {
                fractions[place] = progress.fraction;
                let progress = Progress {
                    fraction: fractions.iter().sum::<f32>() / cameras.len() as f32,
                    ..progress
                };
                let report = options.progress.as_mut();
                if report.is_some_and(|report| report(progress).is_break()) {
                    ends.store(true, Ordering::Relaxed);
                }
            }
        });
        self.others = others;
        if !cameras.is_empty() {
            self.next_frame_index = self.next_frame_index.max(frame_index.wrapping_add(1));
        }
        let frames = std::mem::take(&mut *lock(&frames));
        let failed = frames
            .iter()
            .position(|frame| matches!(frame, Some(Err(_))));
        let not_rendered = || Error::internal("a camera without a frame");
        let frames = frames.into_iter().enumerate();
        let frames = frames.filter(|(place, _)| failed.is_none_or(|failed| failed == *place));
        let frames = frames.map(|(place, frame)| {
            let frame = frame.unwrap_or_else(|| Err(not_rendered()));
            frame.map_err(|error| (place, error))
        });
        frames.collect()
    }
}

/// Locks frames that a panic elsewhere cannot leave half changed.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The scene with another camera.
fn seen_by(scene: &Scene, camera: &Camera) -> Scene {
    Scene {
        camera: *camera,
        ..scene.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Device, DeviceOptions, scene::IndirectLight};
    use glam::dvec3;

    fn cameras_of(scene: &Scene) -> Vec<Camera> {
        let moved = (0..6).map(|place| {
            let mut camera = scene.camera.resized([16 + place, 12]);
            camera.position_m += dvec3(0.05 * f64::from(place), 0.0, 0.0);
            camera
        });
        moved.collect()
    }

    fn renderer() -> Renderer {
        let device = Device::open(&DeviceOptions::default()).expect("scripts/test has a driver");
        Renderer::new(&device).expect("a renderer")
    }

    fn cornell() -> Scene {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell.toml");
        let mut scene = Scene::load(path.as_ref()).expect("a scene");
        scene.indirect = Some(IndirectLight::final_gather(0.3));
        scene
    }

    #[test]
    fn cameras_in_flight_see_what_they_see_alone() {
        let scene = cornell();
        let cameras = cameras_of(&scene);
        let mut alone = renderer();
        let alone = cameras.iter().enumerate().map(|(place, camera)| {
            let mut options = RenderOptions {
                frame_index: Some(0),
                camera_index: place as u32,
                ..RenderOptions::default()
            };
            alone.render(&seen_by(&scene, camera), &mut options)
        });
        let alone: Vec<Frame> = alone.collect::<Result<_>>().expect("frames");
        let mut renderer = renderer();
        for in_flight in [1, 3, 4] {
            let mut fractions = Vec::new();
            let mut report = |progress: Progress| {
                fractions.push(progress.fraction);
                ControlFlow::Continue(())
            };
            let mut options = RenderOptions {
                progress: Some(&mut report),
                frame_index: Some(0),
                ..RenderOptions::default()
            };
            let frames = renderer.render_at_once(in_flight, &scene, &cameras, &mut options);
            let frames = frames.map_err(|(_, error)| error).expect("frames");
            for (frame, alone) in frames.iter().zip(&alone) {
                assert!(frame.layers == alone.layers);
                assert_eq!(frame.description.key, alone.description.key);
            }
            assert_eq!(frames.len(), alone.len());
            assert!(fractions.is_sorted() && fractions.last() == Some(&1.0));
        }
    }

    #[test]
    fn a_camera_that_fails_is_named() {
        let scene = cornell();
        let mut cameras = cameras_of(&scene);
        cameras[4].resolution_px = [0, 12];
        let mut renderer = renderer();
        for in_flight in [1, 3] {
            let mut options = RenderOptions::default();
            let failed = renderer.render_at_once(in_flight, &scene, &cameras, &mut options);
            let failed = failed.map(|_| ()).map_err(|(place, _)| place);
            assert_eq!(failed, Err(4));
        }
    }

    #[test]
    fn a_caller_ends_all_that_are_in_flight() {
        let scene = cornell();
        let cameras = cameras_of(&scene);
        let mut renderer = renderer();
        let mut report = |_| ControlFlow::Break(());
        let mut options = RenderOptions {
            progress: Some(&mut report),
            ..RenderOptions::default()
        };
        let ended = renderer.render_at_once(3, &scene, &cameras, &mut options);
        assert!(matches!(ended, Err((_, Error::Cancelled))));
        // The next ones are whole.
        let frames = renderer.render_at_once(3, &scene, &cameras, &mut RenderOptions::default());
        assert!(frames.is_ok_and(|frames| frames.len() == cameras.len()));
    }
}
