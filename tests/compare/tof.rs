//! Time of flight of frames: direct light, against the reference and against known ranges.

use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene, distort, radial};
use crate::common::rooms::{quad, scene_of};
use crate::reference::lamp;
use camlux::{
    RenderOptions, Scene,
    hard_cases::scenes::{moved, with_tof},
    model::{Phasor, SPEED_OF_LIGHT_M_S, range_m},
    output::{Frame, Layer, LayerData, TofQuantity},
    reference::Reference,
    scene::{ChargeUnit, Distortion, Lens, SensorNoise, Shadow, Vignetting, VignettingMap},
};
use glam::DVec3;

const FREQUENCIES_HZ: [f64; 4] = [20e6, 100e6, 200e6, 1e6];

/// A scene whose lights are modulated, except directional ones.
pub fn modulated(scene: Scene, frequencies_hz: &[f64]) -> Scene {
    let lights = scene.lights.iter().enumerate();
    let ambient = lights.filter(|(_, light)| light.position_m().is_none());
    let ambient = ambient.map(|(i, _)| i).collect();
    let mut scene = with_tof(scene, frequencies_hz);
    scene.tof.as_mut().expect("it was given").ambient_lights = ambient;
    scene
}

/// A demo scene with a lamp beside the camera, so that two phases add up.
pub fn modulated_demo_scene(name: &str, resolution_px: [u32; 2], frequencies_hz: &[f64]) -> Scene {
    let mut scene = demo_scene(name, resolution_px);
    let beside = scene.camera.position_m + DVec3::new(0.3, 0.1, 0.0);
    scene.lights.push(lamp(beside).into());
    modulated(scene, frequencies_hz)
}

/// Phasors of one frequency.
pub fn phasors(frame: &Frame, frequency: usize, quantity: TofQuantity) -> Vec<Phasor> {
    let layer = Layer::Tof(frequency as u8, quantity);
    let values = frame.values(layer).expect("the layer is there");
    let phasor = |pixel: &[f32]| Phasor {
        re: pixel[0].into(),
        im: pixel[1].into(),
    };
    values.chunks_exact(2).map(phasor).collect()
}

/// relRMSE of the direct phasors over pixels away from edges that have the same mesh and light in both frames, with more than 1 % of the largest
/// phasor. Pixels whose shadows differ are left out; other tests check those.
fn deviation(frame: &Frame, truth: &Frame, frequency: usize) -> f64 {
    let ids = |frame: &Frame| frame.ids(Layer::InstanceId).expect("it is there").to_vec();
    let (seen, due) = (ids(frame), ids(truth));
    let values = |frame: &Frame| frame.values(Layer::Radiance).expect("it is there").to_vec();
    let (radiance, due_radiance) = (values(frame), values(truth));
    let edges = truth.ids(Layer::Edge).expect("a reference has them");
    let [found, due_phasors] =
        [frame, truth].map(|frame| phasors(frame, frequency, TofQuantity::PhasorDirect));
    let brightest = due_phasors
        .iter()
        .map(|z| z.magnitude())
        .fold(0.0, f64::max);
    let (mut squares, mut all, mut count) = (0.0, 0.0, 0);
    for i in 0..seen.len() {
        let least = 0.01 * brightest;
        let both = found[i].magnitude() > least && due_phasors[i].magnitude() > least;
        let [light, due_light] = [&radiance, &due_radiance].map(|values| values[3 * i]);
        let is_one_light = (light - due_light).abs() < 1e-3 * due_light;
        if seen[i] == due[i] && edges[i] == 0 && both && is_one_light {
            let deviation = found[i] + due_phasors[i] * -1.0;
            squares += deviation.magnitude().powi(2);
            all += due_phasors[i].magnitude().powi(2);
            count += 1;
        }
    }
    assert!(count > 200, "{count} pixels");
    (squares / all).sqrt()
}

#[test]
fn direct_phasors_match_the_reference() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        for shadow in Shadow::ALL {
            let mut scene = modulated_demo_scene(name, [48, 48], &FREQUENCIES_HZ);
            scene.indirect = None;
            scene.tof.as_mut().expect("it was given").band_weights = [0.5, 0.25, 1.0];
            scene.direct.shadow = Some(shadow);
            let frame = gpu.render(&scene);
            let truth = Reference::new(&scene, 1).expect("a valid scene").frame();
            for (i, frequency_hz) in FREQUENCIES_HZ.into_iter().enumerate() {
                let error = deviation(&frame, &truth, i);
                println!("{name} {} {frequency_hz:e} Hz: {error:.1e}", shadow.name());
                // The radiance of textured surfaces is accurate to 1e-5.
                let bound = if name == "textured" { 2e-5 } else { 3e-6 };
                assert!(error < bound, "{name} at {frequency_hz} Hz: {error:e}");
            }
        }
    }
}

/// A floor in front of a wall, with this size and position.
fn corner(size_m: f64, shift_m: DVec3) -> Scene {
    let meshes = vec![
        quad("floor", DVec3::NEG_Z, DVec3::X, 2.0 * DVec3::Z, 0),
        quad("wall", DVec3::NEG_Z, DVec3::Y, 2.0 * DVec3::Z, 1),
    ];
    let camera_m = DVec3::new(0.9, 0.8, 0.3);
    let mut scene = scene_of(meshes, lamp(camera_m), camera_m, DVec3::new(0.2, 0.2, 0.0));
    scene.camera.resolution_px = [64, 48];
    moved(&scene, size_m, shift_m)
}

/// The largest difference between range and half path over the lit pixels, modulo c/2f.
fn worst_range_m(frame: &Frame, frequency: usize, frequency_hz: f64) -> f64 {
    let half_paths = frame.values(Layer::HalfPath).expect("it is there");
    let phasors = phasors(frame, frequency, TofQuantity::PhasorDirect);
    let unambiguous_m = SPEED_OF_LIGHT_M_S / (2.0 * frequency_hz);
    let lit = phasors.iter().zip(half_paths);
    let deviations = lit.filter_map(|(phasor, &half_path)| {
        let away = range_m(*phasor, frequency_hz)? - f64::from(half_path);
        let away = away.rem_euclid(unambiguous_m);
        Some(away.min(unambiguous_m - away))
    });
    let worst = deviations.clone().fold(0.0, f64::max);
    assert!(deviations.count() > 500);
    worst
}

#[test]
fn direct_light_alone_has_the_true_range() {
    let mut gpu = Gpu::open();
    let frequencies_hz = [20e6, 100e6, 200e6, 1e6];
    let far = DVec3::new(1e5, -3e4, 2e4);
    for (size_m, shift_m, bound_m) in [
        (1e-3, DVec3::ZERO, 1e-5),
        (10.0, DVec3::ZERO, 1e-5),
        (10.0, far, 1e-5),
        // The device's positions have 24 bits.
        (1e4, DVec3::ZERO, 2e-3),
    ] {
        let scene = modulated(corner(size_m, shift_m), &frequencies_hz);
        let frame = gpu.render(&scene);
        for (i, frequency_hz) in frequencies_hz.into_iter().enumerate() {
            let worst = worst_range_m(&frame, i, frequency_hz);
            println!("{size_m} m at {frequency_hz:e} Hz: {worst:.1e} m");
            assert!(
                worst < bound_m,
                "{size_m} m at {frequency_hz} Hz: {worst} m"
            );
        }
    }
}

/// The light is at the camera, and nothing but its direct light is measured.
#[test]
fn points_of_direct_light_are_on_the_surface() {
    let mut gpu = Gpu::open();
    let point = Layer::Tof(0, TofQuantity::Point);
    let range = Layer::Tof(0, TofQuantity::Range);
    let without_lens = modulated(corner(1.0, DVec3::ZERO), &[20e6]);
    let mut through_lens = without_lens.clone();
    distort(&mut through_lens, radial(-0.2, 0.03));
    let mut far = modulated(corner(1.0, DVec3::new(1e5, -3e4, 2e4)), &[20e6]);
    far.camera.resolution_px = [32, 24];
    for scene in [without_lens, through_lens, far] {
        let wanted = [Layer::CameraPosition, Layer::Range, range, point];
        let frame = gpu.render_with(&scene, |options| options.layers = Some(&wanted));
        let values = |layer| frame.values(layer).expect("it is named");
        let (points, _) = values(point).as_chunks::<3>();
        let (due, _) = values(Layer::CameraPosition).as_chunks::<3>();
        let (mut lit, mut worst) = (0, 0.0_f64);
        for (i, measured_m) in values(range).iter().enumerate() {
            let [measured, due] = [points[i], due[i]].map(|p| DVec3::from(p.map(f64::from)));
            assert_eq!(measured_m.is_nan(), measured.is_nan());
            if measured_m.is_nan() {
                continue;
            }
            lit += 1;
            worst = worst.max(measured.distance(due) / due.length());
        }
        println!("{lit} points: {worst:.1e}");
        assert!(lit > 500 && worst < 1e-6, "{lit} {worst}");
    }
}

#[test]
fn a_background_has_no_range() {
    let mut gpu = Gpu::open();
    let mut scene = modulated(corner(1.0, DVec3::ZERO), &[20e6]);
    scene.camera.look_at_m = 2.0 * scene.camera.position_m;
    let quantities = [TofQuantity::Range, TofQuantity::Point, TofQuantity::Phasor];
    let mut wanted: Vec<Layer> = quantities.map(|q| Layer::Tof(0, q)).into();
    wanted.extend([Layer::HalfPath, Layer::Tof(0, TofQuantity::Taps(0))]);
    let frame = gpu.render_with(&scene, |options| options.layers = Some(&wanted));
    let values = |quantity| frame.values(Layer::Tof(0, quantity)).expect("it is there");
    assert!(values(TofQuantity::Point).iter().all(|part| part.is_nan()));
    assert!(
        values(TofQuantity::Range)
            .iter()
            .all(|range| range.is_nan())
    );
    assert!(values(TofQuantity::Phasor).iter().all(|&part| part == 0.0));
    assert!(
        values(TofQuantity::Taps(0))
            .iter()
            .all(|&charge| charge == 0.0)
    );
    let half_paths = frame.values(Layer::HalfPath).expect("it is there");
    assert!(half_paths.iter().all(|half_path| half_path.is_infinite()));
}

#[test]
fn full_taps_are_said() {
    let mut gpu = Gpu::open();
    let mut scene = modulated(corner(1.0, DVec3::ZERO), &[20e6]);
    let noise = |full_well_e| SensorNoise {
        seed: 1,
        dark_e_per_s: 0.0,
        read_noise_e: 1.0,
        full_well_e,
        gain_dn_per_e: 0.5,
        black_level_dn: 3.0,
        bits: 24,
        ..SensorNoise::DEFAULT
    };
    for output in ChargeUnit::ALL {
        for (full_well_e, is_full) in [(1e15, false), (10.0, true)] {
            let tof = scene.tof.as_mut().expect("it was given");
            (tof.output, tof.noise) = (output, Some(noise(full_well_e)));
            let mut scene = scene.clone();
            if output == ChargeUnit::DigitalNumbers && !is_full {
                // So that 24 bits are enough for the charge.
                scene.lights = vec![scene.lights[0].with_emission([1e-3; 3]).into()];
            }
            let warnings = gpu.render(&scene).warnings();
            let has = warnings
                .iter()
                .any(|w| w.contains("have a full or nearly full tap"));
            assert_eq!(has, is_full, "{output:?} {full_well_e}: {warnings:?}");
        }
    }
}

#[test]
fn noise_is_the_same_for_the_same_frame_and_other_for_another() {
    let mut gpu = Gpu::open();
    let mut scene = modulated(corner(1.0, DVec3::ZERO), &[20e6, 100e6]);
    let clean = gpu.render(&scene);
    let tof = scene.tof.as_mut().expect("it was given");
    tof.output = ChargeUnit::DigitalNumbers;
    tof.noise = Some(SensorNoise {
        seed: 3,
        dark_e_per_s: 1e3,
        read_noise_e: 5.0,
        full_well_e: 1e5,
        gain_dn_per_e: 0.5,
        black_level_dn: 32.0,
        bits: 16,
        ..SensorNoise::DEFAULT
    });
    let mut render = |scene: &Scene, (frame_index, seed, camera_index)| {
        let mut options = RenderOptions {
            frame_index,
            seed,
            camera_index,
            ..RenderOptions::default()
        };
        let frame = gpu.renderer.render(scene, &mut options);
        let frame = frame.expect("the scene renders");
        let taps =
            |(layer, _): &&(Layer, LayerData)| matches!(layer, Layer::Tof(_, TofQuantity::Taps(_)));
        let taps = frame.layers.iter().filter(taps).cloned();
        (taps.collect::<Vec<_>>(), frame.description.key)
    };
    let (first, _) = render(&scene, (Some(0), 0, 0));
    assert_eq!(first.len(), 8);
    let others = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 1, 1)];
    let others = others.map(|(index, seed, camera)| render(&scene, (Some(index), seed, camera)).0);
    for (i, other) in others.iter().enumerate() {
        assert!(first != *other && !others[..i].contains(other), "{i}");
    }
    assert!(first == render(&scene, (Some(0), 0, 0)).0);
    assert!(others[3] == render(&scene, (Some(0), 1, 1)).0);
    // Frames count up, and go on after the largest index that was given.
    for (given, due) in [(None, 2), (None, 3), (Some(9), 9), (Some(1), 1), (None, 10)] {
        let (counted, key) = render(&scene, (given, 0, 0));
        assert_eq!(key.index, due);
        assert!(counted == render(&scene, (Some(due), 0, 0)).0, "{due}");
    }
    // The numbers scatter around their expected values.
    for (layer, data) in &first {
        let expected = clean.values(*layer).expect("it is there");
        let LayerData::Float(values) = data else {
            panic!("{layer:?} holds ids")
        };
        for (value, expected) in values.iter().zip(expected) {
            let mean = 32.0 + 0.5 * (f64::from(*expected) + 1.0);
            let deviation = (0.25 * (f64::from(*expected) + 26.0) + 1.0 / 12.0).sqrt();
            let off = (f64::from(*value) - mean) / deviation;
            assert!(
                value.fract() == 0.0 && off.abs() < 7.0,
                "{layer:?}: {value} for {mean}"
            );
        }
    }
}

/// An f-number scales amplitude and intensity alike, in frames and in the reference. Phasors and range stay the same.
#[test]
fn an_aperture_takes_light_and_no_phase() {
    let mut scene = modulated_demo_scene("cornell", [48, 32], &[100e6]);
    scene.indirect = None;
    let mut gpu = Gpu::open();
    let render = |gpu: &mut Gpu, scene: &Scene| {
        let reference = Reference::new(scene, 1).expect("a valid scene").frame();
        [gpu.render(scene), reference]
    };
    let plain = render(&mut gpu, &scene);
    scene.sensor.as_mut().expect("it was given").f_number = Some(1.4);
    let behind = render(&mut gpu, &scene);
    let values = |frame: &Frame, quantity| {
        let layer = Layer::Tof(0, quantity);
        frame.values(layer).expect("the layer is there").to_vec()
    };
    for (plain, behind) in plain.iter().zip(&behind) {
        assert!(values(plain, TofQuantity::Phasor) == values(behind, TofQuantity::Phasor));
        let [depth, range] = [Layer::Depth, Layer::Range].map(|layer| behind.values(layer));
        let (depth, range) = (depth.expect("it is there"), range.expect("it is there"));
        let of = |frame: &Frame| {
            [
                TofQuantity::Amplitude,
                TofQuantity::Intensity,
                TofQuantity::Range,
            ]
            .map(|quantity| values(frame, quantity))
        };
        let (before, after) = (of(plain), of(behind));
        let mut lit = 0;
        for i in (0..depth.len()).filter(|&i| before[0][i] > 0.0) {
            lit += 1;
            let cosine = f64::from(depth[i]) / f64::from(range[i]);
            let due = std::f64::consts::FRAC_PI_4 / 1.4f64.powi(2) * cosine.powi(4);
            for (before, after) in before.iter().zip(&after).take(2) {
                let share = f64::from(after[i]) / f64::from(before[i]);
                assert!((share / due - 1.0).abs() < 3e-6, "{share} {due}");
            }
            assert!((before[2][i] - after[2][i]).abs() < 1e-6);
        }
        assert!(lit > 500, "{lit}");
    }
}

/// Each tap without noise is linear in the light, so it changes by the polynomial: in frames and in the reference, also through a fisheye.
#[test]
fn a_measured_vignetting_scales_every_tap() {
    const COEFFICIENTS: [f64; 3] = [-0.6, 0.5, -0.35];
    let factor = |pixel: usize| {
        let [x, y] = [pixel % 48, pixel / 48].map(|place| place as f64 + 0.5);
        let r = (x - 24.0).hypot(y - 16.0) / 24f64.hypot(16.0);
        let [k1, k2, k3] = COEFFICIENTS;
        1.0 + k1 * r.powi(2) + k2 * r.powi(4) + k3 * r.powi(6)
    };
    let mut gpu = Gpu::open();
    for is_fisheye in [false, true] {
        let mut scene = modulated_demo_scene("cornell", [48, 32], &[100e6]);
        scene.indirect = None;
        if is_fisheye {
            let intrinsics = scene.camera.intrinsics_px();
            scene.camera.lens = Lens::Distorted {
                intrinsics,
                distortion: Distortion::Fisheye([0.05, 0.0, 0.0, 0.0]),
            };
        }
        let mut render = |scene: &Scene| {
            let reference = Reference::new(scene, 1).expect("a valid scene").frame();
            [gpu.render(scene), reference]
        };
        let plain = render(&scene);
        let sensor = scene.sensor.as_mut().expect("it was given");
        sensor.f_number = Some(1.4);
        sensor.vignetting = Some(Vignetting(COEFFICIENTS));
        let behind = render(&scene);
        // A map of the same values, of the size of the image.
        scene.sensor.as_mut().expect("it was given").vignetting = None;
        let factors = (0..48 * 32).map(|i| factor(i) as f32);
        let map = VignettingMap {
            size_px: [48, 32],
            values: factors.collect(),
        };
        scene.vignetting_map = Some(map.into());
        for (mapped, behind) in render(&scene).iter().zip(&behind) {
            let layer = Layer::Tof(0, TofQuantity::Taps(1));
            let of = |frame: &Frame| frame.values(layer).expect("it is there").to_vec();
            for (mapped, behind) in of(mapped).iter().zip(of(behind)) {
                assert!(
                    (mapped - behind).abs() <= 3e-7 * behind.abs(),
                    "{mapped} {behind}"
                );
            }
        }
        for (plain, behind) in plain.iter().zip(&behind) {
            for phase in 0..4 {
                let layer = Layer::Tof(0, TofQuantity::Taps(phase));
                let of = |frame: &Frame| frame.values(layer).expect("it is there").to_vec();
                let (before, after) = (of(plain), of(behind));
                let (mut lit, mut least) = (0, 1.0f64);
                for (i, (before, after)) in before.iter().zip(&after).enumerate() {
                    let factor = factor(i / 2);
                    let due = f64::from(*before) * factor * std::f64::consts::FRAC_PI_4 / 1.96;
                    // Both taps are rounded to f32.
                    let error = (f64::from(*after) - due).abs();
                    assert!(error <= 1.3e-7 * due.abs(), "{after} {due} at {}", i / 2);
                    if *before > 0.0 {
                        (lit, least) = (lit + 1, least.min(factor));
                    }
                }
                assert!(lit > 1000 && least < 0.81, "{lit} {least}");
            }
        }
    }
}
