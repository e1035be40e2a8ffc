//! Motion blur: a pixel shows the mean of several renders within an exposure.

use camlux::output::{Frame, Layer, LayerData};

/// The layers that hold light. All renders of one frame draw the same samples, so that their errors may be correlated: the mean of their
/// standard errors is an upper bound.
const LIGHT: [Layer; 5] = [
    Layer::Radiance,
    Layer::Direct,
    Layer::Indirect,
    Layer::StandardError,
    Layer::Energy,
];

/// Sums over the renders.
#[derive(Default)]
pub struct Mean {
    sums: Vec<(Layer, Vec<f64>)>,
    count: u32,
}

/// Whether the mean has the layer.
pub fn is_averaged(layer: Layer) -> bool {
    LIGHT.contains(&layer) || matches!(layer, Layer::Bounce(_))
}

impl Mean {
    pub fn add(&mut self, frame: &Frame) {
        let layers = frame.layers.iter().map(|(layer, _)| *layer);
        for layer in layers.filter(|&layer| is_averaged(layer)) {
            let Some(values) = frame.values(layer) else {
                continue;
            };
            let known = self.sums.iter().position(|(known, _)| *known == layer);
            let index = known.unwrap_or_else(|| {
                self.sums.push((layer, vec![0.0; values.len()]));
                self.sums.len() - 1
            });
            for (sum, &value) in self.sums[index].1.iter_mut().zip(values) {
                *sum += f64::from(value);
            }
        }
        self.count += 1;
    }

    /// Replaces the light of a frame by this mean.
    pub fn put_into(self, frame: &mut Frame) {
        let share = 1.0 / f64::from(self.count);
        frame.layers.retain(|(layer, _)| !is_averaged(*layer));
        for (layer, sums) in self.sums {
            let means = sums.iter().map(|sum| (sum * share) as f32);
            let data = LayerData::Float(means.collect());
            frame.layers.push((layer, data));
        }
    }
}
