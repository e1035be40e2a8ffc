//! What the passes of the refinement share: the images they work on, the grids they go through, and the criteria.

use crate::{
    Result,
    plan::Plan,
    vulkan::{Device, Image, ImageShape, Recorder, Resource},
};

/// What was gathered or interpolated at each pixel, as `shaders/refinement.wgsl` describes it.
pub(crate) struct RefinementImages {
    /// Irradiance, W/m²; and the pixel's state.
    diffuse: Image,
    /// The same weighted by the Phong lobe; only where some material is specular.
    specular: Option<Image>,
    /// Of the samples of gathered pixels, diffuse and specular; only where gathers have noise.
    squared_differences: Option<Image>,
}

impl RefinementImages {
    pub fn new(device: &Device, plan: &Plan, is_noisy: bool) -> Result<RefinementImages> {
        let image = |what| Image::new(device, what, ImageShape::plain(plan.resolution_px));
        Ok(RefinementImages {
            diffuse: image("gathered diffuse light")?,
            specular: plan
                .is_specular
                .then(|| image("gathered specular light"))
                .transpose()?,
            squared_differences: is_noisy.then(|| image("squared differences")).transpose()?,
        })
    }

    /// Nothing is known.
    pub fn clear<'r>(&'r self, recorder: &mut Recorder<'r>) {
        let others = self.specular.iter().chain(&self.squared_differences);
        for image in others.chain([&self.diffuse]) {
            recorder.prepare_images(&[image]);
            recorder.clear_image(image);
        }
    }

    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![("gathered_diffuse", Resource::Image(&self.diffuse))];
        if let Some(specular) = &self.specular {
            resources.push(("gathered_specular", Resource::Image(specular)));
        }
        if let Some(squared_differences) = &self.squared_differences {
            resources.push(("squared_differences", Resource::Image(squared_differences)));
        }
        resources
    }

    /// The word of the kernel that fills them.
    pub fn noise_word(&self) -> &'static str {
        match self.squared_differences {
            Some(_) => "noisy",
            None => "exact",
        }
    }
}

/// When a pixel may be interpolated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RefinementCriteria {
    /// That of the image, W/sr/m²: errors count over it.
    pub radiance: f64,
    /// What an interpolated pixel may be off by; `None`: none is interpolated.
    pub tolerance: Option<f64>,
    /// Variance of a gather over its sum of squared differences; 0: gathers have no noise.
    pub variance_scale: f64,
}

/// Pixels that are visited together, between those before them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GridStep {
    /// The coarsest grid: every `stride`-th pixel.
    Base { stride: u32 },
    /// The centres of the squares of the grid so far, `reach` pixels from their corners along either axis.
    Centres { reach: u32 },
    /// The middles of the edges that are still free.
    Edges { reach: u32 },
}

impl GridStep {
    /// From the coarsest stride, a power of two, to every pixel.
    pub fn all(coarsest_stride: u32) -> Vec<GridStep> {
        let mut steps = vec![GridStep::Base {
            stride: coarsest_stride,
        }];
        let mut reach = coarsest_stride / 2;
        while reach > 0 {
            steps.extend([GridStep::Centres { reach }, GridStep::Edges { reach }]);
            reach /= 2;
        }
        steps
    }

    /// Columns and rows of its pixels; some may lie beyond the image.
    pub fn extent(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            GridStep::Base { stride } => [width.div_ceil(stride), height.div_ceil(stride)],
            GridStep::Centres { reach } => [width, height].map(|size| size.div_ceil(2 * reach)),
            GridStep::Edges { reach } => [width.div_ceil(2 * reach), height.div_ceil(reach)],
        }
    }

    /// How many pixels that are.
    pub fn pixel_count(self, resolution_px: [u32; 2]) -> u32 {
        self.extent(resolution_px).iter().product()
    }
}
