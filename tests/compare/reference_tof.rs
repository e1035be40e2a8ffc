//! Time of flight of the path-sampled reference, against closed forms and quadrature.

use std::f64::consts::{PI, TAU};

use crate::common::quadrature::unit_interval;
use crate::common::reference_frame::add_rounds;
use crate::common::rooms::{quad, scene_of};
use crate::reference::{lamp, lit_sphere};
use camlux::{
    Scene,
    hard_cases::scenes::with_tof,
    model::{Phasor, SPEED_OF_LIGHT_M_S, multipath_error_m, range_m},
    output::{Frame, Layer, LayeredImage, OutputFile, TofQuantity, write_exr},
    reference::Reference,
    scene::{Lens, Light},
};
use glam::DVec3;

fn refined(mut reference: Reference, rounds: u32) -> Frame {
    add_rounds(&mut reference, rounds);
    reference.frame()
}

/// The single pixel of a camera that looks at a point.
fn pixel_of(mut scene: Scene, look_at_m: DVec3) -> Frame {
    scene.camera.resolution_px = [1, 1];
    scene.camera.look_at_m = look_at_m;
    scene.camera.lens = Lens::FovY { fov_y_deg: 1.0 };
    refined(Reference::new(&scene, 1024).expect("a valid scene"), 64)
}

fn values(frame: &Frame, frequency: usize, quantity: TofQuantity) -> &[f32] {
    let layer = Layer::Tof(frequency as u8, quantity);
    frame.values(layer).expect("the layer is there")
}

fn phasor(frame: &Frame, frequency: usize, quantity: TofQuantity) -> Phasor {
    let value = values(frame, frequency, quantity);
    Phasor {
        re: value[0].into(),
        im: value[1].into(),
    }
}

fn value(frame: &Frame, frequency: usize, quantity: TofQuantity) -> f64 {
    values(frame, frequency, quantity)[0].into()
}

/// Three standard errors of the phasor, converted to a range.
fn noise_m(frame: &Frame, frequency: usize, frequency_hz: f64) -> f64 {
    let error = phasor(frame, frequency, TofQuantity::PhasorStandardError).magnitude();
    let total = phasor(frame, frequency, TofQuantity::Phasor).magnitude();
    3.0 * SPEED_OF_LIGHT_M_S / (4.0 * PI * frequency_hz) * error / total
}

/// A sphere of radius R = 1 m, k_d = ρ = 0.5, with the light at its centre. For every point and camera, indirect over direct is ρ·G(x),
/// G(x) = 2[e^{ix}(1 − ix) − 1]/x², x = 4πfR/c.
#[test]
fn a_sphere_has_its_closed_form() {
    // Frequency, Hz; range bias, mm; |Z| over the light at f = 0.
    let known = [
        (10e6, 220.921, 0.98974),
        (20e6, 216.922, 0.95950),
        (50e6, 184.510, 0.77099),
        (100e6, 23.287, 0.47414),
    ];
    let frequencies_hz = known.map(|(frequency_hz, ..)| frequency_hz);
    let camera_m = DVec3::new(0.3, -0.2, 0.1);
    let scene = with_tof(lit_sphere(Vec::new(), camera_m), &frequencies_hz);
    for look_at_m in [DVec3::X, DVec3::new(-0.4, 0.9, 0.3), DVec3::NEG_Y] {
        let frame = pixel_of(scene.clone(), look_at_m);
        for (i, (frequency_hz, bias_mm, share)) in known.into_iter().enumerate() {
            let bias = 1e3 * value(&frame, i, TofQuantity::MultipathError);
            let noise = 1e3 * noise_m(&frame, i, frequency_hz);
            println!("{frequency_hz:e} Hz: bias {bias:.3} mm for {bias_mm}, noise {noise:.3}");
            assert!(
                (bias - bias_mm).abs() < 0.1 + noise,
                "{frequency_hz}: {bias} mm"
            );
            let radiance = f64::from(frame.values(Layer::Radiance).expect("it is there")[0]);
            let found = phasor(&frame, i, TofQuantity::Phasor).magnitude() / radiance;
            assert!(
                (found - share).abs() < 1e-3,
                "{frequency_hz}: {found} for {share}"
            );
        }
    }
}

/// P is straight below the light, between two plates. E_P = 2ρI₀bH²∫ r(b² + r²)^{−3/2}(r² + H²)^{−2}·e^{ik(√(b² + r²) + √(r² + H²))} dr.
#[test]
fn parallel_plates_have_their_integral() {
    let (height_m, gap_m, albedo, extent_m) = (0.7_f64, 2.0_f64, 0.6, 60.0);
    let frequencies_hz = [20e6, 100e6];
    let plate = |name: &str, y: f64, material| {
        let corner = DVec3::new(-extent_m, y, -extent_m);
        quad(
            name,
            corner,
            2.0 * extent_m * DVec3::X,
            2.0 * extent_m * DVec3::Z,
            material,
        )
    };
    let meshes = vec![plate("floor", 0.0, 0), plate("ceiling", gap_m, 1)];
    let light = lamp(DVec3::new(0.0, height_m, 0.0));
    let camera_m = DVec3::new(0.4, 0.5, 0.3);
    let mut scene = scene_of(meshes, light, camera_m, DVec3::ZERO);
    scene.materials[0].kd = [0.8; 3];
    scene.materials[1].kd = [albedo; 3];
    let frame = pixel_of(with_tof(scene, &frequencies_hz), DVec3::ZERO);
    let below_m = gap_m - height_m;
    for (i, frequency_hz) in frequencies_hz.into_iter().enumerate() {
        let k = TAU * frequency_hz / SPEED_OF_LIGHT_M_S;
        let integrand = |t: f64| {
            let r = t / (1.0 - t).max(1e-12);
            let (to_q, to_p) = (below_m.hypot(r), gap_m.hypot(r));
            let scale = 2.0 * albedo * below_m * gap_m * gap_m * r / (to_q.powi(3) * to_p.powi(4));
            (scale * (1.0 + r).powi(2), k * (to_q + to_p))
        };
        let whole = unit_interval(1e-9, |t| integrand(t).0);
        // The quadrature needs integrands of one sign.
        let part = |f: &dyn Fn(f64) -> f64| {
            unit_interval(1e-9, |t| {
                let (scale, phase) = integrand(t);
                scale * (1.0 + f(phase))
            }) - whole
        };
        let bounce = Phasor {
            re: part(&f64::cos),
            im: part(&f64::sin),
        };
        let direct = Phasor::of_path(1.0 / (height_m * height_m), height_m, frequency_hz);
        let expected_m = multipath_error_m(direct + bounce, direct, frequency_hz).expect("light");
        let found_m = value(&frame, i, TofQuantity::MultipathError);
        let noise = noise_m(&frame, i, frequency_hz);
        println!("{frequency_hz:e} Hz: {found_m:.5} m for {expected_m:.5}, noise {noise:.5}");
        assert!(
            (found_m - expected_m).abs() < 1e-4 + noise,
            "{found_m} for {expected_m}"
        );
        let radiance = phasor(&frame, i, TofQuantity::PhasorIndirect).magnitude();
        // L = 0.8/π·E_P
        let expected = 0.8 / PI * bounce.magnitude();
        assert!(
            (radiance - expected).abs() < 3e-3 * expected,
            "{radiance} for {expected}"
        );
    }
}

/// A corner with a modulated light at the camera, and a second lamp that is not modulated.
fn corner(frequencies_hz: &[f64]) -> Scene {
    let meshes = vec![
        quad("floor", DVec3::NEG_Z, DVec3::X, 2.0 * DVec3::Z, 0),
        quad("wall", DVec3::NEG_Z, DVec3::Y, 2.0 * DVec3::Z, 1),
    ];
    let camera_m = DVec3::new(1.5, 1.2, 0.3);
    let mut scene = scene_of(meshes, lamp(camera_m), camera_m, DVec3::new(0.2, 0.2, 0.0));
    scene
        .lights
        .push(Light::directional(DVec3::new(-1.0, -2.0, 0.3), [0.2; 3]).into());
    scene.camera.resolution_px = [12, 12];
    let mut scene = with_tof(scene, frequencies_hz);
    scene.tof.as_mut().expect("it was given").ambient_lights = vec![1];
    scene
}

#[test]
fn what_phases_tell_is_what_phasors_are() {
    let frequencies_hz = [1e3, 20e6, 200e6, 1e9];
    let scene = corner(&frequencies_hz);
    let frame = refined(Reference::new(&scene, 64).expect("a valid scene"), 2);
    let mut modulated = scene.clone();
    modulated.lights.truncate(1);
    modulated
        .tof
        .as_mut()
        .expect("it was given")
        .ambient_lights
        .clear();
    let modulated = refined(Reference::new(&modulated, 64).expect("a valid scene"), 2);
    let half_paths = frame.values(Layer::HalfPath).expect("it is there");
    let ranges = frame.values(Layer::Range).expect("it is there");
    let radiance = frame.values(Layer::Radiance).expect("it is there");
    let of_modulated = modulated.values(Layer::Direct).expect("it is there");
    let joule = scene.sensor.expect("it was given").joule_per_irradiance();
    let electrons_per_joule = 0.8 * 850e-9 / (6.626_070_15e-34 * 299_792_458.0);
    let mut seen = 0;
    for i in 0..half_paths.len() {
        if half_paths[i].is_infinite() {
            continue;
        }
        seen += 1;
        // The light is at the camera.
        assert!((half_paths[i] - ranges[i]).abs() < 1e-6);
        for (f, &frequency_hz) in frequencies_hz.iter().enumerate() {
            let at = |quantity, channels: usize, channel: usize| {
                f64::from(values(&frame, f, quantity)[channels * i + channel])
            };
            let complex = |quantity| Phasor {
                re: at(quantity, 2, 0),
                im: at(quantity, 2, 1),
            };
            let (direct, total) = (
                complex(TofQuantity::PhasorDirect),
                complex(TofQuantity::Phasor),
            );
            // Ambient light does not contribute to phasors.
            let bound = f64::from(of_modulated[3 * i]);
            assert!((direct.magnitude() - bound).abs() <= 1e-6 * bound);
            assert!(total.magnitude() <= (1.0 + 1e-6) * f64::from(radiance[3 * i]));
            let unambiguous = SPEED_OF_LIGHT_M_S / (2.0 * frequency_hz);
            let away = range_m(direct, frequency_hz).expect("light") - f64::from(half_paths[i]);
            let away = away.rem_euclid(unambiguous);
            // f32 resolves 1e-7 of a turn, which limits the range at 1 kHz.
            let tolerance_m = 1e-6 * unambiguous.min(100.0) + 1e-6 * unambiguous;
            assert!(
                away.min(unambiguous - away) < tolerance_m,
                "{away} at {frequency_hz}"
            );
            let wraps = frame
                .ids(Layer::Tof(f as u8, TofQuantity::Wraps))
                .expect("there")[i];
            assert_eq!(wraps, (f64::from(half_paths[i]) / unambiguous) as u32);
            // Unmodulated light frees electrons, too.
            let taps = |phase: u8, tap| at(TofQuantity::Taps(phase), 2, tap);
            let electrons = f64::from(radiance[3 * i]) * joule * electrons_per_joule;
            let mut sum = 0.0;
            for phase in 0..4 {
                let both = taps(phase, 0) + taps(phase, 1);
                assert!(
                    (both - electrons).abs() < 1e-5 * electrons,
                    "{both} for {electrons}"
                );
                sum += both;
            }
            let intensity = at(TofQuantity::Intensity, 1, 0);
            assert!((intensity - sum).abs() < 1e-5 * sum);
            let [d0, d1, d2, d3] = [0, 1, 2, 3].map(|phase| taps(phase, 0) - taps(phase, 1));
            let demodulated = Phasor {
                re: 0.5 * (d0 - d2),
                im: 0.5 * (d3 - d1),
            };
            let amplitude = at(TofQuantity::Amplitude, 1, 0);
            assert!((demodulated.magnitude() - amplitude).abs() < 1e-5 * amplitude + 1e-6 * sum);
            if frequency_hz == 1e3 {
                let all = f64::from(modulated.values(Layer::Radiance).expect("there")[3 * i]);
                // The two frames have different samples of the bounce.
                assert!((total.re - all).abs() < 0.1 * all && total.im.abs() < 5e-4 * all);
            }
        }
    }
    assert!(seen > 100, "{seen}");
}

/// A reference that resumes from its file gives the result of an uninterrupted one.
#[test]
fn a_file_with_phasors_is_gone_on_with() {
    let scene = corner(&[20e6, 100e6]);
    let reference = || Reference::new(&scene, 64).expect("a valid scene");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("truth.exr");
    let output = OutputFile::create(&file).expect("it can be written");
    write_exr(output, &refined(reference(), 3), &Default::default()).expect("it can be written");
    let image = LayeredImage::read(&file).expect("an image");
    let frequency = image.attribute("camlux.tof1.frequency_hz");
    assert_eq!(frequency, Some("100000000"));
    assert!(image.attribute("camlux.tof.convention").is_some());
    let resumed = refined(Reference::resume(&scene, &file).expect("its own file"), 2);
    let whole = refined(reference(), 5);
    for quantity in [
        TofQuantity::PhasorIndirect,
        TofQuantity::PhasorStandardError,
    ] {
        for frequency in 0..2 {
            let (found, due) = (
                values(&resumed, frequency, quantity),
                values(&whole, frequency, quantity),
            );
            let largest = due.iter().fold(0.0_f32, |a, b| a.max(b.abs()));
            for (found, due) in found.iter().zip(due) {
                assert!((found - due).abs() < 1e-4 * largest, "{found} for {due}");
            }
        }
    }
}
