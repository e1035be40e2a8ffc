//! The result does not depend on the kernel, the submissions, the order of meshes, or how lights are split.
//!
//! [`apart`] compares images: the largest difference of a value, divided by the mean of the image. A single wrong pixel shows.

use std::time::Duration;

use crate::common::gather::gather;
use crate::common::gpu::{Gpu, assert_is_lit, demo_scene, gather_kernels, sub_pixel_bits};
use camlux::{
    Scene,
    output::{Frame, Layer, LayerData},
    reference::Reference,
    scene::{Bands, IndirectLight, Light, PixelFilter, PixelSampling, VplSum},
};

/// Rounding of sums in another order. Measured on lavapipe: 0 almost everywhere, 4.3e-7 for half lights on glossy surfaces.
/// The requirement is 1e-5.
const BOUND: f64 = 1.3e-6;

/// max |a − b| / mean b over all pixels and bands.
fn apart(a: &Frame, b: &Frame, layer: Layer) -> f64 {
    let [a, b] = [a, b].map(|frame| frame.values(layer).expect("the layer is there"));
    apart_values(a, b)
}

fn apart_values(a: &[f32], b: &[f32]) -> f64 {
    let mean = b.iter().map(|&b| f64::from(b)).sum::<f64>() / b.len() as f64;
    assert!(mean > 0.0, "a black image proves nothing");
    let difference = |(&a, &b): (&f32, &f32)| (f64::from(a) - f64::from(b)).abs();
    a.iter().zip(b).map(difference).fold(0.0, f64::max) / mean
}

fn scene(name: &str, estimator: VplSum) -> Scene {
    let mut scene = demo_scene(name, [32, 32]);
    scene.indirect = Some(IndirectLight::vpl_sum(estimator, 16));
    scene
}

fn scale_emission(light: &mut Light, factor: f64) {
    *light = light.with_emission(light.emission().map(|value| value * factor));
}

/// Asserts that two frames hold the same light up to rounding.
#[track_caller]
fn assert_same(what: &str, a: &Frame, b: &Frame) {
    for layer in [Layer::Direct, Layer::Indirect] {
        let apart = apart(a, b, layer);
        println!("{what}, {}: {apart:.1e}", layer.name());
        assert!(apart <= BOUND, "{what}, {}: {apart:e}", layer.name());
    }
}

#[test]
fn every_gather_kernel_gives_the_same() {
    let mut gpu = Gpu::open();
    let kernels = gather_kernels(&gpu.device);
    for estimator in VplSum::ALL {
        for name in ["cornell", "glossy"] {
            let scene = scene(name, estimator);
            let mut render =
                |kernel| gpu.render_with(&scene, |options| options.gather_kernel = Some(kernel));
            let first = render(kernels[0]);
            for &kernel in &kernels[1..] {
                let what = format!("{name}, {}, {}", estimator.name(), kernel.name());
                assert_same(&what, &render(kernel), &first);
            }
        }
    }
}

/// A requested layer has the same values alone as among all layers. Layers that are not requested are absent, and those on request do not come
/// by themselves.
#[test]
fn a_frame_has_the_layers_that_are_wanted() {
    let mut gpu = Gpu::open();
    let mut with_all = demo_scene("tof_corner", [16, 12]);
    with_all.indirect = Some(gather!(0.5, stderr_layer = true, bounces = 2));
    let mut sampled = with_all.clone();
    sampled.camera.pixel_sampling = Some(PixelSampling {
        samples: 2,
        filter: PixelFilter::Box,
    });
    for scene in [with_all, sampled] {
        let without = gpu.render(&scene);
        let all: Vec<Layer> = without.layers.iter().map(|(layer, _)| *layer).collect();
        let made: Vec<Layer> = Layer::all()
            .filter(|layer| layer.is_made_for(&scene) && !layer.is_on_request())
            .collect();
        let on_request: Vec<Layer> = Layer::all()
            .filter(|layer| layer.is_made_for(&scene) && layer.is_on_request())
            .collect();
        assert!(on_request.len() >= 3);
        assert!(all.len() == made.len() && made.iter().all(|layer| all.contains(layer)));
        let everything = [all.clone(), on_request.clone()].concat();
        let whole = gpu.render_with(&scene, |options| options.layers = Some(&everything));
        assert!(whole.layers.len() == everything.len());
        let by_default = |(layer, _): &&(Layer, LayerData)| !layer.is_on_request();
        assert!(whole.layers.iter().filter(by_default).eq(&without.layers));
        let each = everything.iter().map(|&layer| vec![layer]);
        let some = vec![Layer::Depth, Layer::Indirect, Layer::MaterialId];
        for wanted in each.chain([some, Vec::new()]) {
            let frame = gpu.render_with(&scene, |options| options.layers = Some(&wanted));
            let expected = whole
                .layers
                .iter()
                .filter(|(layer, _)| wanted.contains(layer));
            assert!(frame.layers.iter().eq(expected), "{wanted:?}");
        }
    }
}

#[test]
fn a_layer_that_a_scene_does_not_have_is_refused() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("cornell", [8, 8]);
    (scene.sensor, scene.indirect) = (None, None);
    for (layer, hint) in [
        (Layer::Energy, "give the scene a sensor"),
        (Layer::Indirect, "give the scene indirect light"),
        (
            Layer::from_name("indirect.3").expect("a layer"),
            "let final-gather gather 3 bounces or more",
        ),
        (Layer::MeanDepth, "set samples"),
        (Layer::HalfPath, "give the scene time of flight"),
        (Layer::Edge, "take it from a reference or a sequence"),
    ] {
        let layers = [Layer::Direct, layer];
        let refused = gpu.try_render_with(&scene, |options| options.layers = Some(&layers));
        let message = refused.expect_err("it has none").to_string();
        let problem = format!("no layer {}; {hint}", layer.name());
        assert!(message.contains(&problem), "{message}");
    }
}

/// Neither the order of summation nor a pixel's samples may depend on the device's speed.
#[test]
fn submissions_do_not_show() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "glossy"] {
        let sums = VplSum::ALL.map(|sum| IndirectLight::vpl_sum(sum, 64));
        for indirect in sums.into_iter().chain([IndirectLight::final_gather(0.05)]) {
            let mut scene = demo_scene(name, [160, 160]);
            // More work than fits the first submission, which has a fixed size, and VPLs for several dispatches.
            scene.indirect = Some(indirect);
            let mut render = |submission_target| {
                gpu.render_with(&scene, |options| {
                    options.submission_target = submission_target
                })
            };
            let few = render(Duration::from_secs(1000));
            let many = render(Duration::ZERO);
            assert_is_lit(&few, Layer::Indirect);
            let counts = [&few, &many].map(|frame| frame.stats.submissions);
            println!("{name}: {counts:?} submissions");
            assert!(counts[1] >= counts[0] + 3, "{name}: {counts:?}");
            // The number of these submissions depends on the device's speed.
            let some = render(Duration::from_millis(5));
            for other in [many, some] {
                assert!(few.layers == other.layers, "{name}, {indirect:?}");
            }
        }
    }
}

#[test]
fn a_light_is_two_of_half_its_power() {
    let mut gpu = Gpu::open();
    for estimator in VplSum::ALL {
        for name in ["cornell", "cornell_spot", "glossy"] {
            let one = scene(name, estimator);
            let mut two = one.clone();
            scale_emission(&mut two.lights[0], 0.5);
            two.lights.push(two.lights[0].clone());
            let what = format!("{name}, {}", estimator.name());
            assert_same(&what, &gpu.render(&two), &gpu.render(&one));
        }
    }
}

#[test]
fn lights_add_up() {
    let mut gpu = Gpu::open();
    for estimator in VplSum::ALL {
        // A directional and a point light from the file, and a spot light: all kinds use the same maps, one after another.
        let mut all = scene("textured", estimator);
        all.lights
            .push(demo_scene("knot", [1, 1]).lights[0].clone());
        let together = gpu.render(&all);
        for layer in [Layer::Direct, Layer::Indirect] {
            let mut sum = vec![0.0f32; together.values(layer).expect("it is there").len()];
            for light in &all.lights {
                let mut alone = all.clone();
                alone.lights = vec![light.clone()];
                let frame = gpu.render(&alone);
                let values = frame.values(layer).expect("it is there");
                sum.iter_mut().zip(values).for_each(|(sum, v)| *sum += v);
            }
            // Relative to the pixel's own value where it exceeds the mean: a spike of 1/d² is rounded like any other value.
            let mean = sum.iter().map(|&v| f64::from(v)).sum::<f64>() / sum.len() as f64;
            assert!(mean > 0.0, "a black image proves nothing");
            let values = together.values(layer).expect("it is there").iter();
            let apart = values.zip(&sum).map(|(&a, &b)| {
                let [a, b] = [a, b].map(f64::from);
                (a - b).abs() / b.max(mean)
            });
            let apart = apart.fold(0.0, f64::max);
            println!("{}, {}: {apart:.1e}", estimator.name(), layer.name());
            assert!(apart <= BOUND, "{estimator:?} {layer:?}: {apart:e}");
        }
    }
}

#[test]
fn meshes_have_no_order() {
    let mut gpu = Gpu::open();
    for estimator in VplSum::ALL {
        let scene = scene("glossy", estimator);
        let mut turned = scene.clone();
        turned.meshes.reverse();
        for mesh in &mut turned.meshes {
            mesh.triangles.reverse();
            mesh.triangle_materials.reverse();
        }
        let reference = Reference::new(&scene, 1).expect("the scene is valid");
        let reference = reference.with_sub_pixel_bits(sub_pixel_bits()).frame();
        let edges = reference.ids(Layer::Edge).expect("a reference marks edges");
        let [scene, turned] = [&scene, &turned].map(|scene| gpu.render(scene));
        for layer in [Layer::Direct, Layer::Indirect] {
            // On an edge, the surface that is drawn first may stay.
            let [a, b] = [&turned, &scene].map(|frame| away_from(edges, frame, layer));
            let apart = apart_values(&a, &b);
            println!("{}, {}: {apart:.1e}", estimator.name(), layer.name());
            assert!(apart <= BOUND, "{apart:e}");
        }
        assert_ne!(
            scene.ids(Layer::InstanceId),
            turned.ids(Layer::InstanceId),
            "the order did change"
        );
    }
}

fn away_from(edges: &[u32], frame: &Frame, layer: Layer) -> Vec<f32> {
    let pixels = frame.values(layer).expect("it is there").chunks_exact(3);
    let pixels = pixels.zip(edges).filter(|&(_, &edge)| edge == 0);
    pixels.flat_map(|(pixel, _)| pixel).copied().collect()
}

/// Radiometry is linear, and a factor of two is exact in binary.
#[test]
fn twice_the_power_is_twice_the_light_to_the_bit() {
    let mut gpu = Gpu::open();
    for estimator in VplSum::ALL {
        for name in ["cornell", "cornell_spot", "textured"] {
            let once = scene(name, estimator);
            let mut twice = once.clone();
            for light in &mut twice.lights {
                scale_emission(light, 2.0);
            }
            let [once, twice] = [&once, &twice].map(|scene| gpu.render(scene));
            assert_is_lit(&once, Layer::Direct);
            assert_is_lit(&once, Layer::Indirect);
            for layer in [
                Layer::Radiance,
                Layer::Direct,
                Layer::Indirect,
                Layer::Energy,
            ] {
                let [once, twice] = [&once, &twice].map(|f| f.values(layer).expect("it is there"));
                let doubled: Vec<f32> = once.iter().map(|&value| 2.0 * value).collect();
                assert!(doubled == twice, "{name} {estimator:?} {layer:?}");
            }
        }
    }
}

/// Bands do not mix: power in one band only gives light in that band only.
#[test]
fn bands_are_independent() {
    let mut gpu = Gpu::open();
    for estimator in VplSum::ALL {
        let mut white = scene("cornell", estimator);
        let mut green = white.clone();
        for (scene, power_w) in [(&mut white, [40.0; 3]), (&mut green, [0.0, 40.0, 0.0])] {
            set_power(&mut scene.lights[0], power_w);
        }
        let [white, green] = [&white, &green].map(|scene| gpu.render(scene));
        for layer in [Layer::Direct, Layer::Indirect] {
            assert_is_lit(&green, layer);
            let [white, green] = [&white, &green].map(|f| f.values(layer).expect("it is there"));
            for (white, green) in white.chunks_exact(3).zip(green.chunks_exact(3)) {
                assert_eq!(green, [0.0, white[1], 0.0], "{estimator:?} {layer:?}");
            }
        }
    }
}

fn set_power(light: &mut Light, bands: Bands) {
    assert_eq!(light.emission_name(), "power_w");
    *light = light.with_emission(bands);
}
