//! What the passes of the refinement share: the images they work on, and the criteria.

use crate::{
    Result,
    metrics::LOCAL_FLOOR,
    plan::Plan,
    vulkan::{Allocate, Device, ImageShape, Recorder, Resource},
};

/// What was gathered or interpolated at each pixel, as `shaders/refinement.wgsl` describes it.
pub(crate) struct RefinementImages<A: Allocate = Device> {
    /// What the diffuse lobe reflects for k_d = 1, W/sr/m²; and the pixel's state.
    diffuse: A::Image,
    /// The same of the specular lobe for k_s = 1; only where some material is specular.
    specular: Option<A::Image>,
    /// Of the samples of gathered pixels, diffuse and specular; only where gathers have noise.
    squared_differences: Option<A::Image>,
}

impl<A: Allocate> RefinementImages<A> {
    pub fn new(allocate: &A, plan: &Plan, is_noisy: bool) -> Result<RefinementImages<A>> {
        let image = |name| allocate.image(name, ImageShape::plain(plan.resolution_px));
        Ok(RefinementImages {
            diffuse: image("gathered diffuse light")?,
            specular: plan
                .is_specular
                .then(|| image("gathered specular light"))
                .transpose()?,
            squared_differences: is_noisy.then(|| image("squared differences")).transpose()?,
        })
    }
}

impl RefinementImages {
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
    /// They count over the pixel's own radiance instead, where that is not far below the image's.
    pub is_local: bool,
    /// What an interpolated pixel may be off by; `None`: none is interpolated.
    pub tolerance: Option<f64>,
    /// Variance of a gather over its sum of squared differences; 0: gathers have no noise.
    pub variance_scale: f64,
    /// Noise of a gather over the radiance of its pixel.
    pub relative_noise: f64,
}

impl RefinementCriteria {
    /// Errors count over this radiance or more, W/sr/m².
    pub fn least_radiance(&self) -> f32 {
        let share = if self.is_local { LOCAL_FLOOR } else { 1.0 };
        (share * self.radiance) as f32
    }

    /// 1 where they count over the pixel's own radiance, else 0.
    pub fn own_share(&self) -> f32 {
        if self.is_local { 1.0 } else { 0.0 }
    }
}
