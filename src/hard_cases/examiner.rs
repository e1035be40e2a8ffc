//! Renders the scenes of the cases and compares the results with the ground truth.

use std::{mem, ops::ControlFlow};

use super::{
    Case, Measurement, Part,
    scenes::{with_each_estimator, with_rays, with_shadow, with_sum},
    torture_rows::{Row, Settings},
};
use crate::{
    Device, RenderOptions, Renderer, Result, Scene,
    internals::{Intermediates, f64_kernels},
    metrics::{Comparison, Pixels},
    output::{Frame, Layer},
    reference::Reference,
    scene::{Shadow, VplSum},
};

/// relRMSE of sums and of direct light against the same formulas in f64: the rounding of some thirty f32 operations per pair, averaged over
/// the pairs. This bound is a requirement of the project; the demo scenes stay below 5e-7.
pub(super) const KERNEL_BOUND: f64 = 2e-6;
/// relRMSE of direct light against the reference, which computes its own positions. The engine's positions are rounded to 6e-8 of the
/// scene's size, and the relative error of light is twice that of its distance. The demo scenes stay below 1e-6.
pub(super) const DIRECT_BOUND: f64 = 4e-6;
/// The target error of final gathering.
pub(super) const TARGET_ERROR: f64 = 0.05;
/// Factor by which the true error may exceed the target error: the engine estimates from at most a thousand pixels, here from 576.
pub(super) const TARGET_SLACK: f64 = 1.3;

/// Rounds of a reference; its standard error comes from their spread.
const REFERENCE_ROUNDS: u32 = 8;
/// Standard error of a reference for [`TARGET_ERROR`]: a fifth of it; comparisons subtract it.
const REFERENCE_ERROR: f64 = 0.2 * TARGET_ERROR;
/// Samples per pixel in a round. Rounds are added until [`REFERENCE_ERROR`] is reached.
const SAMPLES_OF_A_ROUND: u32 = 32;
/// Maximum number of rounds, for references whose error falls slowly.
const MOST_ROUNDS: u32 = 64;

/// Runs the cases on a device. The checks of a case record one or more errors.
pub struct Examiner {
    pub(super) device: Device,
    pub(super) renderer: Renderer,
    last_scene: Option<Scene>,
    measured: Measurement,
    pub(super) torture: Settings,
    pub(super) rows: Vec<Row>,
}

impl Examiner {
    /// An examiner for a device.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn new(device: &Device) -> Result<Examiner> {
        Ok(Examiner {
            device: device.clone(),
            renderer: Renderer::new(device)?,
            last_scene: None,
            measured: Measurement::default(),
            torture: Settings::default(),
            rows: Vec::new(),
        })
    }

    /// Renders the scenes of a case and measures.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn examine(&mut self, case: &Case) -> Result<Measurement> {
        self.measured = Measurement::default();
        (case.run)(self)?;
        Ok(mem::take(&mut self.measured))
    }

    /// The last scene that was rendered, of those rendered without changes; for a picture of the case.
    pub fn last_scene(&self) -> Option<&Scene> {
        self.last_scene.as_ref()
    }

    /// Sets how the cases of the torture set are rendered from now on.
    pub fn set_torture(&mut self, settings: Settings) {
        self.torture = settings;
    }

    /// Returns the images of the torture set since the last call.
    pub fn take_rows(&mut self) -> Vec<Row> {
        mem::take(&mut self.rows)
    }

    /// Records one error of the case with its bound: [`Part`].
    pub(super) fn record(&mut self, of: &str, quantity: &str, error: f64, bound: f64) {
        self.measured.parts.push(Part {
            of: of.into(),
            quantity: quantity.into(),
            error: if error.is_nan() { f64::INFINITY } else { error },
            bound,
        });
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

    /// The largest absolute value of a layer.
    pub(super) fn largest(&mut self, scene: &Scene, layer: Layer) -> Result<f64> {
        Ok(largest(values(&self.render(scene)?, layer)))
    }

    /// Records the largest radiance of a scene in which no estimator may find light.
    pub(super) fn all_black(&mut self, what: &str, scene: &Scene) -> Result<()> {
        for (_, scene) in with_each_estimator(scene, 16, 0.1) {
            let radiance = self.largest(&scene, Layer::Radiance)?;
            self.record(what, "radiance", radiance, 0.0);
        }
        Ok(())
    }

    /// relRMSE of a layer against a reference, without the reference's noise and without pixels whose centre is on an edge.
    pub(super) fn error_against(
        &mut self,
        truth: &Frame,
        scene: &Scene,
        layer: Layer,
    ) -> Result<f64> {
        let frame = self.render(scene)?;
        let noise = layer.standard_error();
        Ok(relative_rmse(&Pixels {
            image: values(&frame, layer),
            reference: values(truth, layer),
            image_standard_error: None,
            reference_standard_error: noise.and_then(|noise| truth.values(noise)),
            valid: &truth.mask(Layer::InstanceId),
            edges: Some(&truth.mask(Layer::Edge)),
            channels: layer.channel_names().len(),
        }))
    }

    /// The reference without its indirect light, which needs no samples.
    pub(super) fn unsampled(&self, scene: &Scene) -> Result<Frame> {
        Ok(self.reference(scene, 1)?.frame())
    }

    /// The reference with this number of samples per pixel in each of its rounds.
    pub(super) fn sampled(&self, scene: &Scene, samples_per_round: u32) -> Result<Frame> {
        let mut reference = self.reference(scene, samples_per_round)?;
        for _ in 0..REFERENCE_ROUNDS {
            reference.add_round(&mut |_| ControlFlow::Continue(()))?;
        }
        Ok(reference.frame())
    }

    /// The reference with the accuracy that [`TARGET_ERROR`] needs.
    pub(super) fn sampled_enough(&self, scene: &Scene) -> Result<Frame> {
        let mut reference = self.reference(scene, SAMPLES_OF_A_ROUND)?;
        let is_enough = |reference: &Reference| {
            let error = reference.relative_standard_error();
            let is_exact = error.is_none_or(|error| error <= REFERENCE_ERROR);
            reference.rounds()
                >= if is_exact {
                    REFERENCE_ROUNDS
                } else {
                    MOST_ROUNDS
                }
        };
        while !is_enough(&reference) {
            reference.add_round(&mut |_| ControlFlow::Continue(()))?;
        }
        Ok(reference.frame())
    }

    /// A reference that marks the pixels on an edge for this device.
    fn reference(&self, scene: &Scene, samples_per_round: u32) -> Result<Reference> {
        let reference = Reference::new(scene, samples_per_round)?;
        Ok(reference.with_sub_pixel_bits(self.sub_pixel_bits()))
    }

    pub(super) fn sub_pixel_bits(&self) -> u32 {
        self.device.info().limits.sub_pixel_bits
    }

    /// relRMSE between the indirect light of two scenes that should look the same, relative to the first.
    pub(super) fn apart(&mut self, [one, other]: [&Scene; 2]) -> Result<f64> {
        let [truth, frame] = [self.render(one)?, self.render(other)?];
        let image = values(&frame, Layer::Indirect);
        Ok(error_of(image, values(&truth, Layer::Indirect)))
    }

    /// relRMSE of the direct light against the reference.
    pub(super) fn direct(&mut self, what: &str, scene: &Scene, bound: f64) -> Result<()> {
        self.direct_against(&self.unsampled(scene)?, what, scene, bound)
    }

    /// The same against a given reference.
    pub(super) fn direct_against(
        &mut self,
        truth: &Frame,
        what: &str,
        scene: &Scene,
        bound: f64,
    ) -> Result<()> {
        let error = self.error_against(truth, scene, Layer::Direct)?;
        self.record(what, "direct", error, bound);
        Ok(())
    }

    /// The same with shadows from a map.
    pub(super) fn direct_by_map(&mut self, what: &str, scene: &Scene, bound: f64) -> Result<()> {
        self.direct_by_map_against(&self.unsampled(scene)?, what, scene, bound)
    }

    fn direct_by_map_against(
        &mut self,
        truth: &Frame,
        what: &str,
        scene: &Scene,
        bound: f64,
    ) -> Result<()> {
        let by_map = with_shadow(scene, Shadow::Map);
        let error = self.error_against(truth, &by_map, Layer::Direct)?;
        self.record(what, "direct by shadow map", error, bound);
        Ok(())
    }

    /// relRMSE of both plain sums against the f64 kernels, with the same G-buffer and VPLs.
    pub(super) fn sums(
        &mut self,
        what: &str,
        scene: &Scene,
        rsm_size: u32,
        bound: f64,
    ) -> Result<()> {
        for sum in VplSum::ALL {
            let (frame, kept) = self.render_keeping(&with_sum(scene, sum, rsm_size))?;
            let truth = f64_kernels::indirect(scene, sum, &kept);
            let error = error_of(values(&frame, Layer::Indirect), truth.as_flattened());
            self.record(what, sum.name(), error, bound);
        }
        Ok(())
    }

    /// relRMSE of final gathering against the reference.
    pub(super) fn bounce(&mut self, what: &str, scene: &Scene) -> Result<()> {
        let truth = self.sampled_enough(scene)?;
        self.bounce_against(&truth, what, scene, TARGET_ERROR)
    }

    /// The same against a given reference.
    pub(super) fn bounce_against(
        &mut self,
        truth: &Frame,
        what: &str,
        scene: &Scene,
        target_error: f64,
    ) -> Result<()> {
        let by_rays = with_rays(scene, target_error);
        let error = self.error_against(truth, &by_rays, Layer::Indirect)?;
        self.record(what, "final-gather", error, TARGET_SLACK * target_error);
        Ok(())
    }

    /// Records the most light of any pixel, divided by `bright`, in a scene that must be dark: direct light, and the bounce.
    pub(super) fn leaks(&mut self, scene: &Scene, bright: f64) -> Result<()> {
        let quantity = "leak over lit radiance";
        for shadow in Shadow::ALL {
            let leak = self.largest(&with_shadow(scene, shadow), Layer::Direct)? / bright;
            let what = format!("shadow by {}", shadow.name());
            self.record(&what, quantity, leak, 0.0);
        }
        let leak = self.largest(&with_rays(scene, 0.1), Layer::Indirect)? / bright;
        self.record("final-gather", quantity, leak, 0.0);
        Ok(())
    }

    /// Checks direct light by shadow rays, both sums over VPLs, and final gathering.
    pub(super) fn by_rays(&mut self, what: &str, scene: &Scene, bound: f64) -> Result<()> {
        let truth = self.sampled_enough(scene)?;
        self.direct_against(&truth, what, scene, bound)?;
        self.sums(what, scene, 24, KERNEL_BOUND)?;
        self.bounce_against(&truth, what, scene, TARGET_ERROR)
    }

    /// Checks everything against the ground truth, with a bound for direct light.
    pub(super) fn all_within(&mut self, what: &str, scene: &Scene, bound: f64) -> Result<()> {
        let truth = self.sampled_enough(scene)?;
        self.direct_against(&truth, what, scene, bound)?;
        self.direct_by_map_against(&truth, what, scene, bound)?;
        self.sums(what, scene, 24, KERNEL_BOUND)?;
        self.bounce_against(&truth, what, scene, TARGET_ERROR)
    }

    /// Checks everything against the ground truth.
    pub(super) fn all(&mut self, what: &str, scene: &Scene) -> Result<()> {
        self.all_within(what, scene, DIRECT_BOUND)
    }
}

/// The values of a layer; empty if the frame has no such layer, which fails every comparison.
pub(super) fn values(frame: &Frame, layer: Layer) -> &[f32] {
    frame.values(layer).unwrap_or_default()
}

/// The largest absolute value; infinite if a value is not finite or there are no values.
pub(super) fn largest(values: &[f32]) -> f64 {
    if values.is_empty() || values.iter().any(|value| value.is_nan()) {
        return f64::INFINITY;
    }
    values
        .iter()
        .fold(0.0, |most, value| f64::from(value.abs()).max(most))
}

/// relRMSE of a layer of three bands against values without noise; infinite if a value is not finite or the ground truth is black.
pub(super) fn error_of<T: Copy + Into<f64>>(image: &[f32], truth: &[T]) -> f64 {
    relative_rmse(&Pixels {
        image,
        reference: truth,
        image_standard_error: None,
        reference_standard_error: None,
        valid: &vec![true; truth.len() / 3],
        edges: None,
        channels: 3,
    })
}

fn relative_rmse<T: Copy + Into<f64>>(pixels: &Pixels<T>) -> f64 {
    match Comparison::new(pixels) {
        Ok(Comparison {
            non_finite_image: 0,
            errors: Some(errors),
            noise,
            ..
        }) => {
            let corrected = noise.and_then(|noise| noise.rmse.value_or_bound());
            corrected.unwrap_or(errors.rmse)
        }
        _ => f64::INFINITY,
    }
}
