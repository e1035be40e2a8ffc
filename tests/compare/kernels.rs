//! Kernel error: the GPU's f32 against the same formulas in f64 on the same G-buffer and VPLs, for every demo scene,
//! estimator and kernel that the device can run. `truth` tests the model error, against a path-traced reference.

use crate::common::direct::unshadowed_direct;
use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene};
use crate::common::lamps::{measured, projector};
use crate::common::rmse::relative_rmse;
use camlux::{
    DeviceKind, GatherKernel, RenderOptions,
    internals::f64_kernels,
    output::Layer,
    scene::{IndirectLight, Light, SpotCone, VplSum},
};
use glam::DVec3;

const SIZE: [u32; 2] = [64, 64];

/// relRMSE where everything is matte or mildly glossy: the rounding of ~30 f32 operations per pair, averaged over thousands of
/// pairs. Measured 1e-7 to 4.3e-7, the largest for a spot's falloff. Required: 2e-6, with lobes 5e-5.
const BOUND: f64 = 9e-7;

#[test]
fn direct_light_matches_the_model() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        let scene = demo_scene(name, SIZE);
        for light in &scene.lights {
            // One light at a time, so that a black pixel means that this light does not reach it. `shadows` tests whether that
            // is right.
            let mut alone = scene.clone();
            alone.lights = vec![light.clone()];
            alone.indirect = None;
            let (frame, kept) = gpu
                .renderer
                .render_with_intermediates(&alone, &mut RenderOptions::default())
                .expect("the scene renders");
            let direct = frame.values(Layer::Direct).expect("every frame has it");
            let mut truth = unshadowed_direct(&alone, light, &kept);
            for (pixel, truth) in direct.chunks_exact(3).zip(&mut truth) {
                if pixel == [0.0; 3] {
                    *truth = [0.0; 3];
                }
            }
            let error = relative_rmse(direct, &truth);
            println!("{name:14} {:12} direct {error:.1e}", light.kind());
            assert!(error <= BOUND, "{name}: {error:e}");
        }
    }
}

/// Every kind of light on lobes alone, and every way of drawing a surface: flat and smooth, plain and textured, matte and
/// glossy. Lobes of shininess 200 alone are within 1.0e-5 (3.2e-5 on an H100), since few pixels carry the image. Required: 5e-5.
#[test]
fn direct_light_on_every_kind_of_surface_matches_the_model() {
    const LOBE_BOUND: f64 = 5e-5;
    let mut gpu = Gpu::open();
    let position_m = DVec3::new(0.3, 1.6, 0.6);
    let direction = DVec3::new(-0.4, -1.0, -0.7);
    let cone = SpotCone {
        inner_half_angle_deg: 20.0,
        outer_half_angle_deg: 50.0,
    };
    let power_w = [10.0, 20.0, 5.0];
    let lights = [
        Light::point(position_m, power_w),
        Light::spot(position_m, direction, cone, power_w),
        Light::directional(direction, [1.0, 2.0, 3.0]),
        measured(position_m, direction, power_w),
        projector(position_m, direction, power_w),
    ];
    for light in lights {
        for (is_smooth, is_specular) in [(false, false), (true, false), (false, true), (true, true)]
        {
            let mut scene = demo_scene("textured", SIZE);
            scene.lights = vec![light.clone().into()];
            scene.indirect = None;
            for mesh in scene.meshes.iter_mut().filter(|_| is_smooth) {
                // Normals as if the room were a sphere, never opposite to a face.
                let outwards = |&p: &DVec3| (p - DVec3::new(0.1, 0.9, 0.2)).normalize();
                mesh.normals = mesh.positions_m.iter().map(outwards).collect();
            }
            for material in scene.materials.iter_mut().filter(|_| is_specular) {
                material.kd = [0.0; 3];
                material.ks = [0.9, 0.5, 0.1];
                material.shininess = 200.0;
            }
            let (frame, kept) = gpu
                .renderer
                .render_with_intermediates(&scene, &mut RenderOptions::default())
                .expect("the scene renders");
            let direct = frame.values(Layer::Direct).expect("every frame has it");
            let mut truth = unshadowed_direct(&scene, &light, &kept);
            for (pixel, truth) in direct.chunks_exact(3).zip(&mut truth) {
                if pixel == [0.0; 3] {
                    *truth = [0.0; 3];
                }
            }
            let error = relative_rmse(direct, &truth);
            let kind = light.kind();
            println!("{kind:12} smooth {is_smooth:5} specular {is_specular:5} {error:.1e}");
            let bound = if is_specular { LOBE_BOUND } else { BOUND };
            assert!(
                error <= bound,
                "{kind} {is_smooth} {is_specular}: {error:e}"
            );
        }
    }
}

/// So the runs of `scripts/test` with eight lanes and with four test the kernels that they are meant for.
#[test]
fn a_driver_of_the_cpu_takes_the_kernel_of_its_width() {
    let gpu = Gpu::open();
    let expected = match std::env::var("LP_NATIVE_VECTOR_WIDTH").as_deref() {
        Ok("128") => GatherKernel::Broadcast4,
        _ if gpu.device.info().name.contains("SwiftShader") => GatherKernel::Broadcast4,
        _ if gpu.device.info().kind == DeviceKind::Cpu => GatherKernel::Broadcast8,
        _ => GatherKernel::Tile,
    };
    assert_eq!(GatherKernel::best_for(gpu.device.info()), expected);
}

#[test]
fn indirect_light_matches_the_model() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        for estimator in VplSum::ALL {
            let scene = demo_scene(name, SIZE);
            let error = worst_indirect_error(&mut gpu, scene, estimator);
            println!("{name:14} {:18} {error:.1e}", estimator.name());
            assert!(error <= BOUND, "{name} {estimator:?}: {error:e}");
        }
    }
}

/// Lobes alone, without the diffuse term that would hide their error. s multiplies the rounding of the directions.
#[test]
fn sharp_lobes_match_the_model() {
    let mut gpu = Gpu::open();
    // Three times the measured 1.9e-7, 3.4e-7, 3.4e-7 and 3.1e-6. Required: 5e-5 up to shininess 200.
    for (shininess, bound) in [(0.0, 6e-7), (20.0, 1e-6), (200.0, 1e-6), (1e4, 1e-5)] {
        for estimator in VplSum::ALL {
            let mut scene = demo_scene("glossy", SIZE);
            for material in &mut scene.materials {
                material.kd = [0.0; 3];
                material.ks = [0.9, 0.5, 0.1];
                material.shininess = shininess;
            }
            let error = worst_indirect_error(&mut gpu, scene, estimator);
            println!(
                "shininess {shininess:6} {:18} {error:.1e}",
                estimator.name()
            );
            assert!(
                error <= bound,
                "shininess {shininess} {estimator:?}: {error:e}"
            );
        }
    }
}

/// The largest relRMSE of the indirect layer over the kernels that the device can run.
fn worst_indirect_error(gpu: &mut Gpu, mut scene: camlux::Scene, estimator: VplSum) -> f64 {
    scene.indirect = Some(IndirectLight::vpl_sum(estimator, 24));
    let kernels = GatherKernel::ALL.into_iter();
    let mut truth = None;
    kernels
        .filter(|kernel| kernel.runs_on(gpu.device.info()))
        .map(|kernel| {
            let mut options = RenderOptions {
                gather_kernel: Some(kernel),
                ..RenderOptions::default()
            };
            let (frame, kept) = gpu
                .renderer
                .render_with_intermediates(&scene, &mut options)
                .expect("the scene renders");
            let truth =
                truth.get_or_insert_with(|| f64_kernels::indirect(&scene, estimator, &kept));
            relative_rmse(
                frame.values(Layer::Indirect).expect("it was asked for"),
                truth,
            )
        })
        .max_by(f64::total_cmp)
        .expect("one kernel runs everywhere")
}
