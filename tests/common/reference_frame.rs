//! The reference image of a scene, and the error of a frame against it.

use std::ops::ControlFlow;

use camlux::{
    Scene,
    metrics::{Comparison, Pixels},
    output::{Frame, Layer},
    reference::Reference,
};

use super::rmse::relative_rmse_where;

/// The direct light of a scene, and its bounce if `rounds` is above 0.
pub fn reference_frame(scene: &Scene, samples_per_round: u32, rounds: u32) -> Frame {
    let mut reference = Reference::new(scene, samples_per_round).expect("a valid scene");
    add_rounds(&mut reference, rounds);
    reference.frame()
}

pub fn add_rounds(reference: &mut Reference, rounds: u32) {
    for _ in 0..rounds {
        let go_on = &mut |_| ControlFlow::Continue(());
        reference.add_round(go_on).expect("nothing cancels it");
    }
}

pub fn values(frame: &Frame, layer: Layer) -> &[f32] {
    frame.values(layer).expect("the frame has it")
}

/// relRMSE of a layer of three channels, without the pixels at edges.
pub fn error_off_edges(frame: &Frame, reference: &Frame, layer: Layer) -> f64 {
    let edges = reference.ids(Layer::Edge).expect("a reference has it");
    let [found, due] = [frame, reference].map(|frame| values(frame, layer));
    relative_rmse_where(found, due, |pixel| edges[pixel] == 0)
}

/// The error of the indirect light without the reference's noise, and this noise.
pub fn error_of_indirect(frame: &Frame, truth: &Frame) -> (f64, f64) {
    let edges = truth.ids(Layer::Edge).expect("a reference has it");
    let is_inside: Vec<bool> = edges.iter().map(|&edge| edge == 0).collect();
    let compared = Comparison::new(&Pixels {
        image: values(frame, Layer::Indirect),
        reference: values(truth, Layer::Indirect),
        image_standard_error: None,
        reference_standard_error: Some(values(truth, Layer::StandardError)),
        valid: &is_inside,
        edges: None,
        channels: 3,
    });
    let compared = compared.expect("images of one size");
    let error = compared.errors.expect("it is not black").rmse;
    let noise = compared.noise.expect("it has a standard error").floor;
    ((error.powi(2) - noise.powi(2)).max(0.0).sqrt(), noise)
}
