//! Scenes that are difficult for a path sampler.

use crate::common::reference_frame::add_rounds;
use crate::common::rooms::{floor, quad, scene_of};
use camlux::{
    Error, Scene,
    output::Layer,
    reference::Reference,
    scene::{Light, Mesh},
};
use glam::DVec3;

/// A floor, a wall, and a lamp.
fn corner(lamp_m: DVec3) -> Scene {
    let meshes = vec![
        floor(1.0),
        quad(
            "wall",
            DVec3::new(-1.0, 0.0, -1.0),
            2.0 * DVec3::X,
            DVec3::Y,
            1,
        ),
    ];
    let light = Light::point(lamp_m, [1.0; 3]);
    scene_of(
        meshes,
        light,
        DVec3::new(0.3, 1.0, 2.5),
        DVec3::new(0.0, 0.3, 0.0),
    )
}

fn sampled(scene: &Scene) -> [Vec<f32>; 2] {
    let mut reference = Reference::new(scene, 64).expect("the scene is valid");
    add_rounds(&mut reference, 4);
    let frame = reference.frame();
    [Layer::Direct, Layer::Indirect].map(|layer| frame.values(layer).expect("it is there").to_vec())
}

/// A surface does not block a lamp that is in it: direct light is as if the lamp were a picometre above the surface. Indirect light differs:
/// from a picometre above, the floor right below would reflect half of the power.
#[test]
fn lamp_in_a_surface() {
    for at in [DVec3::new(-0.1, 0.0, 0.1), DVec3::new(0.37, 0.0, -0.73)] {
        let [direct, indirect] = sampled(&corner(at));
        let [above, _] = sampled(&corner(at + 1e-12 * DVec3::Y));
        let mean = above.iter().sum::<f32>() / above.len() as f32;
        let pairs = direct.iter().zip(&above);
        let agree = |(a, b): &(&f32, &f32)| (*a - *b).abs() <= 1e-3 * mean;
        let different = direct.len() - pairs.filter(agree).count();
        assert!(
            mean > 0.0 && different == 0,
            "{different} values differ at {at}"
        );
        assert!(indirect.iter().all(|value| value.is_finite()));
    }
}

/// Triangles without area do not change the image, and all values stay finite.
#[test]
fn triangles_without_area() {
    let mut scene = corner(DVec3::new(0.0, 0.8, 0.2));
    let expected = sampled(&scene);
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..400_u32 {
        let t = f64::from(i) / 400.0;
        let from = DVec3::new(2.0 * t - 1.0, 0.2 + 0.3 * t, 0.3);
        let to = from + DVec3::new(0.37, 0.11, 0.05);
        positions.extend([from, from.lerp(to, 0.3), to].map(|p| p.to_array()));
        triangles.push([3 * i, 3 * i, 3 * i]);
        triangles.push([3 * i, 3 * i + 2, 3 * i]);
    }
    scene
        .meshes
        .push(Mesh::from_slices("needles", &positions, &triangles, 0).into());
    assert!(
        expected
            .iter()
            .all(|layer| layer.iter().any(|&value| value > 0.0))
    );
    assert!(sampled(&scene) == expected);
    // The corners are on a line up to rounding. Rays may hit such a triangle, but it must have a normal.
    let last = scene.meshes.len() - 1;
    scene.meshes[last].triangles = (0..400).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    scene.meshes[last].triangle_materials = vec![0; 400];
    for values in sampled(&scene) {
        assert!(values.iter().all(|value| value.is_finite()));
    }
}

#[test]
fn image_too_large_for_the_memory() {
    let mut scene = corner(DVec3::Y);
    for size in [u32::MAX, 1 << 24] {
        scene.camera.resolution_px = [size; 2];
        let refused = Reference::new(&scene, 16).expect_err("there is no such memory");
        assert!(matches!(refused, Error::Memory { .. }), "{refused}");
    }
}
