//! Predict pass: what the neighbours of the next pixels of a lattice say of their bounce, and whether that will do.

use super::{Context, gbuffer::GBuffer};
use crate::{
    Result,
    plan::{Plan, Step},
    vulkan::{
        Buffer, Device, Image, ImageShape, Recorder, Resource, groups_in_rows,
        shaders::PredictParameters,
    },
};

/// What is known of each pixel's bounce.
pub(crate) struct BounceImages {
    /// Irradiance by the bounce, W/m²; and whether it is known, and how well.
    pub diffuse: Image,
    /// The same weighted by the Phong lobe; only where some material is specular.
    pub specular: Option<Image>,
    /// How much the draws of gathered pixels scatter, diffuse and specular; only where gathers have noise.
    pub spread: Option<Image>,
}

impl BounceImages {
    pub fn new(device: &Device, plan: &Plan, is_noisy: bool) -> Result<BounceImages> {
        let image = |what| Image::new(device, what, ImageShape::plain(plan.resolution_px));
        Ok(BounceImages {
            diffuse: image("bounced light")?,
            specular: plan
                .is_specular
                .then(|| image("bounced specular light"))
                .transpose()?,
            spread: is_noisy.then(|| image("spread of draws")).transpose()?,
        })
    }

    /// Nothing is known.
    pub fn clear<'r>(&'r self, recorder: &mut Recorder<'r>) {
        let others = self.specular.iter().chain(&self.spread);
        for image in others.chain([&self.diffuse]) {
            recorder.prepare_images(&[image]);
            recorder.clear_image(image);
        }
    }

    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![("diffuse_bounce", Resource::Image(&self.diffuse))];
        if let Some(specular) = &self.specular {
            resources.push(("specular_bounce", Resource::Image(specular)));
        }
        if let Some(spread) = &self.spread {
            resources.push(("bounce_spread", Resource::Image(spread)));
        }
        resources
    }

    /// The word of the kernel that fills them.
    pub fn noise_word(&self) -> &'static str {
        match self.spread {
            Some(_) => "noisy",
            None => "exact",
        }
    }
}

/// What predictions are held against.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Judgement {
    /// That of the image, W/sr/m²: errors count over it.
    pub radiance: f64,
    /// What an interpolated pixel may be off by; `None`: none is interpolated.
    pub tolerance: Option<f64>,
    /// Variance of a gather over the spread of its draws; 0: gathers have no noise.
    pub variance_of_spread: f64,
}

/// Interpolates the pixels of a step where that is good enough; the others become candidates that were not gathered before.
pub(crate) fn predict<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    images: &'r BounceImages,
    candidates: &'r Buffer,
    step: Step,
    judgement: Judgement,
) -> Result<()> {
    let plan = context.plan;
    let pipeline = context.pipelines.compute("predict", &[plan.brdf_word()])?;
    let [columns, rows] = step.extent(plan.resolution_px);
    let pattern = match step {
        Step::Base { .. } => "BASE",
        Step::Centres { .. } => "CENTRES",
        Step::Edges { .. } => "EDGES",
    };
    let parameters = PredictParameters {
        reach: step.reach_px(),
        pattern: pipeline.module.constant(pattern)?,
        columns,
        item_count: columns * rows,
        tolerance: judgement.tolerance.unwrap_or(-1.0) as f32,
        inverse_radiance: (1.0 / judgement.radiance) as f32,
    };
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.push(("candidates", Resource::Buffer(candidates)));
    let groups = groups_in_rows((columns * rows).div_ceil(pipeline.module.workgroup_size[0]));
    recorder.pass("predict", |recorder| {
        recorder.dispatch(&pipeline, &resources, &parameters, groups)
    })
}
