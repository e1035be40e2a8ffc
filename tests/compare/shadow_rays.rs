//! V(L,P) of direct light by shadow rays, against rays in f64.

use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene};
use crate::common::rooms;
use crate::common::shadows::{
    KERNEL_ERROR, contact_lines, floor_with, scene_lit_from_afar, shadows_of, wall_and_low_light,
};
use camlux::{
    Plan, Scene,
    output::Layer,
    scene::{Direct, Light, Shadow},
};
use glam::DVec3;

fn by_rays(mut scene: Scene) -> Scene {
    scene.direct = Direct {
        shadow: Some(Shadow::Rays),
    };
    scene
}

/// No pixel is wrong, neither at shadow edges nor elsewhere.
fn assert_is_exact(gpu: &mut Gpu, what: &str, scene: Scene, light: &Light, error: f64) {
    let shadows = shadows_of(gpu, &by_rays(scene), light);
    println!("{what}: {shadows:?}");
    assert!(shadows.pixels > 1000, "{what}");
    assert_eq!((shadows.acne, shadows.leaks), (0, 0), "{what}");
    assert_eq!(
        (shadows.dark_at_edges, shadows.lit_at_edges),
        (0, 0),
        "{what}"
    );
    assert!(shadows.error <= error, "{what}: {:e}", shadows.error);
}

#[test]
fn demo_scenes_have_exact_shadows() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        let scene = demo_scene(name, [256, 256]);
        for light in &scene.lights {
            let what = format!("{name}, {}", light.kind());
            assert_is_exact(&mut gpu, &what, scene.clone(), light, KERNEL_ERROR);
        }
    }
}

#[test]
fn scenes_of_any_size_and_place_have_exact_shadows() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "knot"] {
        let scene = demo_scene(name, [160, 160]);
        for (scale, shift_m) in [
            (1e-3, DVec3::ZERO),
            (1e4, DVec3::ZERO),
            (1.0, DVec3::new(1e7, -1e7, 1e7)),
        ] {
            let scene = rooms::moved(&scene, scale, shift_m);
            let what = format!("{name}, {scale} times, at {shift_m}");
            let light = scene.lights[0].clone();
            assert_is_exact(&mut gpu, &what, scene, &light, KERNEL_ERROR);
        }
    }
}

#[test]
fn light_from_afar_has_exact_shadows() {
    let (scene, light) = scene_lit_from_afar();
    assert_is_exact(&mut Gpu::open(), "300 m", scene, &light, KERNEL_ERROR);
}

#[test]
fn contact_lines_have_exact_shadows() {
    let mut gpu = Gpu::open();
    for (what, scene) in contact_lines() {
        let light = scene.lights[0].clone();
        assert_is_exact(&mut gpu, what, scene, &light, 3.0 * KERNEL_ERROR);
    }
}

#[test]
fn lights_just_above_a_floor_have_exact_shadows() {
    let mut gpu = Gpu::open();
    let scene = wall_and_low_light();
    let light = scene.lights[0].clone();
    assert_is_exact(&mut gpu, "3 mm", scene, &light, 3.0 * KERNEL_ERROR);
    for height_m in [0.01, 0.001] {
        let wall = rooms::quad(
            "wall",
            DVec3::new(-1.0, 0.0, 0.0),
            2.0 * DVec3::X,
            DVec3::Y,
            1,
        );
        let scene = floor_with(vec![wall], DVec3::new(0.1, height_m, 0.2));
        let light = scene.lights[0].clone();
        let what = format!("{height_m} m");
        // The height itself is rounded by 1.5e-8 local units. At 1 mm, 5e-4 local units, that is 3e-5.
        let error = 3.0 * KERNEL_ERROR * 0.01 / height_m;
        assert_is_exact(&mut gpu, &what, scene, &light, error);
    }
}

/// All ray kernels give the same image, bit for bit.
#[test]
fn tracers_agree() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        // A size that does not fill the workgroups.
        let mut scene = by_rays(demo_scene(name, [157, 101]));
        scene.indirect = None;
        let frames = gpu.render_by_each_tracer(&scene);
        let images: Vec<_> = frames
            .iter()
            .map(|frame| frame.values(Layer::Direct).expect("it is there"))
            .collect();
        assert!(images[0].iter().any(|&value| value > 0.0));
        assert!(images.iter().all(|image| *image == images[0]), "{name}");
    }
}

/// With rays the plan has no shadow map; with a map it has no shadow rays.
#[test]
fn rays_take_the_place_of_the_shadow_map() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("cornell", [64, 64]);
    for shadow in Shadow::ALL {
        scene.direct.shadow = Some(shadow);
        let plan = Plan::new(&scene, gpu.device.info()).expect("the scene is valid");
        let text = plan.to_string();
        let frame = gpu.render(&scene);
        let has_map = frame.stats.passes.iter().any(|pass| pass.name == "shadow");
        assert_eq!(has_map, shadow == Shadow::Map);
        assert_eq!(text.contains("  shadow     light 0"), shadow == Shadow::Map);
        assert_eq!(text.contains(", shadow rays"), shadow == Shadow::Rays);
    }
}
