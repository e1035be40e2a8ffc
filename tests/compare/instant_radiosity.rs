//! Without occluders, `instant-radiosity` converges to the path-sampled reference as its RSM is refined.

use std::{f64::consts::PI, ops::ControlFlow};

use crate::common::gpu::{Gpu, sub_pixel_bits};
use crate::common::rooms::{floor, quad, scene_of};
use camlux::{
    metrics::{Comparison, Pixels},
    output::Layer,
    reference::{Goal, Reference},
    scene::{IndirectLight, Light, SpotCone, VplSum},
};
use glam::DVec3;

/// A spot lights one of two plates that face each other, and its cone is well inside the rim. The sum over texels is a midpoint
/// rule for a continuous integrand, so its error falls with the square of the number of texels along an edge.
#[test]
fn error_falls_with_the_square_of_the_resolution() {
    let meshes = vec![
        floor(2.0),
        quad(
            "ceiling",
            DVec3::new(-2.0, 1.0, -2.0),
            4.0 * DVec3::X,
            4.0 * DVec3::Z,
            1,
        ),
    ];
    let light = Light::spot(
        DVec3::new(0.13, 0.1, -0.08),
        DVec3::new(0.2, 1.0, 0.1),
        SpotCone {
            inner_half_angle_deg: 15.0,
            outer_half_angle_deg: 40.0,
        },
        [4.0 * PI; 3],
    );
    let mut scene = scene_of(
        meshes,
        light,
        DVec3::new(0.2, 0.5, 2.2),
        DVec3::new(0.0, 0.3, 0.0),
    );
    scene.camera.resolution_px = [16, 16];

    let goal = Goal::StandardError(1e-4);
    let go_on = &mut |_| ControlFlow::Continue(());
    let reference = Reference::start(&scene, goal, go_on).expect("the scene is valid");
    let mut reference = reference.with_sub_pixel_bits(sub_pixel_bits());
    while !reference.meets(goal) {
        reference.add_round(go_on).expect("nothing cancels it");
    }
    let noise = reference
        .relative_standard_error()
        .expect("there are rounds");
    let truth = reference.frame();
    let layer = |layer: Layer| truth.values(layer).expect("it is there");
    let edges = truth.ids(Layer::Edge).expect("a reference marks edges");
    let edges: Vec<bool> = edges.iter().map(|&edge| edge != 0).collect();
    let (truth, truth_error) = (layer(Layer::Indirect), layer(Layer::StandardError));

    let mut gpu = Gpu::open();
    let sizes = [4, 8, 16, 32];
    let errors = sizes.map(|rsm_size| {
        scene.indirect = Some(IndirectLight::vpl_sum(VplSum::InstantRadiosity, rsm_size));
        let frame = gpu.render(&scene);
        let image = frame.values(Layer::Indirect).expect("it was asked for");
        let comparison = Comparison::new(&Pixels {
            image,
            reference: truth,
            image_standard_error: None,
            reference_standard_error: Some(truth_error),
            valid: &vec![true; truth.len() / 3],
            edges: Some(&edges),
            channels: 3,
        });
        let comparison = comparison.expect("images of one size");
        let error = comparison
            .noise
            .expect("there is light")
            .rmse
            .value_or_bound();
        let error = error.expect("the reference is not noise");
        println!("rsm_size {rsm_size}: {error:.2e}");
        error
    });
    println!("noise {noise:.1e}");
    let rate = (errors[0] / errors[3]).log2() / 3.0;
    println!("rate {rate:.2}");
    // Measured 2.01 and 2.7e-4.
    assert!((1.9..2.1).contains(&rate), "{rate}");
    assert!(errors[3] < 3.5e-4 && noise < 0.5 * errors[3]);
}
