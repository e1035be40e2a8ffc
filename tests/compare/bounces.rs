//! Final gathering of more than one bounce, against closed forms and against the reference, which samples paths with its own code.

use std::{f64::consts::TAU, num::NonZeroU8, ops::ControlFlow};

use crate::common::gather::gather;
use crate::common::gpu::{Gpu, demo_scene};
use crate::common::reference_frame::{add_rounds, error_of_indirect, reference_frame, values};
use crate::reference::lit_sphere;
use camlux::{
    Progress, Scene,
    hard_cases::scenes::with_tof,
    model::{Phasor, SPEED_OF_LIGHT_M_S},
    output::{Frame, Layer, StopReason, TofQuantity},
    reference::Reference,
    scene::{Material, MetallicRoughness},
};
use glam::DVec3;

/// Inside a sphere with k_d = 0.5, whose lamp at the centre lights it with 0.5 W/sr/m².
fn sphere(camera_m: DVec3) -> Scene {
    let mut scene = lit_sphere(Vec::new(), camera_m);
    scene.camera.resolution_px = [16, 12];
    scene
}

/// All points of a sphere send each other the same share of light: bounce k of direct light L is ρ^k·L. 16 bounces are all but the limit.
#[test]
fn an_integrating_sphere_has_a_geometric_series() {
    let mut gpu = Gpu::open();
    let mut scene = sphere(DVec3::new(0.3, -0.2, 0.1));
    for bounces in [1, 2, 4, 8, 16] {
        scene.indirect = Some(gather!(0.004, bounces = bounces));
        let frame = gpu.render(&scene);
        let found = values(&frame, Layer::Indirect);
        let mean = found.iter().map(|&value| f64::from(value)).sum::<f64>() / found.len() as f64;
        let expected = 0.5 * (1.0 - 0.5_f64.powi(bounces as i32));
        let upper = frame.stats.estimated_error_upper.expect("it has one");
        println!(
            "{bounces} bounces: mean {:.1e} off, below {upper:.1e}",
            mean / expected - 1.0
        );
        assert!((mean / expected - 1.0).abs() < 3e-3, "{mean} {expected}");
        assert!(upper < 0.004);
    }
}

/// Chords between points of a sphere have the density d/(2R²) of their length d, whatever came before. So Z of bounce k is that of direct
/// light times (ρ·G)^k, with their characteristic function G(x) = 2[e^{ix}(1 − ix) − 1]/x², x = 4πfR/c.
#[test]
fn phasors_of_an_integrating_sphere_are_powers_of_its_chords() {
    let mut gpu = Gpu::open();
    let frequencies_hz = [20e6, 100e6];
    let mut scene = with_tof(sphere(DVec3::new(0.3, -0.2, 0.1)), &frequencies_hz);
    for bounces in [1, 2, 4, 8] {
        // The mean over all pixels and frames is far more accurate than each.
        scene.indirect = Some(gather!(0.02, bounces = bounces));
        let frames: Vec<Frame> = (0..2).map(|seed| gpu.render_seeded(&scene, seed)).collect();
        for (i, frequency_hz) in frequencies_hz.into_iter().enumerate() {
            let sum = |quantity| {
                let layer = Layer::Tof(i as u8, quantity);
                let z = frames
                    .iter()
                    .flat_map(|frame| values(frame, layer).as_chunks::<2>().0);
                let z = z.map(|z| z.map(f64::from));
                z.map(|[re, im]| Phasor { re, im }).sum::<Phasor>()
            };
            let x = 2.0 * TAU * frequency_hz / SPEED_OF_LIGHT_M_S;
            let per_bounce = Phasor {
                re: x.cos() + x * x.sin() - 1.0,
                im: x.sin() - x * x.cos(),
            } * (0.5 * 2.0 / (x * x));
            let each = (0..bounces).scan(sum(TofQuantity::PhasorDirect), |before, _| {
                *before = *before * per_bounce;
                Some(*before)
            });
            let expected: Phasor = each.sum();
            let found = sum(TofQuantity::PhasorIndirect);
            let off = (found.re - expected.re).hypot(found.im - expected.im);
            println!(
                "{bounces} bounces, {frequency_hz:e} Hz: off by {:.1e}",
                off / expected.magnitude()
            );
            assert!(off <= 3e-3 * expected.magnitude(), "{found:?} {expected:?}");
        }
    }
}

fn bounce(number: u8) -> NonZeroU8 {
    NonZeroU8::new(number).expect("bounces are counted from 1")
}

/// Each bounce of an integrating sphere has its own layer, with the powers of the albedo and of the chords as above. Errors are relative to
/// all indirect light.
#[test]
fn layers_of_bounces_are_the_terms_of_the_series() {
    let mut gpu = Gpu::open();
    let frequency_hz = 20e6;
    let mut scene = with_tof(sphere(DVec3::new(0.3, -0.2, 0.1)), &[frequency_hz]);
    scene.indirect = Some(gather!(0.03, bounces = 4));
    let numbers = [1, 2, 4];
    let phasor = |number| Layer::Tof(0, TofQuantity::PhasorBounce(bounce(number)));
    let direct = Layer::Tof(0, TofQuantity::PhasorDirect);
    let mut layers = vec![Layer::Direct, direct];
    layers.extend(numbers.map(|number| Layer::Bounce(bounce(number))));
    layers.extend(numbers.map(phasor));
    let frame = gpu.render_with(&scene, |options| options.layers = Some(&layers));
    assert_eq!(frame.layers.len(), layers.len());
    let z = |layer| {
        let pairs = values(&frame, layer).as_chunks::<2>().0.iter();
        let pairs = pairs.map(|z| z.map(f64::from));
        pairs.map(|[re, im]| Phasor { re, im }).sum::<Phasor>()
    };
    let mean = |layer| {
        let values = values(&frame, layer);
        values.iter().copied().map(f64::from).sum::<f64>() / values.len() as f64
    };
    let x = 2.0 * TAU * frequency_hz / SPEED_OF_LIGHT_M_S;
    let per_bounce = Phasor {
        re: x.cos() + x * x.sin() - 1.0,
        im: x.sin() - x * x.cos(),
    } * (0.5 * 2.0 / (x * x));
    for number in numbers {
        let expected = mean(Layer::Direct) * 0.5_f64.powi(number.into());
        let off = (mean(Layer::Bounce(bounce(number))) - expected) / mean(Layer::Direct);
        let expected = (0..number).fold(z(direct), |z, _| z * per_bounce);
        let found = z(phasor(number));
        let off_z = (found.re - expected.re).hypot(found.im - expected.im) / z(direct).magnitude();
        println!("bounce {number}: {off:.1e} off, its phasor {off_z:.1e}");
        assert!(off.abs() < 2e-3, "{off}");
        assert!(off_z < 3e-3, "{off_z}");
    }
}

/// All gathers of a frame together keep its limit, and its progress rises once.
#[test]
fn gathers_of_bounces_share_limits_and_progress() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("cornell_spot", [48, 48]);
    let most = 2_400_000;
    scene.indirect = Some(gather!(0.01, bounces = 3, max_rays = Some(most)));
    // A layer may be named twice.
    let layers = ["indirect.1", "indirect.3", "indirect", "indirect.3"].map(Layer::from_name);
    let layers = layers.map(|layer| layer.expect("a layer"));
    let mut reports = Vec::new();
    let mut report = |progress| {
        reports.push(progress);
        ControlFlow::Continue(())
    };
    let frame = gpu.render_with(&scene, |options| {
        options.layers = Some(&layers);
        options.progress = Some(&mut report);
    });
    assert_eq!(frame.stats.stop, Some(StopReason::BudgetSpent));
    assert!(
        (most / 2..=most).contains(&frame.stats.ray_count),
        "{}",
        frame.stats.ray_count
    );
    assert!(reports.is_sorted_by(|a, b| a.fraction <= b.fraction));
    let ends = reports.iter().filter(|progress| progress.pass == "done");
    assert!(ends.count() == 1 && reports.last().is_some_and(|last| last.fraction == 1.0));
    assert_eq!(frame.layers.len(), 3);
    for layer in layers {
        assert!(values(&frame, layer).iter().any(|value| *value > 0.0));
    }
    // Once it is ended, nothing more is asked.
    let mut asked = 0;
    let mut end = |progress: Progress| {
        asked += usize::from(progress.fraction > 0.2);
        match progress.fraction > 0.2 {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    };
    let ended = gpu.render_with(&scene, |options| {
        options.layers = Some(&layers);
        options.keep_partial = true;
        options.progress = Some(&mut end);
    });
    assert_eq!(asked, 1);
    assert_eq!(ended.stats.stop, Some(StopReason::Cancelled));
    assert!(ended.stats.ray_count < frame.stats.ray_count);
}

/// One bounce alone, without the pixels at edges: with the same random numbers, references of one bounce more differ by it.
fn bounce_of_reference(scene: &Scene, bounces: u32, seed: u16) -> Vec<[f64; 3]> {
    let mut scene = scene.clone();
    let up_to = (bounces.max(2) - 1..=bounces).map(|bounces| {
        scene.indirect = Some(gather!(0.1, bounces = bounces));
        let reference = Reference::new(&scene, 256).expect("a valid scene");
        let mut reference = reference.with_seed(seed);
        add_rounds(&mut reference, 6);
        reference.frame()
    });
    let up_to: Vec<Frame> = up_to.collect();
    let mut light = pixels_off_edges(&up_to[up_to.len() - 1], Layer::Indirect, &up_to[0]);
    if bounces > 1 {
        let fewer = pixels_off_edges(&up_to[0], Layer::Indirect, &up_to[0]);
        for (light, fewer) in light.iter_mut().zip(fewer) {
            *light = [0, 1, 2].map(|band| light[band] - fewer[band]);
        }
    }
    light
}

fn pixels_off_edges(frame: &Frame, layer: Layer, reference: &Frame) -> Vec<[f64; 3]> {
    let edges = reference.ids(Layer::Edge).expect("a reference has it");
    let (pixels, _) = values(frame, layer).as_chunks::<3>();
    let inside = pixels.iter().zip(edges).filter(|(_, edge)| **edge == 0);
    inside.map(|(pixel, _)| pixel.map(f64::from)).collect()
}

#[test]
fn layers_of_bounces_are_those_of_the_reference() {
    let mut gpu = Gpu::open();
    let target = 0.05;
    let demo = |name| demo_scene(name, [20, 20]);
    for (name, mut scene) in [
        ("cornell_spot", demo("cornell_spot")),
        ("glossy", demo("glossy")),
        ("facets", facets()),
        ("ceiling", ceiling()),
    ] {
        scene.indirect = Some(gather!(target, bounces = 3));
        let numbers = [1, 2];
        let layers = numbers.map(|number| Layer::Bounce(bounce(number)));
        let read = [&layers[..], &[Layer::Indirect]].concat();
        let frame = gpu.render_with(&scene, |options| options.layers = Some(&read));
        let edges = reference_frame(&scene, 1, 0);
        let all = pixels_off_edges(&frame, Layer::Indirect, &edges);
        let sum_of_all: f64 = all.iter().flatten().sum();
        let all_light: f64 = all.iter().flatten().map(|value| value * value).sum();
        for (number, layer) in numbers.into_iter().zip(layers) {
            let found = pixels_off_edges(&frame, layer, &edges);
            let [a, b] = [0, 1].map(|seed| bounce_of_reference(&scene, number.into(), seed));
            let [mut square, mut noise, mut sum, mut true_sum] = [0.0; 4];
            for ((x, a), b) in found.iter().zip(&a).zip(&b) {
                for band in 0..3 {
                    let mean = 0.5 * (a[band] + b[band]);
                    square += (x[band] - mean).powi(2);
                    noise += (0.5 * (a[band] - b[band])).powi(2);
                    sum += x[band];
                    true_sum += mean;
                }
            }
            let error = ((square - noise).max(0.0) / all_light).sqrt();
            let noise = (noise / all_light).sqrt();
            let off = (sum - true_sum) / sum_of_all;
            println!(
                "{name}, bounce {number}: {error:.4}, noise of the reference {noise:.4}; mean {off:.1e} off"
            );
            assert!(noise < 0.04, "{noise}");
            assert!(error < 1.1 * target, "{error}");
            assert!(off.abs() < 0.01, "{off}");
        }
    }
}

/// A room of rough, half metallic facets.
fn facets() -> Scene {
    let mut scene = demo_scene("cornell", [20, 20]);
    for material in &mut scene.materials {
        material.microfacets = Some(MetallicRoughness {
            roughness: 0.5,
            metallic: 0.5,
            ..MetallicRoughness::DEFAULT
        });
    }
    scene
}

/// A box lit by a part of its ceiling that emits.
fn ceiling() -> Scene {
    let mut scene = demo_scene("cornell", [20, 20]);
    scene.materials.push(Material {
        emission_w_sr_m2: [30.0, 20.0, 12.0],
        is_one_sided: true,
        ..Material::lambert("lamp", [0.3; 3])
    });
    let lamp = crate::common::rooms::quad(
        "lamp",
        DVec3::new(-0.3, 1.98, -0.2),
        0.6 * DVec3::X,
        0.4 * DVec3::Z,
        scene.materials.len() as u32 - 1,
    );
    scene.meshes.push(lamp.into());
    scene.lights.clear();
    scene
}

/// The target error is met: with spots, textures, lobes of Phong and of facets, areas, and surfaces that emit.
#[test]
fn more_bounces_are_those_of_the_reference() {
    let mut gpu = Gpu::open();
    let target = 0.05;
    let demo = |name| demo_scene(name, [20, 20]);
    for (name, bounces, mut scene) in [
        ("cornell_spot", 2, demo("cornell_spot")),
        ("cornell_spot", 8, demo("cornell_spot")),
        ("glossy", 3, demo("glossy")),
        ("area", 3, demo("area")),
        ("textured", 3, demo("textured")),
        ("facets", 4, facets()),
        ("ceiling", 3, ceiling()),
    ] {
        scene.indirect = Some(gather!(target, bounces = bounces));
        let truth = reference_frame(&scene, 256, 8);
        let frames = match name {
            "glossy" => gpu.render_by_each_tracer(&scene),
            _ => vec![gpu.render(&scene)],
        };
        for frame in frames {
            let (error, noise) = error_of_indirect(&frame, &truth);
            let upper = frame.stats.estimated_error_upper.expect("it has one");
            let [mean, true_mean] = [&frame, &truth].map(|frame| sum_off_edges(frame, &truth));
            println!(
                "{name}, {bounces} bounces: {error:.4}, noise of the reference {noise:.4}, below {upper:.4}; mean {:.1e} off",
                mean / true_mean - 1.0
            );
            assert!(noise < 0.05, "{noise}");
            assert!(error < 1.1 * target, "{error}");
            assert!((mean / true_mean - 1.0).abs() < 0.015);
        }
    }
}

/// Of the indirect light.
fn sum_off_edges(frame: &Frame, truth: &Frame) -> f64 {
    let edges = truth.ids(Layer::Edge).expect("a reference has it").iter();
    let pixels = values(frame, Layer::Indirect).as_chunks::<3>().0;
    let inside = pixels.iter().zip(edges).filter(|(_, edge)| **edge == 0);
    inside
        .flat_map(|(bands, _)| bands)
        .map(|&value| f64::from(value))
        .sum()
}

/// The phase is that of the whole path.
#[test]
fn phasors_of_more_bounces_are_those_of_the_reference() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("tof_corner", [20, 16]);
    for bounces in [2, 4] {
        scene.indirect = Some(gather!(0.03, bounces = bounces));
        let truth = reference_frame(&scene, 512, 8);
        let frame = gpu.render(&scene);
        let frequencies = scene.tof.as_ref().map_or(0, |tof| tof.frequencies_hz.len());
        for i in 0..frequencies {
            let layer = Layer::Tof(i as u8, TofQuantity::PhasorIndirect);
            let [found, due] = [&frame, &truth].map(|frame| values(frame, layer));
            let square = |z: f32| f64::from(z).powi(2);
            let off: f64 = found.iter().zip(due).map(|(a, b)| square(a - b)).sum();
            let whole: f64 = due.iter().map(|&z| square(z)).sum();
            println!(
                "{bounces} bounces, frequency {i}: {:.4}",
                (off / whole).sqrt()
            );
            assert!((off / whole).sqrt() < 0.06);
        }
    }
}
