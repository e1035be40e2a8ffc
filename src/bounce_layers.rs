//! The layers with the light of one number of bounces alone. Each comes from gathers of its own, after that of all light.

use std::{ops::ControlFlow, time::Instant};

use crate::{
    Error, RenderOptions, Renderer, Result, Scene,
    frame::Progress,
    output::{Frame, FrameStats, Layer, LayerData, TofQuantity},
    plan::GatheredPart,
    scene::{DEFAULT_TARGET_ERROR, IndirectLight, TARGET_ERRORS},
};

/// Target error of the gather that shows how much light a number of bounces has, and its share of the limits of these bounces.
const ROUGH_ERROR: f64 = 0.3;
const ROUGH_SHARE: f64 = 0.25;

/// The layer of a gather that holds what this one asks for.
fn gathered_as(layer: Layer) -> Layer {
    match layer {
        Layer::Tof(frequency, _) => Layer::Tof(frequency, TofQuantity::PhasorIndirect),
        _ => Layer::Indirect,
    }
}

/// The root of the sum of squares of the indirect light.
fn norm(frame: &Frame) -> f64 {
    let values = frame.values(Layer::Indirect).unwrap_or_default();
    let squares = values.iter().map(|value| f64::from(*value).powi(2));
    squares.sum::<f64>().sqrt()
}

/// What a part has cost, with the error relative to the light of the frame, which is this many times its own.
fn stats_of_part(stats: &FrameStats, times: f64) -> FrameStats {
    FrameStats {
        estimated_error: stats.estimated_error.map(|error| error / times),
        estimated_error_upper: stats.estimated_error_upper.map(|error| error / times),
        ..stats.clone()
    }
}

impl Renderer {
    /// Renders a frame with layers of single numbers of bounces. Their error is relative to all indirect light, like the frame's: a rough
    /// gather shows how large it may be relative to their own.
    pub(crate) fn render_with_bounces(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
    ) -> Result<Frame> {
        let start = Instant::now();
        let requested = options.layers.unwrap_or_default();
        let mut numbers: Vec<u32> = requested
            .iter()
            .filter_map(|layer| layer.bounces())
            .collect();
        numbers.sort_unstable();
        numbers.dedup();
        let gather = scene.indirect.as_ref().and_then(IndirectLight::gather);
        let target = gather.map_or(DEFAULT_TARGET_ERROR, |gather| gather.target_error);
        let share = 1.0 / (1.0 + numbers.len() as f64);
        let of_all: Vec<Layer> = requested.iter().copied().chain([Layer::Indirect]).collect();
        let whole = GatheredPart {
            bounces: None,
            target_error: None,
            share,
        };
        let mut frame = self.render_within(scene, options, &of_all, whole, 0.0)?;
        // The parts belong to the frame that counts.
        let next_frame_index = self.next_frame_index;
        let all_light = norm(&frame);
        let mut layers = Vec::new();
        for (bounces, before) in numbers.into_iter().zip(1..) {
            let of_part = requested
                .iter()
                .filter(|layer| layer.bounces() == Some(bounces));
            let of_part: Vec<Layer> = of_part.copied().collect();
            let mut read: Vec<Layer> = of_part.iter().map(|&layer| gathered_as(layer)).collect();
            read.push(Layer::Indirect);
            let rough = GatheredPart {
                bounces: Some(bounces),
                target_error: Some(ROUGH_ERROR),
                share: ROUGH_SHARE * share,
            };
            let begin = share * f64::from(before);
            let mut part = self.render_within(scene, options, &read, rough, begin)?;
            // Black light has no error.
            let times = all_light / norm(&part).max(f64::MIN_POSITIVE);
            let needed = (target * times).min(TARGET_ERRORS.most);
            let upper = part.stats.estimated_error_upper;
            if upper.is_some_and(|upper| upper > needed) {
                let cost = FrameStats {
                    stop: None,
                    estimated_error: None,
                    estimated_error_upper: None,
                    ..part.stats
                };
                frame.stats.include(&cost);
                let finer = GatheredPart {
                    target_error: Some(needed),
                    share: (1.0 - ROUGH_SHARE) * share,
                    ..rough
                };
                let begin = begin + rough.share;
                part = self.render_within(scene, options, &read, finer, begin)?;
            }
            frame.stats.include(&stats_of_part(&part.stats, times));
            for layer in of_part {
                let values = part.values(gathered_as(layer));
                let values = values.ok_or_else(|| Error::internal("a gather without its layer"))?;
                layers.push((layer, LayerData::Float(values.to_vec())));
            }
        }
        self.next_frame_index = next_frame_index;
        frame.layers.extend(layers);
        frame.layers.retain(|(layer, _)| requested.contains(layer));
        let end = Progress {
            fraction: 1.0,
            pass: "done",
        };
        let ends = options.progress.as_mut().map(|report| report(end));
        if ends.is_some_and(|flow| flow.is_break()) && !options.keep_partial {
            return Err(Error::Cancelled);
        }
        frame.stats.wall_milliseconds = 1e3 * start.elapsed().as_secs_f64();
        Ok(frame)
    }

    /// Renders a part of a frame. Its progress is its share of the frame's, from `begin` on.
    fn render_within(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        layers: &[Layer],
        part: GatheredPart,
        begin: f64,
    ) -> Result<Frame> {
        let mut report = options.progress.as_mut();
        let mut of_part = |progress: Progress| match &mut report {
            Some(report) if progress.fraction < 1.0 => report(Progress {
                fraction: (begin + part.share * f64::from(progress.fraction)) as f32,
                ..progress
            }),
            _ => ControlFlow::Continue(()),
        };
        let mut options = RenderOptions {
            progress: Some(&mut of_part),
            layers: Some(layers),
            ..*options
        };
        self.render_part(scene, &mut options, Some(part))
    }
}
