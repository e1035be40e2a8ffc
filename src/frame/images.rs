//! The images that hold the result of a frame.

use crate::{
    Result,
    passes::{
        Context, area_light::AreaLightImages, direct::DirectImages, gbuffer::GBuffer,
        pixel_filter::PixelSample, refinement::gathered_shape,
    },
    plan::{Plan, TofPlan},
    vulkan::{Allocate, Device, ImageShape, Recorder},
};

/// The images of a frame, at the camera's resolution.
pub(crate) struct FrameImages<A: Allocate = Device> {
    pub key: FrameImagesKey,
    pub gbuffer: GBuffer<A>,
    pub direct: A::Image,
    /// Z of the direct light, with two frequencies per layer; only with time of flight. Without pixel samples it lacks the path to C.
    pub direct_phasors: Option<A::Image>,
    /// What surfaces emit to the camera; only if some do.
    pub emission: Option<A::Image>,
    /// Only with indirect light.
    pub indirect: Option<A::Image>,
    /// As `direct_phasors`; only with time of flight of the bounce.
    pub indirect_phasors: Option<A::Image>,
    /// Standard error of `indirect` per band, W/sr/m²; only if requested.
    pub indirect_stderr: Option<A::Image>,
    /// Only if pixels are averaged over their area.
    pub sampled: Option<SampledImages<A>>,
    /// Only with a sensor.
    pub energy: Option<A::Image>,
    /// Direct, indirect and emission together; only for a host that uses it on the device.
    pub radiance: Option<A::Image>,
    /// Only if lights have an area.
    pub area_light: Option<AreaLightImages<A>>,
}

/// What averaging over pixels needs. A frame's other images then hold the means, except the G-buffer, which shows pixel centres.
pub(crate) struct SampledImages<A: Allocate = Device> {
    /// What one sample of each pixel shows.
    pub gbuffer: GBuffer<A>,
    /// As the pixel_filter pass fills it; depths in local units.
    pub footprint: A::Image,
    /// Only with indirect light: its radiance at the pixels' centres, what their lobes reflect for k_d = k_s = 1, and its phasors.
    pub centre_indirect: Option<A::Image>,
    pub gathered: Option<A::Image>,
    pub centre_phasors: Option<A::Image>,
}

impl SampledImages {
    /// All samples of a pixel. Each is drawn to the same G-buffer.
    pub fn samples<'s>(&'s self, context: &Context) -> impl Iterator<Item = PixelSample<'s>> {
        let sampling = context.plan.pixel_sampling;
        let offsets_px = sampling.map_or_else(Vec::new, |sampling| sampling.offsets_px());
        let share = (offsets_px.len() as f64).recip();
        offsets_px.into_iter().map(move |offset_px| PixelSample {
            offset_px,
            share,
            gbuffer: &self.gbuffer,
        })
    }
}

impl<A: Allocate> SampledImages<A> {
    fn new(allocate: &A, plan: &Plan) -> Result<SampledImages<A>> {
        let shape = ImageShape::plain(plan.resolution_px);
        let indirect = plan.indirect.map(|_| shape);
        let gathered = plan.indirect.map(|_| gathered_shape(plan));
        let phasors = plan.bounced_tof();
        let phasors = phasors.map(|tof| shape.with_layers(tof.pair_count()));
        Ok(SampledImages {
            gbuffer: GBuffer::new(allocate, plan, false)?,
            footprint: allocate.image("footprints of pixels", shape)?,
            centre_indirect: allocate.image_if("indirect radiance of centres", indirect)?,
            gathered: allocate.image_if("gathered light of centres", gathered)?,
            centre_phasors: allocate.image_if("indirect phasors of centres", phasors)?,
        })
    }
}

/// Which images there are, and their sizes.
#[derive(Clone, PartialEq)]
pub(crate) struct FrameImagesKey {
    resolution_px: [u32; 2],
    is_specular: bool,
    pub is_seen_by_rays: bool,
    has_triangles: bool,
    direct_phasor_layers: Option<u32>,
    indirect_phasor_layers: Option<u32>,
    has_emission: bool,
    has_indirect: bool,
    has_indirect_stderr: bool,
    has_energy: bool,
    has_radiance: bool,
    has_area_light: bool,
    is_sampled: bool,
    /// Shape of the image of gathered light; used with `is_sampled`.
    gathered_shape: ImageShape,
}

impl FrameImagesKey {
    /// `has_triangles`: with the image for layers that name them.
    pub fn new(plan: &Plan, stays_on_device: bool, has_triangles: bool) -> FrameImagesKey {
        FrameImagesKey {
            resolution_px: plan.resolution_px,
            is_specular: plan.is_specular,
            is_seen_by_rays: plan.has_primary_rays,
            has_triangles,
            direct_phasor_layers: plan.tof.map(TofPlan::pair_count),
            indirect_phasor_layers: plan.bounced_tof().map(TofPlan::pair_count),
            has_emission: plan.is_emissive,
            has_indirect: plan.indirect.is_some(),
            has_indirect_stderr: plan.has_stderr_layer(),
            has_energy: plan.joule_per_irradiance.is_some(),
            has_radiance: stays_on_device,
            has_area_light: plan.target_area_light_error.is_some(),
            is_sampled: plan.pixel_sampling.is_some(),
            gathered_shape: gathered_shape(plan),
        }
    }
}

impl<A: Allocate> FrameImages<A> {
    /// Allocates images without contents.
    pub fn new(allocate: &A, plan: &Plan, key: FrameImagesKey) -> Result<FrameImages<A>> {
        let shape = ImageShape::plain(key.resolution_px);
        let image_if = |name, is_needed: bool| allocate.image_if(name, is_needed.then_some(shape));
        let phasors = |name, layers: Option<u32>| {
            allocate.image_if(name, layers.map(|layers| shape.with_layers(layers)))
        };
        let sampled = || SampledImages::new(allocate, plan);
        Ok(FrameImages {
            gbuffer: GBuffer::new(allocate, plan, key.has_triangles)?,
            direct: allocate.image("direct radiance", shape)?,
            direct_phasors: phasors("direct phasors", key.direct_phasor_layers)?,
            indirect_phasors: phasors("indirect phasors", key.indirect_phasor_layers)?,
            emission: image_if("emission", key.has_emission)?,
            indirect: image_if("indirect radiance", key.has_indirect)?,
            indirect_stderr: image_if(
                "standard error of indirect radiance",
                key.has_indirect_stderr,
            )?,
            energy: image_if("energy", key.has_energy)?,
            sampled: key.is_sampled.then(sampled).transpose()?,
            radiance: image_if("radiance", key.has_radiance)?,
            area_light: AreaLightImages::for_plan(allocate, plan)?,
            key,
        })
    }
}

impl FrameImages {
    /// The images to which direct light is added.
    pub fn direct_images(&self) -> DirectImages<'_> {
        DirectImages {
            radiance: &self.direct,
            phasors: self.direct_phasors.as_ref(),
        }
    }

    /// Clears the images to zero. Lights are then added one after the other; zeros stay where there is nothing to gather.
    pub fn record_clears(&self, recorder: &mut Recorder) {
        let others = self.indirect.iter().chain(&self.indirect_stderr);
        let others = others.chain(&self.indirect_phasors);
        let sampled = self.sampled.iter();
        let sampled = sampled.flat_map(|images| {
            let of_centres = images.centre_indirect.iter().chain(&images.gathered);
            of_centres
                .chain(&images.centre_phasors)
                .chain([&images.footprint])
        });
        let area_light = self.area_light.iter().flat_map(|sums| sums.images());
        let others = others.chain(sampled).chain(area_light);
        let direct = [&self.direct].into_iter().chain(&self.direct_phasors);
        let direct = direct.chain(&self.emission);
        for image in others.chain(direct) {
            recorder.clear_image(image);
        }
    }
}
