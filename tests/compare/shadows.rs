//! V(L,P) of direct light from shadow maps, against rays in f64 and against a path-traced reference.

use crate::common::gpu::{DEMO_SCENES, Gpu, assert_is_lit, demo_scene};
use crate::common::ray_caster::{RayCaster, pixel::PixelRay};
use crate::common::rmse;
use crate::common::shadows::{
    KERNEL_ERROR, contact_lines, scene_lit_from_afar, shadows_of, wall_and_low_light,
};
use crate::common::truth::Truth;
use camlux::{
    Plan, ShadowPlan,
    output::Layer,
    scene::{Bands, IndirectLight, VplSum},
};

#[test]
fn demo_scenes_have_neither_acne_nor_leaks() {
    let mut gpu = Gpu::open();
    for name in DEMO_SCENES {
        let scene = demo_scene(name, [256, 256]);
        for light in &scene.lights {
            let shadows = shadows_of(&mut gpu, &scene, light);
            println!("{name:14} {:12} {shadows:?}", light.kind());
            assert!(shadows.pixels > 5000, "{name}");
            assert_eq!((shadows.acne, shadows.leaks), (0, 0), "{name}");
            assert!(shadows.error_inside <= KERNEL_ERROR, "{name}");
            // Corners of triangles between texels: measured up to 2 of 50 000 pixels. The knot's triangles are smaller than
            // its texels: 1.7e-3.
            let allowed = if name == "knot" { 5e-3 } else { 1.2e-4 };
            assert!(shadows.wrong_share_at_edges() <= allowed, "{name}");
        }
    }
}

/// f32 loses digits of a distance of 300 m, but not of the distance from P to its occluder.
#[test]
fn light_from_afar_makes_no_acne() {
    let (scene, light) = scene_lit_from_afar();
    let shadows = shadows_of(&mut Gpu::open(), &scene, &light);
    println!("from afar: {shadows:?}");
    assert!(shadows.pixels > 5000);
    assert_eq!((shadows.acne, shadows.leaks), (0, 0));
    // The pixels at six corners, out of 39 000.
    assert!(shadows.wrong_share_at_edges() <= 4.5e-4);
}

/// The reference shares no code with the engine. Its image has 200 x 200 pixels; the plan chooses the shadow map for them.
#[test]
fn direct_light_agrees_with_path_traced_truth() {
    let truth = Truth::read().direct;
    let mut scene = demo_scene("cornell", [200, 200]);
    scene.indirect = None;
    let frame = Gpu::open().render(&scene);
    let direct = frame.values(Layer::Direct).expect("every frame has it");
    // The lower edge of the green wall passes through the centres of pixels on the image's diagonal, where either surface is
    // right. All other pixels count, shadow edges too.
    let caster = RayCaster::new(&scene);
    let on_edge = |i: &usize| {
        let (x, y) = ((i % 200) as u32, (i / 200) as u32);
        !PixelRay::of_camera(&scene, x, y).cast(&caster).1
    };
    let inside: Vec<usize> = (0..truth.len()).filter(|i| !on_edge(i)).collect();
    let pick = |values: &[f32]| -> Vec<f32> {
        let pixels = inside.iter().flat_map(|&i| &values[3 * i..3 * i + 3]);
        pixels.copied().collect()
    };
    let truth_inside: Vec<Bands> = inside.iter().map(|&i| truth[i]).collect();
    let error = rmse::relative_rmse(&pick(direct), &truth_inside);
    let with_edges = rmse::relative_rmse(direct, &truth);
    println!(
        "{error:.1e} of {} pixels, {with_edges:.1e} of all",
        inside.len()
    );
    assert!(inside.len() > 39_000);
    // The reference's rounding to 16 bits; measured 1.9e-4.
    assert!(error <= 3e-4, "{error:e}");
}

/// A fine RSM serves the shadow test as well as the light's own shadow map.
#[test]
fn shadows_from_the_rsm_are_the_same() {
    let mut gpu = Gpu::open();
    for name in ["cornell", "textured"] {
        let mut scene = demo_scene(name, [64, 64]);
        scene.indirect = None;
        let own = gpu.render(&scene);
        assert_is_lit(&own, Layer::Direct);
        scene.indirect = Some(IndirectLight::vpl_sum(VplSum::RsmAverage, 256));
        let shared = gpu.render(&scene);
        let plan = Plan::new(&scene, gpu.device.info()).expect("the scene is valid");
        assert!(
            plan.lights
                .iter()
                .all(|light| light.shadow == ShadowPlan::Rsm { size: 256 })
        );
        assert_eq!(
            own.values(Layer::Direct),
            shared.values(Layer::Direct),
            "{name}"
        );
    }
}

/// Where surfaces touch, shadows begin at the contact line, both in front of the object and behind it.
#[test]
fn contact_lines_do_not_leak() {
    let mut gpu = Gpu::open();
    for (what, scene) in contact_lines() {
        let shadows = shadows_of(&mut gpu, &scene, &scene.lights[0]);
        println!("{what}: {shadows:?}");
        assert!(shadows.pixels > 1000, "{what}");
        assert_eq!((shadows.acne, shadows.leaks), (0, 0), "{what}");
        assert!(shadows.error_inside <= 3.0 * KERNEL_ERROR, "{what}");
        // Corners between texels: measured up to 2.1e-4, where grazing light makes the texels long.
        assert!(shadows.wrong_share_at_edges() <= 6e-4, "{what}");
    }
}

/// A light 3 mm above a floor sees the floor in the texels next to those of a wall's foot. The line through light and foot meets the
/// floor behind the light, where it hides nothing.
#[test]
fn the_floor_behind_the_light_hides_nothing() {
    let scene = wall_and_low_light();
    let shadows = shadows_of(&mut Gpu::open(), &scene, &scene.lights[0]);
    println!("foot of a wall: {shadows:?}");
    assert!(shadows.pixels > 5000);
    assert_eq!((shadows.dark_at_edges, shadows.lit_at_edges), (0, 0));
    assert_eq!((shadows.acne, shadows.leaks), (0, 0));
}
