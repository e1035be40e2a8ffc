//! Layers that a frame has only where they are named.

use crate::common::gpu::{Gpu, demo_scene, distort, plain_sum, radial};
use camlux::{
    Scene,
    output::{Frame, Layer},
    scene::MetallicRoughness,
};
use glam::DVec3;

const NAMED: [Layer; 6] = [
    Layer::Direct,
    Layer::Normal,
    Layer::CameraNormal,
    Layer::Albedo,
    Layer::InstanceId,
    Layer::MaterialId,
];

fn render(gpu: &mut Gpu, scene: &Scene) -> Frame {
    gpu.render_with(scene, |options| options.layers = Some(&NAMED))
}

fn vectors(frame: &Frame, layer: Layer) -> Vec<DVec3> {
    let values = frame.values(layer).expect("it is named");
    let (vectors, _) = values.as_chunks::<3>();
    let vectors = vectors.iter();
    vectors.map(|v| DVec3::from(v.map(f64::from))).collect()
}

#[test]
fn a_normal_in_the_cameras_axes_is_that_of_the_world() {
    let mut gpu = Gpu::open();
    let mut scene = plain_sum(demo_scene("glossy", [32, 24]), 16);
    scene.camera.position_m *= 1.5;
    let mut through_lens = scene.clone();
    distort(&mut through_lens, radial(-0.1, 0.01));
    for scene in [scene, through_lens] {
        let frame = render(&mut gpu, &scene);
        let to_world = scene.camera.to_world();
        let ids = frame.ids(Layer::InstanceId).expect("it is named");
        let in_world = vectors(&frame, Layer::Normal);
        for (i, normal) in vectors(&frame, Layer::CameraNormal).into_iter().enumerate() {
            let apart = to_world.transform_vector3(normal).distance(in_world[i]);
            assert!(apart < 2e-7, "{apart}");
            match ids[i] {
                0 => assert_eq!(normal, DVec3::ZERO),
                // The camera sees the front, and no pixel is so wide that its ray is not nearly along the axis.
                _ => assert!((normal.length() - 1.0).abs() < 1e-6 && normal.z < 0.5),
            }
        }
        assert!(ids.contains(&0) && ids.iter().any(|&id| id > 0));
    }
}

/// A diffuse surface reflects in proportion to its albedo: light of the scene, divided by light of the same scene in white.
#[test]
fn albedo_is_the_factor_of_diffuse_light() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("textured", [32, 32]);
    scene.indirect = None;
    for material in &mut scene.materials {
        (material.ks, material.ks_texture) = ([0.0; 3], None);
    }
    let mut white = scene.clone();
    for material in &mut white.materials {
        (material.kd, material.kd_texture) = ([1.0; 3], None);
    }
    let [frame, white] = [&scene, &white].map(|scene| render(&mut gpu, scene));
    let [direct, white] = [&frame, &white].map(|frame| vectors(frame, Layer::Direct));
    let albedo = vectors(&frame, Layer::Albedo);
    let (mut lit, mut least, mut most) = (0, 1.0_f64, 0.0_f64);
    for i in 0..albedo.len() {
        let due = albedo[i] * white[i];
        assert!((direct[i] - due).abs().max_element() <= 1e-6 * white[i].max_element());
        lit += usize::from(white[i].min_element() > 0.0);
        (least, most) = (least.min(albedo[i].x), most.max(albedo[i].x));
    }
    assert!(
        lit > 500 && least < 0.3 && most > 0.5,
        "{lit} {least} {most}"
    );
}

#[test]
fn albedo_of_a_metal_is_0_and_of_plastic_what_its_surface_lets_in() {
    let mut gpu = Gpu::open();
    let mut scene = demo_scene("cornell", [16, 16]);
    scene.indirect = None;
    for (i, material) in scene.materials.iter_mut().enumerate() {
        material.kd = [0.5, 0.25, 0.75];
        material.microfacets = Some(MetallicRoughness {
            metallic: if i == 0 { 1.0 } else { 0.0 },
            ior: 1.5,
            ..MetallicRoughness::DEFAULT
        });
    }
    let frame = render(&mut gpu, &scene);
    let ids = frame.ids(Layer::MaterialId).expect("it is named");
    assert!(ids.contains(&1) && ids.contains(&2));
    for (albedo, &id) in vectors(&frame, Layer::Albedo).into_iter().zip(ids) {
        let due = match id {
            0 | 1 => DVec3::ZERO,
            // An index of 1.5 reflects 4 %.
            _ => 0.96 * DVec3::new(0.5, 0.25, 0.75),
        };
        assert!(albedo.distance(due) < 1e-6, "{id}: {albedo}");
    }
}
