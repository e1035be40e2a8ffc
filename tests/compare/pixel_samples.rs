//! Pixels that average light over their area, against the reference, which draws its own points in each pixel.

use std::ops::ControlFlow;

use crate::common::gpu::{Gpu, demo_scene, distort, rational};
use crate::common::reference_frame::{reference_frame, values};
use crate::tof::modulated_demo_scene;
use camlux::{
    Progress, Scene,
    metrics::{Comparison, Pixels},
    output::{Layer, TofQuantity},
    scene::{IndirectLight, PixelFilter, PixelSampling, Shadow, VplSum},
};

fn sampled(mut scene: Scene, samples: u32, filter: PixelFilter) -> Scene {
    scene.camera.pixel_sampling = Some(PixelSampling { samples, filter });
    scene
}

/// sqrt(Σ(x−t)²/Σt²) over the values that are finite in both.
fn relative_rmse(found: &[f32], due: &[f32]) -> f64 {
    let pairs = found
        .iter()
        .zip(due)
        .map(|(x, t)| (f64::from(*x), f64::from(*t)));
    let finite = pairs.filter(|(x, t)| x.is_finite() && t.is_finite());
    let sums = finite.fold((0.0, 0.0, 0), |(error, total, count), (x, t)| {
        (error + (x - t).powi(2), total + t * t, count + 1)
    });
    assert!(sums.2 > 1000, "{} values", sums.2);
    (sums.0 / sums.1).sqrt()
}

#[test]
fn direct_light_and_depths_are_means_over_the_area() {
    let mut gpu = Gpu::open();
    for (name, size, samples, filter, is_distorted) in [
        ("cornell", 160, 16, PixelFilter::Box, false),
        ("cornell", 64, 64, PixelFilter::Box, true),
        ("cornell", 64, 64, PixelFilter::Gaussian, false),
        ("textured", 64, 64, PixelFilter::Box, false),
        ("glossy", 64, 64, PixelFilter::Box, false),
        // Its flutes are finer than these pixels.
        ("knot", 48, 256, PixelFilter::Box, false),
    ] {
        let mut scene = sampled(demo_scene(name, [size; 2]), samples, filter);
        scene.indirect = None;
        scene.direct.shadow = Some(Shadow::Rays);
        if is_distorted {
            distort(
                &mut scene,
                rational([-0.3, 0.1, 0.002, -0.001, 0.0, 0.0, 0.0, 0.0]),
            );
        }
        let frame = gpu.render(&scene);
        let truth = reference_frame(&scene, 256, 0);
        let error = |layer| relative_rmse(values(&frame, layer), values(&truth, layer));
        let [direct, radiance] = [Layer::Direct, Layer::Radiance].map(error);
        println!("{name}, {samples} {}: {direct:.2e}", filter.name());
        assert!(direct < 0.01 && radiance == direct, "{name}: {direct}");
        let [mean, nearest] = [Layer::MeanDepth, Layer::NearestDepth];
        let depth = error(mean);
        assert!(depth < 0.01, "{name}: depths {depth}");
        let pixels = values(&frame, nearest).iter().zip(values(&frame, mean));
        for (nearest, mean) in pixels {
            assert!(*nearest <= mean * 1.000_001, "{nearest} > {mean}");
        }
    }
}

/// Includes pixels that show surfaces which no pixel centre shows.
#[test]
fn the_bounce_is_within_the_target_error_of_that_of_the_area() {
    let mut gpu = Gpu::open();
    for (name, samples, rounds, filter) in [
        ("cornell", 64, 32, PixelFilter::Box),
        ("glossy", 64, 64, PixelFilter::Gaussian),
    ] {
        let mut scene = sampled(demo_scene(name, [48, 48]), samples, filter);
        scene.indirect = Some(IndirectLight::final_gather(0.02));
        let frame = gpu.render(&scene);
        let truth = reference_frame(&scene, 256, rounds);
        let ids = truth.ids(Layer::InstanceId).expect("it is there");
        let seen: Vec<bool> = ids.iter().map(|&id| id != 0).collect();
        let compared = Comparison::new(&Pixels {
            image: values(&frame, Layer::Indirect),
            reference: values(&truth, Layer::Indirect),
            image_standard_error: None,
            reference_standard_error: Some(values(&truth, Layer::StandardError)),
            valid: &seen,
            edges: None,
            channels: 3,
        });
        let compared = compared.expect("images of one size");
        let error = compared.errors.expect("it is not black").rmse;
        let noise = compared.noise.expect("it has a standard error").floor;
        let error = (error.powi(2) - noise.powi(2)).sqrt();
        println!("{name}: {error:.2e}, noise of the reference {noise:.2e}");
        assert!(
            noise < 0.012 && error < 0.02,
            "{name}: {error}, noise {noise}"
        );
    }
}

/// The sums have no reference. An image at eight times the resolution has the same number of points per coarse pixel.
#[test]
fn sums_are_averaged_as_well() {
    let mut gpu = Gpu::open();
    let mut fine = demo_scene("cornell", [384, 384]);
    fine.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 16));
    let mut coarse = sampled(fine.clone(), 64, PixelFilter::Box);
    coarse.camera.resolution_px = [48, 48];
    let found = gpu.render(&coarse);
    let image = gpu.render(&fine);
    let errors = [Layer::Direct, Layer::Indirect].map(|layer| {
        let mut due = vec![0.0; 3 * 48 * 48];
        for (i, value) in values(&image, layer).iter().enumerate() {
            let (pixel, band) = (i / 3, i % 3);
            let (x, y) = (pixel % 384 / 8, pixel / 384 / 8);
            due[3 * (48 * y + x) + band] += value / 64.0;
        }
        relative_rmse(values(&found, layer), &due)
    });
    println!("{errors:?}");
    // The fine image's points are in rows, parallel to edges, which adds error.
    assert!(errors[0] < 0.015 && errors[1] < 0.02, "{errors:?}");
}

/// Flying pixels: a pixel that sees two distances has the phase of neither.
#[test]
fn phasors_are_averaged_with_the_way_of_each_sample() {
    let scene = modulated_demo_scene("cornell", [40, 40], &[20e6, 100e6]);
    let mut scene = sampled(scene, 64, PixelFilter::Box);
    scene.indirect = None;
    let mut gpu = Gpu::open();
    for is_bounced in [false, true] {
        scene.indirect = is_bounced.then(|| IndirectLight::final_gather(0.03));
        let frame = gpu.render(&scene);
        let truth = reference_frame(&scene, 256, if is_bounced { 16 } else { 0 });
        for frequency in 0..2 {
            let quantity = if is_bounced {
                TofQuantity::PhasorIndirect
            } else {
                TofQuantity::PhasorDirect
            };
            let layer = Layer::Tof(frequency, quantity);
            let error = relative_rmse(values(&frame, layer), values(&truth, layer));
            println!("{layer:?}: {error:.2e}");
            let bar = if is_bounced { 0.05 } else { 0.01 };
            assert!(error < bar, "{layer:?}: {error}");
        }
    }
}

#[test]
fn progress_goes_forward_only() {
    let mut gpu = Gpu::open();
    for has_bounce in [false, true] {
        let mut scene = sampled(demo_scene("cornell", [24, 24]), 5, PixelFilter::Box);
        scene.indirect = has_bounce.then(|| IndirectLight::final_gather(0.1));
        let mut told = Vec::new();
        let mut report = |progress: Progress| {
            told.push(progress.fraction);
            ControlFlow::Continue(())
        };
        gpu.render_with(&scene, |options| options.progress = Some(&mut report));
        assert!(told.len() > 5 && told.is_sorted(), "{told:?}");
        assert!(told[0] >= 0.0 && told.last() == Some(&1.0), "{told:?}");
    }
}
