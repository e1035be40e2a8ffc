//! Lights with one face and with six faces share one shadow map. Each was once drawn at its own size into a map of the largest
//! light's size.

use crate::common::gpu::{Gpu, demo_scene};
use camlux::{
    Scene,
    output::Layer,
    scene::{Light, PlacedLight},
};

#[test]
fn lights_of_different_kinds_share_a_shadow_map() {
    let mut gpu = Gpu::open();
    // Many triangles: the map's size then depends on the number of faces.
    let mut scene = demo_scene("knot", [96, 96]);
    scene.indirect = None;
    let spot = scene.lights[0].lamp().expect("the knot is lit by a spot");
    scene.lights = vec![
        Light::point(spot.position_m, spot.power_w).into(),
        Light::directional(spot.direction, [1.0; 3]).into(),
    ];
    let mut direct = |lights: &[PlacedLight]| -> Vec<f32> {
        let scene = Scene {
            lights: lights.to_vec(),
            ..scene.clone()
        };
        let frame = gpu.render(&scene);
        frame
            .values(Layer::Direct)
            .expect("every frame has it")
            .to_vec()
    };
    let both = direct(&scene.lights);
    let alone = [direct(&scene.lights[..1]), direct(&scene.lights[1..])];
    let sum: Vec<f32> = alone[0].iter().zip(&alone[1]).map(|(a, b)| a + b).collect();
    let difference: f32 = both.iter().zip(&sum).map(|(a, b)| (a - b).abs()).sum();
    let difference = difference / sum.iter().sum::<f32>();
    println!("mean difference {difference:.1e}");
    // Alone, a light may have another map size, which moves shadow edges on facets finer than its texels.
    assert!(difference < 5e-3, "{difference:e}");
}
