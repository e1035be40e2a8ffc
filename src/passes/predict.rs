//! Predict pass: what the neighbours of the next pixels of a lattice say of their bounce, and whether that will do.

use super::{Context, gbuffer::GBuffer};
use crate::{
    Result,
    plan::Plan,
    vulkan::{Buffer, Device, Image, ImageShape, Recorder, Resource, shaders::PredictParameters},
};

/// Workgroups of a row that every Vulkan device takes.
const MAX_GROUPS: u32 = 65_535;

/// What is known of each pixel's bounce.
pub(crate) struct BounceImages {
    /// Irradiance by the bounce, W/m²; and whether it is known, and how well.
    pub diffuse: Image,
    /// The same weighted by the Phong lobe; only where some material is specular.
    pub specular: Option<Image>,
}

impl BounceImages {
    pub fn new(device: &Device, plan: &Plan) -> Result<BounceImages> {
        let image = |what| Image::new(device, what, ImageShape::plain(plan.resolution_px));
        Ok(BounceImages {
            diffuse: image("bounced light")?,
            specular: plan
                .is_specular
                .then(|| image("bounced specular light"))
                .transpose()?,
        })
    }

    /// Nothing is known.
    pub fn clear<'r>(&'r self, recorder: &mut Recorder<'r>) {
        for image in [Some(&self.diffuse), self.specular.as_ref()]
            .into_iter()
            .flatten()
        {
            recorder.prepare_images(&[image]);
            recorder.clear_image(image);
        }
    }

    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![("diffuse_bounce", Resource::Image(&self.diffuse))];
        if let Some(specular) = &self.specular {
            resources.push(("specular_bounce", Resource::Image(specular)));
        }
        resources
    }
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

    /// Columns and rows of its pixels; some may lie beyond the image.
    pub fn extent(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            Step::Base { stride } => [width.div_ceil(stride), height.div_ceil(stride)],
            Step::Centres { reach } => [width, height].map(|size| size.div_ceil(2 * reach)),
            Step::Edges { reach } => [width.div_ceil(2 * reach), height.div_ceil(reach)],
        }
    }
}

/// Interpolates the pixels of a step where that is good enough; the others become candidates. `tolerance` is what an
/// interpolated pixel may be off by, over the image's radiance; `None`: all become candidates that were not gathered before.
pub(crate) fn predict<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    images: &'r BounceImages,
    candidates: &'r Buffer,
    step: Step,
    tolerance: Option<f64>,
) -> Result<()> {
    let plan = context.plan;
    let pipeline = context.pipelines.compute("predict", &[plan.brdf_word()])?;
    let [columns, rows] = step.extent(plan.resolution_px);
    let (reach, pattern) = match step {
        Step::Base { stride } => (stride, pipeline.module.constant("BASE")?),
        Step::Centres { reach } => (reach, pipeline.module.constant("CENTRES")?),
        Step::Edges { reach } => (reach, pipeline.module.constant("EDGES")?),
    };
    let parameters = PredictParameters {
        reach,
        pattern,
        columns,
        item_count: columns * rows,
        tolerance: tolerance.unwrap_or(-1.0) as f32,
    };
    let mut resources = gbuffer.resources();
    resources.extend(images.resources());
    resources.push(("candidates", Resource::Buffer(candidates)));
    let groups = (columns * rows).div_ceil(pipeline.module.workgroup_size[0]);
    let groups_per_row = groups.min(MAX_GROUPS);
    recorder.pass("predict", |recorder| {
        recorder.dispatch(
            &pipeline,
            &resources,
            &parameters,
            [groups_per_row, groups.div_ceil(groups_per_row.max(1)), 1],
        )
    })
}
