//! The reference image of a scene, and the error of a frame against it.

use std::ops::ControlFlow;

use camlux::{
    Scene,
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
