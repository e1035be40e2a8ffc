//! Colours of vertices multiply k_d wherever a surface is found: by the rasteriser, in reflective shadow maps and by rays.

use crate::common::gpu::{Gpu, demo_scene, distort, radial};
use crate::common::instances::crowd;
use crate::common::reference_frame::{error_off_edges, reference_frame};
use crate::common::rmse::relative_rmse_where;
use crate::geometry::{camera_errors, compare, render, with_rsm};
use crate::instances::assert_same;
use camlux::{
    Scene,
    output::{Frame, Layer},
    scene::{IndirectLight, VplSum},
};

/// The scene with a random colour at each vertex.
pub fn colored(mut scene: Scene) -> Scene {
    let random = &mut fastrand::Rng::with_seed(3);
    for mesh in &mut scene.meshes {
        let count = mesh.positions_m.len();
        let mut color = || [0; 3].map(|_| random.f32());
        mesh.colors = (0..count).map(|_| color()).collect();
    }
    scene
}

#[test]
fn colours_are_interpolated_where_rays_hit() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "textured", "glossy"] {
        let mut scene = colored(with_rsm(demo_scene(name, [64, 64]), 32));
        compare(&mut gpu, name, &scene, 0.05);
        distort(&mut scene, radial(-0.1, 0.02));
        let (frame, kept) = render(&mut gpu, &scene);
        let errors = camera_errors(&scene, &frame, &kept);
        errors.check(&format!("{name} through a lens"), 0.05);
    }
}

/// The colours of instances that share a mesh: the crowd with colours, of which each mesh has its own before it is shared.
fn colored_crowd() -> Scene {
    let mut scene = crowd([64, 64]);
    let plain = scene.clone();
    for index in 0..scene.meshes.len() {
        let first = |other: &usize| plain.meshes[*other].mesh.ptr_eq(&plain.meshes[index].mesh);
        let first = (0..index).find(first);
        if let Some(first) = first {
            scene.meshes[index].mesh = scene.meshes[first].mesh.clone();
            continue;
        }
        let mesh = &mut scene.meshes[index];
        let color = |p: &glam::DVec3| {
            let waves = (9.0 * p.as_vec3()).to_array();
            waves.map(|wave| 0.5 + 0.5 * wave.sin())
        };
        mesh.colors = mesh.positions_m.iter().map(color).collect();
    }
    scene
}

#[test]
fn shared_meshes_keep_their_colours() {
    let mut gpu = Gpu::open();
    let mut scene = colored_crowd();
    scene.indirect = Some(IndirectLight::final_gather(0.05));
    assert_same(&mut gpu, "coloured crowd", &scene);
    scene.camera.resolution_px = [32, 32];
    let frame = gpu.render(&scene);
    let truth = reference_frame(&scene, 1, 0);
    let error = error_off_edges(&frame, &truth, Layer::Direct);
    println!("direct: {error:.1e}");
    assert!(error < 1e-4, "{error}");
}

#[test]
fn the_reference_has_the_same_colours_and_light() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "textured"] {
        let mut scene = colored(demo_scene(name, [28, 28]));
        scene.indirect = Some(IndirectLight::final_gather(0.03));
        let white = {
            let mut scene = scene.clone();
            scene.meshes.iter_mut().for_each(|mesh| mesh.colors.clear());
            gpu.render(&scene)
        };
        let truth = reference_frame(&scene, 512, 8);
        let error = |frame: &Frame, layer| error_off_edges(frame, &truth, layer);
        for frame in gpu.render_by_each_tracer(&scene) {
            let [direct, indirect] =
                [Layer::Direct, Layer::Indirect].map(|layer| error(&frame, layer));
            println!("{name}: direct {direct:.1e}, indirect {indirect:.1e}");
            assert!(direct < 3e-5, "{name}: {direct}");
            assert!(indirect < 0.04, "{name}: {indirect}");
        }
        // The colours matter.
        assert!(error(&white, Layer::Direct) > 0.1 && error(&white, Layer::Indirect) > 0.1);
    }
}

/// A mesh of one colour has the k_d of a material that is multiplied by it, in every estimator.
#[test]
fn one_colour_is_a_material() {
    let mut gpu = Gpu::open();
    for indirect in [
        IndirectLight::vpl_sum(VplSum::RsmAverage, 32),
        IndirectLight::vpl_sum(VplSum::InstantRadiosity, 32),
        IndirectLight::final_gather(0.05),
    ] {
        // Exact in f32, and so is their product with k_d where k_d is.
        let color = [0.5_f32, 0.25, 1.0];
        let mut colored = demo_scene("cornell", [48, 48]);
        colored.indirect = Some(indirect);
        let mut of_material = colored.clone();
        for mesh in &mut colored.meshes {
            mesh.colors = vec![color; mesh.positions_m.len()];
        }
        for material in &mut of_material.materials {
            for (kd, color) in material.kd.iter_mut().zip(color) {
                *kd *= f64::from(color);
            }
        }
        let frames = [&colored, &of_material].map(|scene| gpu.render(scene));
        for layer in [Layer::Direct, Layer::Indirect] {
            let [found, due] = frames
                .each_ref()
                .map(|frame| frame.values(layer).expect("it is there"));
            let error = relative_rmse_where(found, due, |_| true);
            println!("{}, {layer:?}: {error:.1e}", indirect.name());
            // Rounding decides which light paths a final gather samples. Each image meets its target error.
            let target_error = indirect.target_error().filter(|_| layer == Layer::Indirect);
            let bound = target_error.map_or(1e-5, |error| 2_f64.sqrt() * error);
            assert!(error < bound, "{}, {layer:?}: {error}", indirect.name());
        }
    }
}
