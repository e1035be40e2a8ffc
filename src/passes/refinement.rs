//! What the passes of the refinement share: the images they work on, and the criteria.

use crate::{
    Result,
    metrics::LOCAL_FLOOR,
    plan::Plan,
    vulkan::{Allocate, Buffer, Device, Image, ImageShape, Recorder, Resource},
};

/// What is known of each pixel.
pub(crate) struct RefinementImages<A: Allocate = Device> {
    /// What was gathered or interpolated, as `shaders/refinement.wgsl` describes it. The layer of the specular lobe is there where some
    /// material is specular.
    gathered: A::Image,
    /// How it was sampled, as `shaders/sampling.wgsl` describes it. Only where gathers have noise.
    samples: Option<A::Image>,
    /// With time of flight: the modulation, with the scales of errors that were found.
    pub modulation: Option<Buffer>,
}

/// That of what is gathered of each pixel.
pub(crate) fn gathered_shape(plan: &Plan) -> ImageShape {
    let lobes = 1 + u32::from(plan.is_specular);
    let phasors = match plan.bounced_tof() {
        Some(tof) => lobes * tof.pair_count() * tof.band_count,
        None => 0,
    };
    ImageShape {
        layers: Some(lobes + phasors),
        ..ImageShape::plain(plan.resolution_px)
    }
}

impl<A: Allocate> RefinementImages<A> {
    pub fn new(allocate: &A, plan: &Plan, is_noisy: bool) -> Result<RefinementImages<A>> {
        let lobes = 1 + u32::from(plan.is_specular);
        let image = |name, layers| {
            let shape = ImageShape {
                layers: Some(layers),
                ..ImageShape::plain(plan.resolution_px)
            };
            allocate.image(name, shape)
        };
        let gathered = gathered_shape(plan);
        let phasors = gathered.layer_count() - lobes;
        // Variances around, and squares.
        let of_phasor_samples = if phasors > 0 { 1 + lobes } else { 0 };
        let samples = || image("sums over samples", 1 + lobes + phasors + of_phasor_samples);
        Ok(RefinementImages {
            gathered: allocate.image("gathered light", gathered)?,
            samples: is_noisy.then(samples).transpose()?,
            modulation: None,
        })
    }
}

impl RefinementImages {
    /// Nothing is known but what was sampled.
    pub fn clear(&self, recorder: &mut Recorder) {
        recorder.prepare_images(&[&self.gathered]);
        recorder.clear_image(&self.gathered);
    }

    /// Keeps what was gathered for the pixel_filter pass.
    pub fn copy_gathered(&self, recorder: &mut Recorder, to: &Image) {
        recorder.copy_image(&self.gathered, to);
    }

    /// Nothing was sampled.
    pub fn clear_samples(&self, recorder: &mut Recorder) {
        if let Some(samples) = &self.samples {
            recorder.prepare_images(&[samples]);
            recorder.clear_image(samples);
        }
    }

    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let samples = self.samples.iter();
        let samples = samples.map(|image| ("samples", Resource::Image(image)));
        let gathered = ("gathered", Resource::Image(&self.gathered));
        let modulation = self.modulation.iter();
        let modulation = modulation.map(|buffer| ("modulation", Resource::Buffer(buffer)));
        samples.chain([gathered]).chain(modulation).collect()
    }

    /// The word of the kernel that fills them.
    pub fn noise_word(&self) -> &'static str {
        match self.samples {
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
