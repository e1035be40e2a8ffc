//! The layers with the light of one number of bounces alone. Each comes from gathers of its own, after that of all light.

use std::{cell::Cell, ops::ControlFlow, time::Instant};

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

/// The statistics of a part: with the error relative to the light of the frame, which is this many times its own, and with the least limits of
/// a frame of which it gets its share.
fn stats_of_part(
    stats: &FrameStats,
    times: f64,
    GatheredPart { share, .. }: GatheredPart,
) -> FrameStats {
    let of_frame = |error: f64| Some(error / times).filter(|error| error.is_finite());
    FrameStats {
        estimated_error: stats.estimated_error.and_then(of_frame),
        estimated_error_upper: stats.estimated_error_upper.and_then(of_frame),
        least_rays: stats.least_rays.map(|rays| (rays as f64 / share) as u64),
        least_milliseconds: stats.least_milliseconds.map(|ms| ms / share),
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
        let is_ended = Cell::new(false);
        let mut render = |renderer: &mut Renderer, layers: &[Layer], part: GatheredPart| {
            renderer.render_within(scene, options, layers, part, &is_ended)
        };
        let share = 1.0 / (1.0 + numbers.len() as f64);
        let of_all: Vec<Layer> = requested.iter().copied().chain([Layer::Indirect]).collect();
        let whole = GatheredPart {
            bounces: None,
            target_error: None,
            begin: 0.0,
            share,
        };
        let mut frame = render(self, &of_all, whole)?;
        frame.stats = stats_of_part(&frame.stats, 1.0, whole);
        // The parts belong to the frame that counts.
        let next_frame_index = self.next_frame_index;
        let all_light = norm(&frame);
        let mut layers = Vec::new();
        for (bounces, before) in numbers.into_iter().zip(1..) {
            let is_of_part = |layer: &&Layer| layer.bounces() == Some(bounces);
            let mut of_part: Vec<Layer> = requested.iter().filter(is_of_part).copied().collect();
            of_part.sort_unstable();
            of_part.dedup();
            let mut read: Vec<Layer> = of_part.iter().map(|&layer| gathered_as(layer)).collect();
            read.push(Layer::Indirect);
            let rough = GatheredPart {
                bounces: Some(bounces),
                target_error: Some(ROUGH_ERROR),
                begin: share * f64::from(before),
                share: ROUGH_SHARE * share,
            };
            let mut part = render(self, &read, rough)?;
            // Black light has no error.
            let times = all_light / norm(&part).max(f64::MIN_POSITIVE);
            let needed = (target * times).min(TARGET_ERRORS.most);
            let mut stats = stats_of_part(&part.stats, times, rough);
            let upper = part.stats.estimated_error_upper;
            let is_enough = upper.is_none_or(|upper| upper <= needed);
            if !is_enough && !is_ended.get() {
                frame.stats.include(&FrameStats {
                    stop: None,
                    estimated_error: None,
                    estimated_error_upper: None,
                    ..stats
                });
                let finer = GatheredPart {
                    target_error: Some(needed),
                    begin: rough.begin + rough.share,
                    share: (1.0 - ROUGH_SHARE) * share,
                    ..rough
                };
                part = render(self, &read, finer)?;
                stats = stats_of_part(&part.stats, times, finer);
            }
            frame.stats.include(&stats);
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
        let report = options.progress.as_mut().filter(|_| !is_ended.get());
        let ends = report.is_some_and(|report| report(end).is_break());
        if ends && !options.keep_partial {
            return Err(Error::Cancelled);
        }
        frame.stats.wall_milliseconds = 1e3 * start.elapsed().as_secs_f64();
        Ok(frame)
    }

    /// Renders a part of a frame. Its progress is a part of the frame's. Once the caller ends a part, all that follow end at once.
    fn render_within(
        &mut self,
        scene: &Scene,
        options: &mut RenderOptions,
        layers: &[Layer],
        part: GatheredPart,
        is_ended: &Cell<bool>,
    ) -> Result<Frame> {
        let mut report = options.progress.as_mut();
        let mut of_part = |progress: Progress| {
            if is_ended.get() {
                return ControlFlow::Break(());
            }
            let fraction = part.begin + part.share * f64::from(progress.fraction);
            let flow = match &mut report {
                Some(report) if progress.fraction < 1.0 => report(Progress {
                    fraction: fraction as f32,
                    ..progress
                }),
                _ => ControlFlow::Continue(()),
            };
            is_ended.set(flow.is_break());
            flow
        };
        let mut options = RenderOptions {
            progress: Some(&mut of_part),
            layers: Some(layers),
            ..*options
        };
        self.render_part(scene, &mut options, Some(part))
    }
}
