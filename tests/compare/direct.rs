//! The engine's direct light against that of the path-sampled reference, which has its own code for surfaces, materials, textures,
//! lights and shadows.

use crate::common::gpu::{DEMO_SCENES, Gpu, demo_scene, sub_pixel_bits};
use crate::common::ray_caster::{RayCaster, pixel::PixelRay};
use camlux::{
    Scene,
    output::Layer,
    reference::Reference,
    scene::{Direct, Shadow},
};

#[test]
fn direct_light_agrees_with_the_reference() {
    let mut gpu = Gpu::open();
    for (name, shadow) in DEMO_SCENES
        .into_iter()
        .flat_map(|name| Shadow::ALL.map(|shadow| (name, shadow)))
    {
        let scene = Scene {
            direct: Direct {
                shadow: Some(shadow),
            },
            indirect: None,
            vignetting_map: None,
            left_out: Vec::new(),
            ..demo_scene(name, [160, 160])
        };
        let frame = gpu.render(&scene);
        let truth = Reference::new(&scene, 1)
            .expect("the scene is valid")
            .frame();
        let caster = RayCaster::new(&scene);
        let values = |layer: Layer| {
            let of = |frame: &'_ camlux::output::Frame| {
                frame.values(layer).expect("it is there").to_vec()
            };
            (of(&frame), of(&truth))
        };
        let (image, reference) = values(Layer::Direct);
        let (depth, true_depth) = values(Layer::Depth);
        let (normal, true_normal) = values(Layer::Normal);
        let mut inside = 0;
        let (mut off, mut square, mut wrong) = (0.0, 0.0, 0);
        for (index, pixel) in reference.chunks_exact(3).enumerate() {
            let (x, y) = (index as u32 % 160, index as u32 / 160);
            if !PixelRay::of_camera(&scene, x, y).cast(&caster).1 {
                continue;
            }
            inside += 1;
            let bands = 3 * index..3 * index + 3;
            let apart: f64 = image[bands.clone()]
                .iter()
                .zip(pixel)
                .map(|(x, t)| f64::from(x - t).powi(2))
                .sum();
            let own: f64 = pixel.iter().map(|&t| f64::from(t).powi(2)).sum();
            if apart > 0.01 * own {
                // A shadow edge is elsewhere.
                wrong += 1;
                continue;
            }
            off += apart;
            square += own;
            assert!(
                depth[index] == true_depth[index]
                    || (depth[index] / true_depth[index] - 1.0).abs() < 1e-5
            );
            let cosine: f32 = bands.map(|i| normal[i] * true_normal[i]).sum();
            assert!(depth[index].is_infinite() || cosine > 0.99999);
        }
        let error = f64::sqrt(off / square);
        println!(
            "{name}, {}: {error:.1e} of {inside} pixels; {wrong} have another shadow",
            shadow.name()
        );
        assert!(inside > 15_000);
        // Measured up to 7.5e-7. f32 rounds texture coordinates by 1e-5 of a texel's edge.
        let allowed = if name == "textured" { 2e-5 } else { 2e-6 };
        assert!(error <= allowed, "{name}: {error:e}");
        let allowed = match shadow {
            Shadow::Rays => 0,
            // Corners between the shadow map's texels. The knot's facets are finer than the texels.
            Shadow::Map if name == "knot" => 60,
            // The device rasterises the map to a sixteenth of its texels.
            Shadow::Map if sub_pixel_bits() < 8 => 6,
            Shadow::Map => 3,
        };
        assert!(wrong <= allowed, "{name}, {}: {wrong}", shadow.name());
    }
}
