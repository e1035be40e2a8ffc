//! Pixel filter pass: averages over each pixel what its samples show, one sample at a time.

use glam::DVec2;

use super::{
    Context,
    gbuffer::GBuffer,
    receivers::{ListedReceivers, Receivers},
    sample_counts::SampleCounts,
};
use crate::{
    Result,
    vulkan::{
        Buffer, Image, Resource,
        shaders::{Key, PixelFilterParameters},
    },
};

/// One sample of each pixel.
#[derive(Clone, Copy)]
pub(crate) struct PixelSample<'s> {
    /// Offset from the pixel's centre.
    pub offset_px: DVec2,
    /// Weight of the sample in its pixel.
    pub share: f64,
    /// What the sample shows.
    pub gbuffer: &'s GBuffer,
}

/// The images in which the bounce is averaged.
#[derive(Clone, Copy)]
pub(crate) struct FilteredImages<'i> {
    pub indirect: &'i Image,
    /// Only with time of flight of the bounce.
    pub phasors: Option<&'i Image>,
}

impl<'i> FilteredImages<'i> {
    fn resources(self, context: &'i Context) -> Vec<(&'static str, Resource<'i>)> {
        let mut resources = vec![("indirect_radiance", Resource::Image(self.indirect))];
        if let Some(phasors) = self.phasors {
            resources.push(("indirect_phasors", Resource::Image(phasors)));
            resources.extend(context.modulation());
        }
        resources
    }
}

impl PixelSample<'_> {
    fn parameters(&self, context: &Context) -> PixelFilterParameters {
        let forward = context.scene.camera.basis().forward;
        let step_px = (self.offset_px + 0.5).floor();
        PixelFilterParameters {
            camera_position: context.camera_position(),
            share: self.share as f32,
            forward: forward.as_vec3().to_array(),
            camera_turns: context.camera_turns(),
            step_px: step_px.as_vec2().to_array(),
            offset_px: (self.offset_px - step_px).as_vec2().to_array(),
            ..PixelFilterParameters::default()
        }
    }

    /// Adds the depth of the sample to the footprint.
    pub fn add_depth(&self, context: &Context, footprint: &Image) -> Result<()> {
        let resources = [
            (
                "position_instance",
                Resource::Image(&self.gbuffer.position_instance),
            ),
            ("footprint", Resource::Image(footprint)),
        ];
        // That of parallel rays, too, where depths begin.
        let camera_position = context.space.to_local(context.scene.camera.position_m);
        let parameters = PixelFilterParameters {
            camera_position,
            ..self.parameters(context)
        };
        let size_px = context.plan.resolution_px;
        context.dispatch(Key::PixelFilterDepths {}, &resources, &parameters, size_px)
    }

    /// Adds what a sample reflects of the light that was gathered at pixels' centres. If the sample shows a surface that no centre
    /// around it shows, its pixel becomes a candidate receiver.
    pub fn interpolate(
        &self,
        context: &Context,
        centres: &GBuffer,
        gathered: &Image,
        receivers: &Receivers,
        images: FilteredImages,
    ) -> Result<()> {
        let mut resources = self.gbuffer.resources();
        resources.extend(centres.resources_of_centres());
        resources.extend(images.resources(context));
        resources.extend([
            ("gathered", Resource::Image(gathered)),
            ("candidates", Resource::Buffer(&receivers.candidates)),
        ]);
        let plan = context.plan;
        let key = Key::PixelFilterInterpolate {
            phasors: plan.has_phasors(),
            brdf: plan.brdf(),
        };
        let parameters = self.parameters(context);
        context.dispatch(key, &resources, &parameters, plan.resolution_px)
    }

    /// Adds the first results, which belong to these receivers.
    pub fn add_gathered(
        &self,
        context: &Context,
        receivers: ListedReceivers,
        results: &Buffer,
        counts: Option<&SampleCounts>,
        images: FilteredImages,
    ) -> Result<()> {
        let mut resources = self.gbuffer.resources();
        resources.extend(images.resources(context));
        resources.extend([
            ("receivers", Resource::Buffer(&receivers.list.pixels)),
            ("results", Resource::Buffer(results)),
        ]);
        resources.extend(counts.map(|counts| ("sample_ranges", Resource::Buffer(&counts.ranges))));
        let plan = context.plan;
        let key = Key::PixelFilterGathered {
            phasors: plan.has_phasors(),
            brdf: plan.brdf(),
            noisy: counts.is_some(),
        };
        let range = receivers.range;
        let parameters = PixelFilterParameters {
            first_receiver: range.first,
            receiver_count: range.count,
            ..self.parameters(context)
        };
        context.dispatch(key, &resources, &parameters, [range.count, 1])
    }
}
