//! The layers with the light of one number of bounces alone. Each comes from a gather of its own, before that of all light.

use std::ops::ControlFlow;

use crate::{
    Error, RenderOptions, Renderer, Result, Scene,
    frame::{BufferPool, Cached, DrawnFrame, Progress},
    output::{Frame, FrameStats, Layer, LayerData, TofQuantity},
    plan::GatheredPart,
    renderer::Drawing,
};

/// What a frame has of single numbers of bounces.
pub(crate) struct BounceLayers {
    layers: Vec<(Layer, LayerData)>,
    stats: FrameStats,
    /// The gather that is still to come.
    pub rest: GatheredPart,
}

impl BounceLayers {
    pub fn add_to(self, frame: &mut Frame) {
        frame.layers.extend(self.layers);
        frame.stats.include(&self.stats);
    }
}

/// The layer of a frame with fewer bounces that holds the light of this one.
fn gathered_as(layer: Layer) -> Layer {
    match layer {
        Layer::Tof(frequency, _) => Layer::Tof(frequency, TofQuantity::PhasorIndirect),
        _ => Layer::Indirect,
    }
}

impl Renderer {
    /// Renders the requested layers of single numbers of bounces; `None` if none is requested.
    pub(crate) fn render_bounces(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
    ) -> Result<Option<BounceLayers>> {
        let requested = options.layers.unwrap_or_default();
        let mut numbers: Vec<u32> = requested
            .iter()
            .filter_map(|layer| layer.bounces())
            .collect();
        numbers.sort_unstable();
        numbers.dedup();
        if numbers.is_empty() {
            return Ok(None);
        }
        let mut part = GatheredPart {
            bounces: None,
            index: 0,
            count: 1 + numbers.len() as u32,
        };
        let mut layers = Vec::new();
        let mut stats = FrameStats::default();
        // They are parts of the frame that counts.
        let frame_index = self.next_frame_index;
        for bounces in numbers {
            part.bounces = Some(bounces);
            let of_part = requested
                .iter()
                .filter(|layer| layer.bounces() == Some(bounces));
            let of_part: Vec<Layer> = of_part.copied().collect();
            let read: Vec<Layer> = of_part.iter().map(|&layer| gathered_as(layer)).collect();
            let mut options = RenderOptions {
                progress: options.progress.as_mut().map(|report| &mut **report as _),
                layers: Some(&read),
                ..*options
            };
            let drawn = self.draw_part(scene, &mut options, part)?;
            self.next_frame_index = frame_index;
            let pool = BufferPool::default();
            let frame = drawn.read(self.readback.get_mut(), pool, Some(&read));
            let frame = frame.inspect_err(|_| self.forget())?;
            self.cache.images = Cached::new(drawn.images.key.clone(), drawn.images);
            stats.include(&frame.stats);
            for layer in of_part {
                let values = frame.values(gathered_as(layer));
                let values = values.ok_or_else(|| Error::internal("a gather without its layer"))?;
                layers.push((layer, LayerData::Float(values.to_vec())));
            }
            part.index += 1;
        }
        part.bounces = None;
        Ok(Some(BounceLayers {
            layers,
            stats,
            rest: part,
        }))
    }

    /// Draws a part of a frame. Its progress is a part of the frame's.
    pub(crate) fn draw_part(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        part: GatheredPart,
    ) -> Result<DrawnFrame> {
        let is_last = part.index + 1 == part.count;
        let mut report = options.progress.as_mut();
        let mut of_part = |progress: Progress| {
            let fraction = (part.index as f32 + progress.fraction) / part.count as f32;
            match &mut report {
                Some(report) if is_last || progress.fraction < 1.0 => report(Progress {
                    fraction,
                    ..progress
                }),
                _ => ControlFlow::Continue(()),
            }
        };
        let mut options = RenderOptions {
            progress: Some(&mut of_part),
            ..*options
        };
        let drawing = Drawing {
            part,
            ..Drawing::default()
        };
        self.draw(scene, &mut options, drawing)
    }
}
