//! The images and the criteria that the passes of the refinement share.

use crate::{
    Result,
    metrics::LOCAL_FLOOR,
    plan::Plan,
    vulkan::{Allocate, Buffer, Device, Image, ImageShape, Recorder, Resource},
};

/// What is known of each pixel.
pub(crate) struct RefinementImages<A: Allocate = Device> {
    /// What was gathered or interpolated, as described in `shaders/shared/refinement.wgsl`. The layer of the specular lobe exists only if
    /// some material is specular.
    gathered: A::Image,
    /// How it was sampled, as described in `shaders/shared/sampling.wgsl`. Only if gathers have noise.
    samples: Option<A::Image>,
    /// The models of the smooth pass, in the layout of `gathered`. Only if gathers have noise.
    modelled: Option<A::Image>,
    /// What squared errors of Z are worth as such of light; only if the target is an error of range.
    pub range_weights: Option<A::Image>,
    /// The modulation, with the scales of errors that were found; only with time of flight.
    pub modulation: Option<Buffer>,
}

/// The shape of the image of gathered light.
pub(crate) fn gathered_shape(plan: &Plan) -> ImageShape {
    let lobes = 1 + u32::from(plan.is_specular);
    let phasors = match plan.bounced_tof() {
        Some(tof) => lobes * tof.pair_count() * tof.band_count,
        None => 0,
    };
    ImageShape::plain(plan.resolution_px).with_layers(lobes + phasors)
}

impl<A: Allocate> RefinementImages<A> {
    pub fn new(allocate: &A, plan: &Plan, is_noisy: bool) -> Result<RefinementImages<A>> {
        let lobes = 1 + u32::from(plan.is_specular);
        let plain = ImageShape::plain(plan.resolution_px);
        let gathered = gathered_shape(plan);
        let phasors = gathered.layer_count() - lobes;
        // One layer for the variances from the pixels around, and one per lobe for squares.
        let of_phasor_samples = if phasors > 0 { 1 + lobes } else { 0 };
        let samples = plain.with_layers(3 + lobes + phasors + of_phasor_samples);
        let has_weights = is_noisy && plan.target_range_error_m().is_some();
        Ok(RefinementImages {
            gathered: allocate.image("gathered light", gathered)?,
            samples: allocate.image_if("sums over samples", is_noisy.then_some(samples))?,
            modelled: allocate
                .image_if("models of gathered light", is_noisy.then_some(gathered))?,
            range_weights: allocate.image_if("range weights", has_weights.then_some(plain))?,
            modulation: None,
        })
    }
}

impl RefinementImages {
    /// Clears what is known of the pixels, except how they were sampled.
    pub fn clear(&self, recorder: &mut Recorder) {
        recorder.clear_image(&self.gathered);
    }

    /// Copies what was gathered, for the pixel_filter pass.
    pub fn copy_gathered(&self, recorder: &mut Recorder, to: &Image) {
        recorder.copy_image(&self.gathered, to);
    }

    /// Clears how the pixels were sampled.
    pub fn clear_samples(&self, recorder: &mut Recorder) {
        if let (Some(samples), Some(modelled)) = (&self.samples, &self.modelled) {
            recorder.prepare_images(&[modelled]);
            recorder.clear_image(samples);
        }
        if let Some(weights) = &self.range_weights {
            recorder.clear_image(weights);
        }
    }

    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let samples = [
            ("samples", &self.samples),
            ("modelled", &self.modelled),
            ("range_weights", &self.range_weights),
        ];
        let samples = samples
            .into_iter()
            .filter_map(|(name, image)| Some((name, Resource::Image(image.as_ref()?))));
        let gathered = ("gathered", Resource::Image(&self.gathered));
        let modulation = self.modulation.iter();
        let modulation = modulation.map(|buffer| ("modulation", Resource::Buffer(buffer)));
        samples.chain([gathered]).chain(modulation).collect()
    }

    /// Whether the target is an error of range.
    pub fn has_range(&self) -> bool {
        self.range_weights.is_some()
    }

    /// Whether gathers have noise.
    pub fn is_noisy(&self) -> bool {
        self.samples.is_some()
    }
}

/// When a pixel may be interpolated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RefinementCriteria {
    /// Radiance of the image, W/sr/m². Errors are relative to it.
    pub radiance: f64,
    /// Errors are relative to the pixel's own radiance instead, unless that is far below the image's.
    pub is_local: bool,
    /// The error that an interpolated pixel may have; `None`: no pixel is interpolated.
    pub tolerance: Option<f64>,
    pub noise: GatherNoise,
    pub allocation: SampleAllocation,
    /// For the gathers that the image is compared with, which are not smoothed.
    pub allocation_of_estimate: SampleAllocation,
}

/// The noise of gathers; all 0 if there is none.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct GatherNoise {
    /// Variance of one packet of samples over that of the same number of random samples.
    pub evenness: f64,
    /// The variance falls with this power of the number of packets.
    pub rate: f64,
    /// Standard deviation over the radiance, for the whole image.
    pub relative: f64,
}

/// How samples are distributed to pixels. The variance of a pixel is that of one sample, over the square of the radiance that errors
/// are relative to.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SampleAllocation {
    /// A pixel without a model takes this many packets times a power of its variance.
    pub packets_scale: f64,
    /// The variance falls with this power of the packets.
    pub variance_rate: f64,
    /// Variance of one packet over that of a sample.
    pub packet_variance: f64,
    pub max_packets: u32,
    /// Variance of a pixel of which nothing is known.
    pub mean_variance: f64,
    /// Least variance, over the square of the pixel's own radiance.
    pub least_variance: f64,
}

impl SampleAllocation {
    /// Packets of a pixel of which nothing is known, as in `shaders/sample_counts.wgsl`.
    pub fn packets_of_unknown(&self) -> u32 {
        let power = 1.0 / (1.0 + self.variance_rate);
        let packets = self.packets_scale * self.mean_variance.powf(power);
        (packets.ceil() as u32).min(self.max_packets).max(1)
    }
}

/// Largest tolerance of criteria that are relaxed. A little more, and every pixel would be interpolated.
const MAX_RELAXED: f64 = 0.9;

impl RefinementCriteria {
    /// With this many times the tolerance, and a part of the samples.
    pub fn relaxed(mut self, factor: f64) -> RefinementCriteria {
        self.allocation.packets_scale /= factor;
        let relaxed = |tolerance: f64| tolerance.max((factor * tolerance).min(MAX_RELAXED));
        self.tolerance = self.tolerance.map(relaxed);
        self
    }

    /// Pixels without samples are interpolated, the others take no more.
    pub fn without_rays(mut self) -> RefinementCriteria {
        self.allocation.packets_scale = 0.0;
        self.tolerance = Some(f64::INFINITY);
        self
    }
    /// Least radiance that errors are relative to, W/sr/m².
    pub fn least_radiance(&self) -> f32 {
        let share = if self.is_local { LOCAL_FLOOR } else { 1.0 };
        (share * self.radiance) as f32
    }

    /// 1 if errors are relative to the pixel's own radiance, else 0.
    pub fn own_share(&self) -> f32 {
        if self.is_local { 1.0 } else { 0.0 }
    }
}
