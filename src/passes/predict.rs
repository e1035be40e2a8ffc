//! Predict pass: what the neighbours of the next pixels of a lattice say of their bounce, and whether that will do.

use super::{Context, gbuffer::GBuffer};
use crate::{
    Result,
    plan::Plan,
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

/// Pixels that are visited together, between those before them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    /// The coarsest lattice: every `stride`-th pixel.
    Base { stride: u32 },
    /// The centres of the squares of the lattice so far, `reach` pixels from their corners along either axis.
    Centres { reach: u32 },
    /// The middles of the edges that are still free.
    Edges { reach: u32 },
}

impl Step {
    /// From the coarsest stride, a power of two, to every pixel.
    pub fn all(coarsest_stride: u32) -> Vec<Step> {
        let mut steps = vec![Step::Base {
            stride: coarsest_stride,
        }];
        let mut reach = coarsest_stride / 2;
        while reach > 0 {
            steps.extend([Step::Centres { reach }, Step::Edges { reach }]);
            reach /= 2;
        }
        steps
    }

    /// From its pixels to those known before, along an axis.
    pub fn reach_px(self) -> u32 {
        match self {
            Step::Base { stride: reach } | Step::Centres { reach } | Step::Edges { reach } => reach,
        }
    }

    /// Columns and rows of its pixels; some may lie beyond the image.
    pub fn extent(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            Step::Base { stride } => [width.div_ceil(stride), height.div_ceil(stride)],
            Step::Centres { reach } => [width, height].map(|size| size.div_ceil(2 * reach)),
            Step::Edges { reach } => [width.div_ceil(2 * reach), height.div_ceil(reach)],
        }
    }
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
