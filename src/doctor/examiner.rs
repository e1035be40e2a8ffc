//! Renders the scenes of the cases, and compares what comes out with the truth.

use std::ops::ControlFlow;

use super::{
    Measurement,
    scenes::{with_rays, with_shadow, with_sum},
};
use crate::{
    Device, RenderOptions, Renderer, Result, Scene,
    internals::Intermediates,
    internals::f64_kernels,
    metrics::{Comparison, Pixels},
    output::{Frame, Layer},
    reference::Reference,
    scene::{Bands, Shadow, VplSum},
};

/// relRMSE of sums and of direct light against the same formulas in f64: the rounding of some thirty f32 operations a
/// pair, averaged over the pairs. The bar that the project set; the demo scenes stay below 5e-7.
pub(super) const KERNEL_BOUND: f64 = 2e-6;
/// relRMSE of direct light against the reference, which has its own positions: those of the engine are rounded to 6e-8 of
/// the scene's size, and light changes by twice the share by which its distance does. The demo scenes stay below 1e-6.
pub(super) const DIRECT_BOUND: f64 = 4e-6;
/// The target error of final gathering.
pub(super) const TARGET_ERROR: f64 = 0.05;
/// By how much the true error may exceed it: it is met by an estimate from at most a thousand pixels, here from 576.
pub(super) const TARGET_SLACK: f64 = 1.3;

/// Rounds of a reference: from their spread comes its standard error.
const REFERENCE_ROUNDS: u32 = 8;
/// Samples of a round in each pixel: enough for a noise well below [`TARGET_ERROR`].
const REFERENCE_SAMPLES: u32 = 256;

/// What runs the cases on a device.
pub struct Examiner {
    pub(super) device: Device,
    pub(super) renderer: Renderer,
    last_scene: Option<Scene>,
}

impl Examiner {
    /// For a device.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn new(device: &Device) -> Result<Examiner> {
        Ok(Examiner {
            device: device.clone(),
            renderer: Renderer::new(device)?,
            last_scene: None,
        })
    }

    /// The scene that was rendered last, of those that were handed over as they are: for a picture of the case.
    pub fn last_scene(&self) -> Option<&Scene> {
        self.last_scene.as_ref()
    }

    pub(super) fn render(&mut self, scene: &Scene) -> Result<Frame> {
        self.last_scene = Some(scene.clone());
        self.renderer.render(scene, &mut RenderOptions::default())
    }

    pub(super) fn render_keeping(&mut self, scene: &Scene) -> Result<(Frame, Intermediates)> {
        self.last_scene = Some(scene.clone());
        let options = &mut RenderOptions::default();
        self.renderer.render_with_intermediates(scene, options)
    }

    /// relRMSE of the direct light against the reference.
    pub(super) fn direct(&mut self, what: &str, scene: &Scene, bound: f64) -> Result<Measurement> {
        self.layer(what, scene, (scene, Layer::Direct), bound)
    }

    /// The same with shadows from a map.
    pub(super) fn direct_by_map(
        &mut self,
        what: &str,
        scene: &Scene,
        bound: f64,
    ) -> Result<Measurement> {
        let truth = Reference::new(scene, 1)?.frame();
        let frame = self.render(&with_shadow(scene, Shadow::Map))?;
        let error = error_against(&frame, &truth, Layer::Direct);
        let what = format!("{what}, direct by shadow map");
        Ok(Measurement::new(what, error, bound))
    }

    /// relRMSE of a layer without noise against the reference of a scene that ought to look the same.
    pub(super) fn layer(
        &mut self,
        what: &str,
        scene: &Scene,
        (same, layer): (&Scene, Layer),
        bound: f64,
    ) -> Result<Measurement> {
        let truth = Reference::new(same, 1)?.frame();
        let error = error_against(&self.render(scene)?, &truth, layer);
        let what = format!("{what}, {}", layer.name());
        Ok(Measurement::new(what, error, bound))
    }

    /// Root mean square of the pixels' relative errors of depth: near ones count as much as far ones.
    pub(super) fn depth(&mut self, what: &str, scene: &Scene, bound: f64) -> Result<Measurement> {
        let truth = Reference::new(scene, 1)?.frame();
        let frame = self.render(scene)?;
        let [depths, true_depths] = [&frame, &truth].map(|frame| values(frame, Layer::Depth));
        let is_edge = truth.ids(Layer::Edge).unwrap_or_default();
        let squares: Vec<f64> = depths
            .iter()
            .zip(true_depths)
            .zip(is_edge)
            .filter(|((_, truth), is_edge)| truth.is_finite() && **is_edge == 0)
            .map(|((depth, truth), _)| (f64::from(*depth) / f64::from(*truth) - 1.0).powi(2))
            .collect();
        let error = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        Ok(Measurement::new(format!("{what}, depth"), error, bound))
    }

    /// relRMSE of a plain sum against that of the f64 kernels, over the same G-buffer and VPLs.
    pub(super) fn sum(
        &mut self,
        what: &str,
        scene: &Scene,
        (estimator, rsm_size): (VplSum, u32),
        bound: f64,
    ) -> Result<Measurement> {
        let (frame, kept) = self.render_keeping(&with_sum(scene, estimator, rsm_size))?;
        let truth = f64_kernels::indirect(scene, estimator, &kept);
        let error = error_of(values(&frame, Layer::Indirect), &truth);
        Ok(Measurement::new(
            format!("{what}, {}", estimator.name()),
            error,
            bound,
        ))
    }

    /// Both sums over VPLs.
    pub(super) fn sums(
        &mut self,
        what: &str,
        scene: &Scene,
        rsm_size: u32,
        bound: f64,
    ) -> Result<Measurement> {
        let parts: Result<Vec<_>> = VplSum::ALL
            .into_iter()
            .map(|estimator| self.sum(what, scene, (estimator, rsm_size), bound))
            .collect();
        Ok(Measurement::of(parts?))
    }

    /// relRMSE of final gathering against the reference, without the noise of the latter.
    pub(super) fn bounce(&mut self, what: &str, scene: &Scene) -> Result<Measurement> {
        self.bounce_within(what, scene, TARGET_ERROR, REFERENCE_SAMPLES)
    }

    /// The same against the reference of a scene that ought to look the same.
    pub(super) fn bounce_like(
        &mut self,
        what: &str,
        scene: &Scene,
        same: &Scene,
    ) -> Result<Measurement> {
        self.bounce_against(what, scene, (TARGET_ERROR, same, REFERENCE_SAMPLES))
    }

    /// The same for another target, with a reference of so many samples a round.
    pub(super) fn bounce_within(
        &mut self,
        what: &str,
        scene: &Scene,
        target_error: f64,
        samples: u32,
    ) -> Result<Measurement> {
        self.bounce_against(what, scene, (target_error, scene, samples))
    }

    fn bounce_against(
        &mut self,
        what: &str,
        scene: &Scene,
        (target_error, same, samples): (f64, &Scene, u32),
    ) -> Result<Measurement> {
        let mut reference = Reference::new(same, samples)?;
        for _ in 0..REFERENCE_ROUNDS {
            reference.add_round(&mut |_| ControlFlow::Continue(()))?;
        }
        let frame = self.render(&with_rays(scene, target_error))?;
        let error = error_against(&frame, &reference.frame(), Layer::Indirect);
        Ok(Measurement::new(
            format!("{what}, final-gather"),
            error,
            TARGET_SLACK * target_error,
        ))
    }

    /// The most light, over `bright`, that any pixel of a scene shows in which all must be dark: direct, and by the bounce.
    pub(super) fn leaks(&mut self, scene: &Scene, bright: f64) -> Result<Measurement> {
        let mut parts = Vec::new();
        for shadow in Shadow::ALL {
            let frame = self.render(&with_shadow(scene, shadow))?;
            let leak = largest(values(&frame, Layer::Direct)) / bright;
            let what = format!("shadow by {}, leak over lit radiance", shadow.name());
            parts.push(Measurement::new(what, leak, 0.0));
        }
        let frame = self.render(&with_rays(scene, 0.1))?;
        let leak = largest(values(&frame, Layer::Indirect)) / bright;
        let what = "final-gather, leak over lit radiance";
        parts.push(Measurement::new(what, leak, 0.0));
        Ok(Measurement::of(parts))
    }

    /// Everything against the truth: direct light, both sums over VPLs, final gathering.
    pub(super) fn all(&mut self, what: &str, scene: &Scene, rsm_size: u32) -> Result<Measurement> {
        Ok(Measurement::of([
            self.direct(what, scene, DIRECT_BOUND)?,
            self.direct_by_map(what, scene, DIRECT_BOUND)?,
            self.sums(what, scene, rsm_size, KERNEL_BOUND)?,
            self.bounce(what, scene)?,
        ]))
    }
}

/// The values of a layer; none where the frame has no such layer, which no comparison passes.
pub(super) fn values(frame: &Frame, layer: Layer) -> &[f32] {
    frame.values(layer).unwrap_or_default()
}

/// The values of a layer of three bands in f64, times a factor.
pub(super) fn bands_of(values: &[f32], factor: f64) -> Vec<Bands> {
    let pixels = values.as_chunks().0.iter();
    pixels
        .map(|pixel: &[f32; 3]| pixel.map(|value| f64::from(value) * factor))
        .collect()
}

/// The largest absolute value; infinite where one is no finite number, or where there is none.
pub(super) fn largest(values: &[f32]) -> f64 {
    let largest = values.iter().map(|&value| f64::from(value).abs());
    let of_all = largest.fold(f64::NEG_INFINITY, |most, value| {
        if value.is_nan() {
            f64::INFINITY
        } else {
            most.max(value)
        }
    });
    if of_all < 0.0 { f64::INFINITY } else { of_all }
}

/// relRMSE against values without noise; infinite where a value is no finite number or the truth is black.
pub(super) fn error_of(image: &[f32], truth: &[Bands]) -> f64 {
    let comparison = Comparison::new(&Pixels {
        image,
        reference: truth.as_flattened(),
        image_standard_error: None,
        reference_standard_error: None,
        valid: &vec![true; truth.len()],
        edges: None,
        channels: 3,
    });
    match comparison {
        Ok(Comparison {
            non_finite_image: 0,
            errors: Some(errors),
            ..
        }) => errors.rmse,
        _ => f64::INFINITY,
    }
}

/// relRMSE against a reference, without the noise of the latter and but for pixels whose centre lies on an edge.
fn error_against(frame: &Frame, truth: &Frame, layer: Layer) -> f64 {
    let is_set = |layer: Layer| -> Vec<bool> {
        let ids = truth.ids(layer).unwrap_or_default();
        ids.iter().map(|&id| id != 0).collect()
    };
    let noise = match layer {
        Layer::Indirect => truth.values(Layer::StandardError),
        _ => None,
    };
    let comparison = Comparison::new(&Pixels {
        image: values(frame, layer),
        reference: values(truth, layer),
        image_standard_error: None,
        reference_standard_error: noise,
        valid: &is_set(Layer::InstanceId),
        edges: Some(&is_set(Layer::Edge)),
        channels: layer.channel_names().len(),
    });
    let Ok(comparison) = comparison else {
        return f64::INFINITY;
    };
    if comparison.non_finite_image > 0 {
        return f64::INFINITY;
    }
    let corrected = comparison
        .noise
        .and_then(|noise| noise.rmse.value_or_bound());
    let plain = comparison.errors.map(|errors| errors.rmse);
    corrected.or(plain).unwrap_or(f64::INFINITY)
}
