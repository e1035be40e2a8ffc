//! What the passes of the refinement share: the images they work on, and the criteria.

use crate::{
    Result,
    metrics::LOCAL_FLOOR,
    plan::Plan,
    vulkan::{Allocate, Device, Image, ImageShape, Recorder, Resource},
};

/// What was gathered or interpolated at each pixel, as `shaders/refinement.wgsl` describes it.
pub(crate) struct RefinementImages<A: Allocate = Device> {
    /// What the diffuse lobe reflects for k_d = 1, W/sr/m²; and the pixel's state.
    diffuse: A::Image,
    /// The same of the specular lobe for k_s = 1; only where some material is specular.
    specular: Option<A::Image>,
    /// Only where gathers have noise.
    sampling: Option<SamplingImages<A>>,
}

/// How pixels were sampled, as `shaders/sampling.wgsl` describes it.
struct SamplingImages<A: Allocate> {
    /// Over all samples of a pixel so far.
    sums_diffuse: A::Image,
    sums_specular: Option<A::Image>,
    /// Packets and variances.
    sampling: A::Image,
}

impl<A: Allocate> RefinementImages<A> {
    pub fn new(allocate: &A, plan: &Plan, is_noisy: bool) -> Result<RefinementImages<A>> {
        let image = |name| allocate.image(name, ImageShape::plain(plan.resolution_px));
        let specular = |name| plan.is_specular.then(|| image(name)).transpose();
        let sampling = || {
            Ok(SamplingImages {
                sums_diffuse: image("sums of diffuse light")?,
                sums_specular: specular("sums of specular light")?,
                sampling: image("sampling")?,
            })
        };
        Ok(RefinementImages {
            diffuse: image("gathered diffuse light")?,
            specular: specular("gathered specular light")?,
            sampling: is_noisy.then(sampling).transpose()?,
        })
    }
}

impl RefinementImages {
    /// Nothing is known but what was sampled.
    pub fn clear(&self, recorder: &mut Recorder) {
        RefinementImages::clear_all(recorder, self.specular.iter().chain([&self.diffuse]));
    }

    /// Nothing was sampled.
    pub fn clear_samples(&self, recorder: &mut Recorder) {
        if let Some(images) = &self.sampling {
            let sums = [&images.sums_diffuse, &images.sampling];
            RefinementImages::clear_all(recorder, images.sums_specular.iter().chain(sums));
        }
    }

    fn clear_all<'i>(recorder: &mut Recorder, images: impl Iterator<Item = &'i Image>) {
        for image in images {
            recorder.prepare_images(&[image]);
            recorder.clear_image(image);
        }
    }

    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![("gathered_diffuse", Resource::Image(&self.diffuse))];
        if let Some(specular) = &self.specular {
            resources.push(("gathered_specular", Resource::Image(specular)));
        }
        if let Some(images) = &self.sampling {
            resources.push(("sums_diffuse", Resource::Image(&images.sums_diffuse)));
            resources.push(("sampling", Resource::Image(&images.sampling)));
            let specular = images.sums_specular.iter();
            resources.extend(specular.map(|image| ("sums_specular", Resource::Image(image))));
        }
        resources
    }

    /// The word of the kernel that fills them.
    pub fn noise_word(&self) -> &'static str {
        match self.sampling {
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
    pub noise: GatherNoise,
    pub allocation: SampleAllocation,
}

/// The noise of gathers; all 0 where there is none.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct GatherNoise {
    /// Variance of one packet of samples over that of as many at random.
    pub evenness: f64,
    /// The variance falls with this power of the packets.
    pub rate: f64,
    /// Standard deviation over the radiance, of the whole image.
    pub relative: f64,
}

/// How samples are handed out to pixels, whose variance is that of a sample over the square of the radiance that errors count over.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SampleAllocation {
    /// A pixel has this times the power of its variance, in packets.
    pub packets_scale: f64,
    pub variance_power: f64,
    pub max_packets: u32,
    /// Of a pixel of which nothing is known.
    pub mean_variance: f64,
    /// Over the square of the pixel's own radiance.
    pub least_variance: f64,
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
