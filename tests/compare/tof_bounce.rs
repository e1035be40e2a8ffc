//! Time of flight of the bounce: against closed forms, the model in f64 and the reference.

use std::f64::consts::TAU;

use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene, gather_kernels};
use crate::common::reference_frame::reference_frame;
use crate::reference::lit_sphere;
use crate::tof::{modulated_demo_scene, phasors};
use camlux::{
    RenderOptions, Scene,
    hard_cases::scenes::with_tof,
    internals::f64_kernels,
    model::{Phasor, SPEED_OF_LIGHT_M_S},
    output::{Frame, Layer, StopReason, TofQuantity},
    scene::{IndirectLight, Lens, Light, SpotCone, VplSum},
};
use glam::DVec3;

fn estimators(target_error: f64, rsm_size: u32) -> [(&'static str, IndirectLight); 3] {
    let sum = |sum: VplSum| (sum.name(), IndirectLight::vpl_sum(sum, rsm_size));
    let [average, radiosity] = [VplSum::RsmAverage, VplSum::InstantRadiosity].map(sum);
    let gathered = IndirectLight::final_gather(target_error);
    [("final-gather", gathered), average, radiosity]
}

/// A sphere of radius R = 1 m, k_d = ρ = 0.5, with the light at its centre. For every point and camera, indirect over direct is ρ·G(x),
/// G(x) = 2[e^{ix}(1 − ix) − 1]/x², x = 4πfR/c.
#[test]
fn a_sphere_has_its_closed_form() {
    let frequencies_hz = [10e6, 20e6, 50e6, 100e6];
    let camera_m = DVec3::new(0.3, -0.2, 0.1);
    let mut scene = with_tof(lit_sphere(Vec::new(), camera_m), &frequencies_hz);
    scene.camera.resolution_px = [24, 18];
    scene.camera.lens = Lens::FovY { fov_y_deg: 60.0 };
    let mut gpu = Gpu::open();
    // The sum tests no visibility, and a sphere needs none. Its VPLs are points that stand for a lit surface.
    let estimators = [
        ("final-gather", IndirectLight::final_gather(0.01), 4),
        (
            "instant-radiosity",
            IndirectLight::vpl_sum(VplSum::InstantRadiosity, 128),
            1,
        ),
    ];
    for (name, indirect, seeds) in estimators {
        scene.indirect = Some(indirect);
        let mut biases_mm = [(); 4].map(|()| Vec::new());
        for seed in 0..seeds {
            let frame = gpu.render_seeded(&scene, seed);
            for (i, frequency_hz) in frequencies_hz.into_iter().enumerate() {
                let sum = |quantity| phasors(&frame, i, quantity).into_iter();
                // The path to the camera differs per pixel; the ratio of bounce to direct light does not.
                let turned = sum(TofQuantity::PhasorIndirect)
                    .zip(sum(TofQuantity::PhasorDirect))
                    .map(|(indirect, direct)| indirect * direct.conjugate());
                let direct: f64 = sum(TofQuantity::PhasorDirect)
                    .map(|z| z.magnitude().powi(2))
                    .sum();
                let ratio = turned.sum::<Phasor>() * (1.0 / direct);
                let bounced = Phasor {
                    re: 1.0 + ratio.re,
                    ..ratio
                };
                let angle = bounced.argument_rad().expect("there is light");
                biases_mm[i].push(1e3 * SPEED_OF_LIGHT_M_S / (2.0 * TAU * frequency_hz) * angle);
            }
        }
        for (i, frequency_hz) in frequencies_hz.into_iter().enumerate() {
            let due_mm = [220.921, 216.922, 184.510, 23.287][i];
            let count = biases_mm[i].len() as f64;
            let mean = biases_mm[i].iter().sum::<f64>() / count;
            let squares: f64 = biases_mm[i].iter().map(|bias| (bias - mean).powi(2)).sum();
            let noise = 3.0 * (squares / (count * (count - 1.0).max(1.0))).sqrt();
            println!("{name} {frequency_hz:e} Hz: {mean:.3} mm for {due_mm}, noise {noise:.3}");
            assert!(
                (mean - due_mm).abs() < 0.1 + noise,
                "{name} {frequency_hz}: {mean} mm for {due_mm}"
            );
        }
    }
}

/// At 1 Hz all phases are equal: Z is the light that the pixels see. |Z| never exceeds that light.
#[test]
fn a_slow_modulation_makes_light() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "glossy", "textured"] {
        let mut scene = modulated_demo_scene(name, [48, 48], &[1e3, 100e6]);
        let tof = scene.tof.as_mut().expect("it was given");
        tof.band_weights = [0.5, 0.0, 1.0];
        let is_all_modulated = tof.ambient_lights.is_empty();
        for (estimator, indirect) in estimators(0.1, 32) {
            scene.indirect = Some(indirect);
            let frame = gpu.render(&scene);
            let light = frame.values(Layer::Indirect).expect("it is there");
            let light = light
                .chunks_exact(3)
                .map(|bands| 0.5 * f64::from(bands[0]) + f64::from(bands[2]));
            let light: Vec<f64> = light.collect();
            let brightest = light.iter().copied().fold(0.0, f64::max);
            assert!(brightest > 0.0);
            for frequency in 0..2 {
                let found = phasors(&frame, frequency, TofQuantity::PhasorIndirect);
                for (phasor, light) in found.iter().zip(&light) {
                    let over = phasor.magnitude() - light;
                    let most = 2e-6 * light + 1e-7 * brightest;
                    assert!(over <= most, "{name} {estimator}: {phasor:?} of {light}");
                    if frequency == 0 && is_all_modulated {
                        // The wavelength is 300 km, so paths of 20 m are in phase within 4.2e-4 rad.
                        let off = (phasor.re - light).hypot(phasor.im);
                        assert!(off <= 5e-4 * brightest, "{name} {estimator}: {off:e}");
                    }
                }
            }
        }
    }
}

/// relRMSE of the device's sums against the same sums in f64, which is rounding: 1e-6 turns for phases. The largest over the frequencies.
pub fn kernel_error(gpu: &mut Gpu, scene: &Scene, sum: VplSum, options: &mut RenderOptions) -> f64 {
    let rendered = gpu.renderer.render_with_intermediates(scene, options);
    let (frame, kept) = rendered.expect("the scene renders");
    let every_pixel: Vec<usize> = (0..kept.gbuffer.len()).collect();
    let frequencies_hz = &scene.tof.as_ref().expect("it was given").frequencies_hz;
    let errors = frequencies_hz.iter().enumerate().map(|(i, &frequency_hz)| {
        let due = f64_kernels::indirect_phasors_at(scene, sum, &kept, &every_pixel, frequency_hz);
        let found = phasors(&frame, i, TofQuantity::PhasorIndirect);
        let off = found.iter().zip(&due).map(|(z, due)| *z + *due * -1.0);
        let error: f64 = off.map(|z| z.magnitude().powi(2)).sum();
        let all: f64 = due.iter().map(|z| z.magnitude().powi(2)).sum();
        assert!(all > 0.0);
        (error / all).sqrt()
    });
    errors.fold(0.0, f64::max)
}

#[test]
fn sums_match_the_model() {
    let mut gpu = Gpu::open();
    let kernels = gather_kernels(&gpu.device);
    for name in DEMO_SCENES {
        for sum in VplSum::ALL {
            // A single frequency has its own kernels.
            for frequencies_hz in [&[100e6][..], &[20e6, 100e6, 1e9]] {
                let mut scene = modulated_demo_scene(name, [16, 16], frequencies_hz);
                let tof = scene.tof.as_mut().expect("it was given");
                tof.band_weights = [0.5, 0.25, 1.0];
                tof.ambient_lights = vec![0];
                scene.indirect = Some(IndirectLight::vpl_sum(sum, 24));
                for &kernel in &kernels {
                    let mut options = RenderOptions {
                        gather_kernel: Some(kernel),
                        ..RenderOptions::default()
                    };
                    let error = kernel_error(&mut gpu, &scene, sum, &mut options);
                    let count = frequencies_hz.len();
                    let (sum, kernel) = (sum.name(), kernel.name());
                    println!("{name:14} {sum:18} {count} {kernel:10} {error:.1e}");
                    assert!(error <= 1e-5, "{name} {sum} {count} {kernel}: {error:e}");
                }
            }
        }
    }
}

/// A texel of an 8² RSM spans several wavelengths at 1 GHz. A fine RSM sums to the mean of its phases, not to the phase of one point.
#[test]
fn a_coarse_rsm_does_not_lie_about_short_waves() {
    let mut gpu = Gpu::open();
    let frequency_hz = 1e9;
    let mut scene = with_tof(demo_scene("cornell", [32, 32]), &[frequency_hz]);
    let mut sum = |rsm_size| {
        scene.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, rsm_size));
        phasors(&gpu.render(&scene), 0, TofQuantity::PhasorIndirect)
    };
    let (coarse, fine) = (sum(8), sum(256));
    let rms = |phasors: &[Phasor]| {
        let squares: f64 = phasors.iter().map(|z| z.magnitude().powi(2)).sum();
        (squares / phasors.len() as f64).sqrt()
    };
    let off: Vec<Phasor> = coarse
        .iter()
        .zip(&fine)
        .map(|(a, b)| *a + *b * -1.0)
        .collect();
    // For the printed number of VPLs.
    scene.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 8));
    let rendered = gpu
        .renderer
        .render_with_intermediates(&scene, &mut RenderOptions::default());
    let (_, kept) = rendered.expect("the scene renders");
    println!(
        "|Z| {:.2e} for {:.2e}, off by {:.2e}; {} VPLs",
        rms(&coarse),
        rms(&fine),
        rms(&off),
        f64_kernels::vpls(&scene.lights[0], &kept.lights[0]).len()
    );
    assert!(rms(&coarse) < 2.0 * rms(&fine));
    assert!(rms(&off) < rms(&fine));
}

/// Noise of unmodulated light is not noise of Z. A modulated lamp that reaches nothing requests no samples, and the target error of the light
/// is still met.
#[test]
fn ambient_light_is_no_noise_of_z() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("cornell", [48, 48]);
    scene.indirect = Some(IndirectLight::final_gather(0.05));
    let without = gpu.render(&scene);
    // Points away from the box.
    scene.lights.push(
        Light::spot(
            scene.camera.position_m,
            DVec3::Z,
            SpotCone {
                inner_half_angle_deg: 10.0,
                outer_half_angle_deg: 20.0,
            },
            [1.0; 3],
        )
        .into(),
    );
    let mut scene = with_tof(scene, &[20e6]);
    scene.tof.as_mut().expect("it was given").ambient_lights = vec![0];
    let frame = gpu.render(&scene);
    let stats = &frame.stats;
    assert_eq!(stats.stop, Some(StopReason::TargetMet));
    let rays = [&without, &frame].map(|frame| frame.stats.ray_count);
    println!("{:?} of {rays:?} rays", stats.estimated_error);
    // The second light's rays add to the count.
    assert!(rays[1] < 3 * rays[0], "{rays:?}");
    let phasors = phasors(&frame, 0, TofQuantity::PhasorIndirect);
    assert!(phasors.iter().all(|z| z.magnitude() == 0.0));
}

/// relRMSE of the bounce's Z away from edges, less the reference's own noise.
fn phasor_error(frame: &Frame, truth: &Frame, frequency: usize) -> f64 {
    let edges = truth.ids(Layer::Edge).expect("a reference has them");
    let found = phasors(frame, frequency, TofQuantity::PhasorIndirect);
    let due = phasors(truth, frequency, TofQuantity::PhasorIndirect);
    let noise = phasors(truth, frequency, TofQuantity::PhasorStandardError);
    let (mut squares, mut all) = (0.0, 0.0);
    for i in (0..found.len()).filter(|&i| edges[i] == 0) {
        let off = found[i] + due[i] * -1.0;
        let variance = noise[i].magnitude().powi(2);
        squares += off.magnitude().powi(2) - variance;
        all += due[i].magnitude().powi(2) - variance;
    }
    (squares.max(0.0) / all).sqrt()
}

#[test]
fn the_requested_error_is_met_at_each_frequency() {
    let mut gpu = Gpu::open();
    let frequencies_hz = [20e6, 100e6];
    for name in DEMO_SCENES {
        let mut scene = modulated_demo_scene(name, [32, 32], &frequencies_hz);
        scene.tof.as_mut().expect("it was given").band_weights = [1.0, 0.0, 0.5];
        let asked = 0.05;
        scene.indirect = Some(IndirectLight::final_gather(asked));
        let frame = gpu.render(&scene);
        let truth = reference_frame(&scene, 64, 8);
        let estimated = frame.stats.estimated_error.expect("it is estimated");
        let errors = [0, 1].map(|frequency| phasor_error(&frame, &truth, frequency));
        println!("{name}: estimated {estimated:.4}, true {errors:.4?}");
        let worst = errors.into_iter().fold(0.0, f64::max);
        assert!(worst <= 1.3 * asked, "{name}: {errors:?}");
        assert!(worst >= asked / 4.0, "{name}: {errors:?}");
    }
}
