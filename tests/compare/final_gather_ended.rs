//! `final-gather` that a budget, the caller or a cancel ends before its target is met.

use std::ops::ControlFlow;

use crate::common::gather::gather;
use crate::common::gpu::{Gpu, demo_scene};
use crate::common::reference_frame::values;
use crate::common::rooms::{quad, scene_of};
use crate::final_gather::{error_and_bias, final_gather, reference_of};
use camlux::{
    Error, Progress, RenderOptions,
    output::{FrameStats, Layer, StopReason},
    scene::{IndirectLight, Light},
};
use glam::DVec3;

/// If the rays run out before the target is met, the frame is the best image that they allow, and its estimated error is right.
#[test]
fn a_budget_ends_with_an_honest_image() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "glossy"] {
        let mut scene = demo_scene(name, [64, 64]);
        let truth = reference_of(&scene, 256);
        let mut last: Option<FrameStats> = None;
        for max_rays in [1, 100_000, 300_000, 1_000_000, 5_000_000, 20_000_000] {
            scene.indirect = Some(gather!(0.002, max_rays = Some(max_rays)));
            let frame = gpu.render(&scene);
            let (error, bias) = error_and_bias(&frame, &truth);
            let stats = &frame.stats;
            let estimated = stats.estimated_error.expect("it is estimated");
            let rays = stats.ray_count;
            println!(
                "{name}: {max_rays} rays allowed, {rays} sent: estimated {estimated:.4}, true {error:.4}, bias {bias:+.4}"
            );
            assert_eq!(stats.stop, Some(StopReason::BudgetSpent));
            // A small budget leaves few pixels for the estimate.
            let slack = if max_rays < 1_000_000 { 2.5 } else { 1.5 };
            assert!(estimated <= slack * error + 0.005 && error <= slack * estimated + 0.005);
            let least = stats.least_rays.expect("there was a first image");
            assert!(least < 120_000, "{least}");
            assert!(rays <= least.max(max_rays * 105 / 100), "{rays}");
            // Neither are they left unused.
            assert!(max_rays < least || rays > max_rays / 2, "{rays}");
            if let Some(last) = &last {
                assert!(rays > last.ray_count);
                assert_ne!(stats.estimated_error, last.estimated_error);
            }
            last = Some(frame.stats);
        }
    }
}

/// The lit block's side is three pixels wide, and most of the error is there while rays are few: neighbours along it are all that
/// predicts its pixels. Their standard errors were infinite, so that none of them was looked at, and the estimate was a fifth of the error.
#[test]
fn a_face_that_a_budget_fills_from_its_ends_is_told() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("cornell_spot", [128, 128]);
    let truth = reference_of(&scene, 64);
    let edges = truth.ids(Layer::Edge).expect("a reference marks edges");
    for rays in [100_000, 200_000] {
        let indirect = gather!(0.002, max_rays = Some(rays), stderr_layer = true);
        scene.indirect = Some(indirect);
        for seed in 0..4 {
            let frame = gpu.render_seeded(&scene, seed);
            let [image, own, reference] = [
                (&frame, Layer::Indirect),
                (&frame, Layer::StandardError),
                (&truth, Layer::Indirect),
            ]
            .map(|(of, layer)| values(of, layer));
            let inside = (0..image.len()).filter(|index| edges[index / 3] == 0);
            let (mut of_image, mut of_layer) = (0.0, 0.0);
            for index in inside {
                of_image += f64::from(image[index] - reference[index]).powi(2);
                of_layer += f64::from(own[index]).powi(2);
            }
            let ratio = (of_layer / of_image).sqrt();
            let (error, _) = error_and_bias(&frame, &truth);
            let upper = frame.stats.estimated_error_upper.expect("it is bounded");
            println!("{rays} rays: true {error:.3}, bound {upper:.3}, standard errors {ratio:.2}");
            assert!((0.5..2.0).contains(&ratio), "{ratio}");
            assert!(
                error < 1.1 * upper && upper < 3.0 * error,
                "{error} {upper}"
            );
        }
    }
}

/// If a limit ends the search for light before any is found, the frame says so. Light enters between two plates, 10 µm apart.
#[test]
fn a_budget_that_finds_no_light_is_spent() {
    const PLATE_M: f64 = 50.0;
    let plate = |name, x_m: f64| {
        let corner = DVec3::new(x_m, 0.6, -0.5 * PLATE_M);
        quad(name, corner, PLATE_M * DVec3::X, PLATE_M * DVec3::Z, 0)
    };
    let meshes = vec![
        quad(
            "floor",
            DVec3::new(-2.0, 0.0, -2.0),
            4.0 * DVec3::X,
            4.0 * DVec3::Z,
            0,
        ),
        quad(
            "wall",
            DVec3::new(-2.0, 0.0, -2.0),
            4.0 * DVec3::X,
            DVec3::Y,
            0,
        ),
        plate("left", -PLATE_M),
        plate("right", 1e-5),
    ];
    let lamp = Light::point(DVec3::new(0.0, 1.0, 0.0), [1.0; 3]);
    let camera_m = DVec3::new(0.0, 0.5, 1.8);
    let scene = scene_of(meshes, lamp, camera_m, DVec3::new(0.0, 0.1, 0.0));
    let mut gpu = Gpu::open();
    for max_rays in [Some(1), None] {
        let mut scene = scene.clone();
        scene.indirect = Some(gather!(0.1, max_rays = max_rays));
        let frame = gpu.render(&scene);
        let indirect = values(&frame, Layer::Indirect);
        assert!(indirect.iter().all(|&x| x == 0.0));
        let is_limited = max_rays.is_some();
        assert_eq!(
            frame.stats.stop,
            is_limited.then_some(StopReason::BudgetSpent)
        );
        let warns = |text: &String| text.contains("max_rays = 1");
        assert_eq!(frame.warnings().iter().any(warns), is_limited);
    }
}

/// Progress never goes back. `Break` from the callback ends the render with an error.
#[test]
fn progress_and_cancelling() {
    let mut gpu = Gpu::open();
    let scene = final_gather(demo_scene("cornell", [64, 64]), 0.05);
    let mut seen = Vec::new();
    let mut report = |progress: Progress| {
        seen.push(progress.fraction);
        ControlFlow::Continue(())
    };
    gpu.render_with(&scene, |options| options.progress = Some(&mut report));
    assert!(seen.len() > 10);
    assert!(
        seen.is_sorted() && seen.iter().all(|f| (0.0..=1.0).contains(f)),
        "{seen:?}"
    );
    let mut left = seen.len() / 2;
    let mut cancel = |_| {
        left -= 1;
        if left == 0 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let cancelled = gpu.try_render_with(&scene, |options| options.progress = Some(&mut cancel));
    assert!(matches!(cancelled, Err(Error::Cancelled)));
    gpu.render(&scene);
}

/// Whenever it is ended, a frame has all its direct light, and a bounce whose error it knows.
#[test]
fn a_frame_that_is_ended_keeps_what_it_has() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("cornell_spot", [96, 96]);
    let truth = reference_of(&scene, 64);
    scene.indirect = Some(IndirectLight::final_gather(0.01));
    let mut reports = 0;
    let mut count = |_| {
        reports += 1;
        ControlFlow::Continue(())
    };
    let whole = gpu.render_with(&scene, |options| options.progress = Some(&mut count));
    let mut last_rays = 0;
    for share in [0.0, 0.1, 0.4, 0.7] {
        let mut left = (share * f64::from(reports)) as u32;
        let mut end = |_| {
            let ends = left == 0;
            left = left.saturating_sub(1);
            match ends {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        };
        let mut options = RenderOptions {
            progress: Some(&mut end),
            keep_partial: true,
            ..RenderOptions::default()
        };
        let frame = gpu.renderer.render(&scene, &mut options);
        let frame = frame.expect("it ends with what it has");
        let stats = &frame.stats;
        let (error, _) = error_and_bias(&frame, &truth);
        let estimated = stats.estimated_error.expect("it is estimated");
        println!(
            "ended after {share} of {reports} reports: estimated {estimated:.4}, true {error:.4}, {} rays",
            stats.ray_count
        );
        assert_eq!(stats.stop, Some(StopReason::Cancelled));
        assert_eq!(frame.values(Layer::Direct), whole.values(Layer::Direct));
        assert!(estimated <= 2.5 * error + 0.005 && error <= 2.5 * estimated + 0.005);
        assert!(stats.ray_count >= last_rays && stats.ray_count < whole.stats.ray_count);
        last_rays = stats.ray_count;
        assert!(
            frame
                .warnings()
                .iter()
                .any(|text| text.contains("was ended"))
        );
    }
    let next = gpu.renderer.render(&scene, &mut RenderOptions::default());
    assert_eq!(next.expect("it renders").layers, whole.layers);
}
