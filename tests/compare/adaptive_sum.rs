//! Interpolated RSM averages against the same sums at every pixel: the requested, the estimated and the true error, and the share of
//! the pairs that were summed.

use crate::common::gpu::{DEMO_SCENES, Gpu, assert_is_lit, demo_scene};
use crate::common::rmse;
use camlux::{
    Scene,
    output::{Frame, Layer},
    scene::{Bands, IndirectLight, Light, RsmAverage},
};
use glam::DVec3;

const SIZE_PX: [u32; 2] = [200, 200];
const RSM_SIZE: u32 = 64;

fn average(scene: &Scene, interpolation_error: Option<f64>) -> Scene {
    let mut scene = scene.clone();
    scene.indirect = Some(IndirectLight::RsmAverage(RsmAverage {
        rsm_size: RSM_SIZE,
        interpolation_error,
    }));
    scene
}

fn indirect(frame: &Frame) -> &[f32] {
    frame.values(Layer::Indirect).expect("it was asked for")
}

/// relRMSE of the indirect light against that of another frame.
fn error(frame: &Frame, exact: &Frame) -> f64 {
    let truth: Vec<Bands> = indirect(exact)
        .chunks_exact(3)
        .map(|bands| [0, 1, 2].map(|i| f64::from(bands[i])))
        .collect();
    rmse::relative_rmse(indirect(frame), &truth)
}

/// Renders, prints and checks: the true error is at most 1.3 times the requested one, and the estimate is close to the true error.
#[track_caller]
fn check(gpu: &mut Gpu, name: &str, scene: &Scene) {
    let exact = gpu.render(&average(scene, None));
    assert_eq!(exact.stats.estimated_interpolation_error, None);
    assert_eq!(exact.stats.estimated_error, None);
    for requested in [0.05, 0.01] {
        let frame = gpu.render(&average(scene, Some(requested)));
        let true_error = error(&frame, &exact);
        let stats = &frame.stats;
        let estimated = stats
            .estimated_interpolation_error
            .expect("it is estimated");
        // Interpolation only: the sum itself may be far from the true bounce.
        assert_eq!(stats.estimated_error, None);
        let share = stats.pixel_vpl_pairs as f64 / exact.stats.pixel_vpl_pairs as f64;
        let what = format!("{name}: requested {requested}");
        println!("{what}, estimated {estimated:.4}, true {true_error:.4}, {share:.3} of the pairs");
        assert_eq!(stats.vpl_count, exact.stats.vpl_count, "{what}");
        assert!(true_error <= 1.3 * requested, "{what}: {true_error}");
        assert!(
            estimated <= 1.5 * true_error + 0.003 && true_error <= 1.5 * estimated + 0.003,
            "{what}: {estimated} for {true_error}"
        );
        assert!(share < 0.3, "{what}: {share} of the pairs");
    }
}

#[test]
fn the_requested_error_is_met_in_the_demo_scenes() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        check(&mut gpu, name, &demo_scene(name, SIZE_PX));
    }
}

/// The VPL lists of both lights are stored one after the other, and the second is shorter. Tests matte and glossy surfaces.
#[test]
fn lights_are_summed_together() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "glossy"] {
        let mut scene = demo_scene(name, SIZE_PX);
        let more = Light::Directional {
            direction: DVec3::new(-0.3, -0.8, -0.6),
            irradiance_w_m2: [1.0, 2.0, 3.0],
        };
        scene.lights.push(more.into());
        check(&mut gpu, &format!("{name}, two lights"), &scene);
    }
}

/// The gathered pairs and the relative error do not depend on the light's power: the criteria are relative to the image's radiance.
#[test]
fn a_weak_light_is_treated_like_a_strong_one() {
    let mut gpu = Gpu::open();
    let mut scene = average(&demo_scene("cornell", SIZE_PX), Some(0.02));
    let strong = gpu.render(&scene);
    assert_is_lit(&strong, Layer::Indirect);
    let factor = f64::exp2(-24.0);
    let Light::Point { power_w, .. } = &mut scene.lights[0].light else {
        panic!("the scene has a point light");
    };
    *power_w = power_w.map(|power| factor * power);
    let weak = gpu.render(&scene);
    assert_eq!(weak.stats.pixel_vpl_pairs, strong.stats.pixel_vpl_pairs);
    let scaled: Vec<f32> = indirect(&strong)
        .iter()
        .map(|value| value * factor as f32)
        .collect();
    assert!(indirect(&weak) == scaled);
}

/// With few pixels or few VPLs, interpolation saves nothing: the image equals the sum at every pixel, bit for bit.
#[test]
fn small_work_is_done_in_full() {
    let mut gpu = Gpu::open();
    for (size_px, rsm_size) in [([100, 100], RSM_SIZE), (SIZE_PX, 8)] {
        let mut scene = demo_scene("textured", size_px);
        let mut render = |interpolation_error| {
            scene.indirect = Some(IndirectLight::RsmAverage(RsmAverage {
                rsm_size,
                interpolation_error,
            }));
            gpu.render(&scene)
        };
        let (exact, requested) = (render(None), render(Some(0.05)));
        assert_is_lit(&exact, Layer::Indirect);
        assert!(indirect(&requested) == indirect(&exact));
        let stats = &requested.stats;
        assert_eq!(stats.pixel_vpl_pairs, exact.stats.pixel_vpl_pairs);
        assert_eq!(stats.estimated_interpolation_error, Some(0.0));
        assert_eq!(stats.estimated_error, None);
    }
}
