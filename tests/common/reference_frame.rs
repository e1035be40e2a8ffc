//! The reference of a scene, and how far a frame is from it.

use std::ops::ControlFlow;

use camlux::{
    Scene,
    output::{Frame, Layer},
    reference::Reference,
};

use super::rmse::relative_rmse_where;

/// Its direct light, and with some rounds of so many samples its bounce, too.
pub fn reference_frame(scene: &Scene, samples_per_round: u32, rounds: u32) -> Frame {
    let mut reference = Reference::new(scene, samples_per_round).expect("a valid scene");
    for _ in 0..rounds {
        let go_on = &mut |_| ControlFlow::Continue(());
        reference.add_round(go_on).expect("nothing cancels it");
    }
    reference.frame()
}

pub fn values(frame: &Frame, layer: Layer) -> &[f32] {
    frame.values(layer).expect("the frame has it")
}

/// relRMSE of a layer of three channels, but for pixels on edges.
pub fn error_off_edges(frame: &Frame, reference: &Frame, layer: Layer) -> f64 {
    let edges = reference.ids(Layer::Edge).expect("a reference has it");
    let [found, due] = [frame, reference].map(|frame| values(frame, layer));
    relative_rmse_where(found, due, |pixel| edges[pixel] == 0)
}
