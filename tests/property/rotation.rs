//! The faces of the cube map do not show. The cube stays aligned with the world's axes, so turning the scene with its camera
//! and lights turns the cube relative to the scene. The image must stay the same.

#![cfg(feature = "reference")]

use crate::common::gpu::{Gpu, demo_scene};
use camlux::{
    DeviceKind, Scene,
    hard_cases::scenes::turned,
    output::{Frame, Layer},
    scene::{IndirectLight, VplSum},
};
use glam::{DMat3, DQuat, DVec3, EulerRot};

/// The 24 rotations that map the axes to axes; exact in f64.
fn cube_rotations() -> Vec<DMat3> {
    let axes = [
        DVec3::X,
        DVec3::Y,
        DVec3::Z,
        DVec3::NEG_X,
        DVec3::NEG_Y,
        DVec3::NEG_Z,
    ];
    let mut turns = Vec::new();
    for x in axes {
        for y in axes.into_iter().filter(|y| y.dot(x) == 0.0) {
            turns.push(DMat3::from_cols(x, y, x.cross(y)));
        }
    }
    turns
}

fn scene(name: &str, estimator: VplSum, rsm_size: u32) -> Scene {
    let mut scene = demo_scene(name, [32, 32]);
    scene.indirect = Some(IndirectLight::vpl_sum(estimator, rsm_size));
    scene
}

fn values(frame: &Frame, layer: Layer) -> &[f32] {
    frame.values(layer).expect("the layer is there")
}

/// max |a − b| / (b + 0.01 · mean b) over all pixels and bands.
fn apart(a: &[f32], b: &[f32]) -> f64 {
    let mean = b.iter().map(|&b| f64::from(b)).sum::<f64>() / b.len() as f64;
    assert!(mean > 0.0, "a black image proves nothing");
    let relative = |(&a, &b): (&f32, &f32)| {
        let [a, b] = [a, b].map(f64::from);
        (a - b).abs() / (b + 0.01 * mean)
    };
    a.iter().zip(b).map(relative).fold(0.0, f64::max)
}

/// Σ|a − b| / Σb
fn mean_difference(a: &[f32], b: &[f32]) -> f64 {
    let difference = |(&a, &b): (&f32, &f32)| (f64::from(a) - f64::from(b)).abs();
    let sum: f64 = b.iter().map(|&b| f64::from(b)).sum();
    a.iter().zip(b).map(difference).sum::<f64>() / sum
}

/// Faces map to faces and texels to texels, so only rounding differs. Rounding of positions counts where a VPL is near a pixel and 1/d²
/// magnifies it. Sums round differently because the VPLs are in another order. Measured 6.5e-6 at one such pixel of Cornell, 3.9e-7 as
/// relRMSE; the requirement is 1e-5. An H100 interpolates positions differently and has 3.8e-5 at one pixel of the glossy scene.
#[test]
fn quarter_turns_change_nothing() {
    let mut gpu = Gpu::open();
    let bound = match gpu.device.info().kind {
        DeviceKind::Cpu => 1e-5,
        _ => 5e-5,
    };
    let turns = cube_rotations();
    assert_eq!(turns.len(), 24);
    for estimator in VplSum::ALL {
        for name in ["cornell", "glossy"] {
            let upright = scene(name, estimator, 16);
            let frame = gpu.render(&upright);
            let mut worst = 0.0f64;
            for &turn in &turns {
                let other = gpu.render(&turned(&upright, turn));
                for layer in [Layer::Direct, Layer::Indirect] {
                    worst = worst.max(apart(values(&other, layer), values(&frame, layer)));
                }
            }
            println!("{name}, {}: {worst:.1e}", estimator.name());
            assert!(worst <= bound, "{name} {estimator:?}: {worst:e}");
        }
    }
}

/// Other turns place the texels elsewhere; the effect must vanish as the RSM is refined. Both scenes are turned askew: in the
/// upright scene, whole rows of texels end on the walls' edges.
#[test]
fn other_turns_converge() {
    use VplSum::{InstantRadiosity, RsmAverage};
    const RSM_SIZES: [u32; 3] = [16, 64, 256];
    // Twice the measured mean differences, which the comments give. `instant-radiosity` has 1/d² spikes where a texel is
    // near a pixel; they converge last.
    let cases = [
        ("cornell", RsmAverage, [2e-2, 4e-3, 1.3e-3]), // 9.8e-3, 2.2e-3, 6.5e-4
        ("cornell", InstantRadiosity, [1.4e-1, 4e-2, 3e-3]), // 7.2e-2, 1.9e-2, 1.5e-3
        ("cornell_spot", RsmAverage, [2e-2, 5e-3, 2e-3]), // 1.1e-2, 2.4e-3, 9.3e-4
        ("cornell_spot", InstantRadiosity, [8e-2, 5e-2, 3e-2]), // 3.8e-2, 2.5e-2, 1.4e-2
        ("glossy", RsmAverage, [1.6e-2, 1e-3, 1.5e-4]), // 8.0e-3, 4.7e-4, 7.5e-5
        ("glossy", InstantRadiosity, [2.2e-1, 5e-2, 4e-3]), // 1.1e-1, 2.3e-2, 2.0e-3
    ];
    let mut gpu = Gpu::open();
    let turn = |x, y, z| DMat3::from_quat(DQuat::from_euler(EulerRot::XYZ, x, y, z));
    let turns = [turn(0.5, 0.8, -0.3), turn(-0.9, 0.3, 0.7)];
    for (name, estimator, bounds) in cases {
        for (rsm_size, bound) in RSM_SIZES.into_iter().zip(bounds) {
            let upright = scene(name, estimator, rsm_size);
            let frames = turns.map(|turn| gpu.render(&turned(&upright, turn)));
            let [a, b] = frames.each_ref().map(|f| values(f, Layer::Indirect));
            let apart = mean_difference(a, b);
            println!("{name}, {}, {rsm_size}: {apart:.1e}", estimator.name());
            assert!(apart <= bound, "{name} {estimator:?} {rsm_size}: {apart:e}");
        }
    }
}
