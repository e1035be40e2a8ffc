//! The images that a frame ends with.

use crate::{
    Result,
    passes::gbuffer::GBuffer,
    plan::{Plan, TofPlan},
    vulkan::{Allocate, Device, ImageShape, Recorder},
};

/// Of the camera's size.
pub(crate) struct FrameImages<A: Allocate = Device> {
    pub key: FrameImagesKey,
    pub gbuffer: GBuffer<A>,
    pub direct: A::Image,
    /// With time of flight: Z of the direct light but for the way to C, of two frequencies a layer.
    pub direct_phasors: Option<A::Image>,
    /// With indirect light.
    pub indirect: Option<A::Image>,
    /// With time of flight of the bounce: as `direct_phasors`.
    pub indirect_phasors: Option<A::Image>,
    /// Standard error of `indirect` per band, W/sr/m²; where it is wanted.
    pub indirect_stderr: Option<A::Image>,
    /// With a sensor.
    pub energy: Option<A::Image>,
    /// Direct and indirect together: for a host alone.
    pub radiance: Option<A::Image>,
}

/// Which images there are, and how large.
#[derive(Clone, PartialEq)]
pub(crate) struct FrameImagesKey {
    resolution_px: [u32; 2],
    is_specular: bool,
    is_seen_by_rays: bool,
    direct_phasor_layers: Option<u32>,
    indirect_phasor_layers: Option<u32>,
    has_indirect: bool,
    has_indirect_stderr: bool,
    has_energy: bool,
    has_radiance: bool,
}

impl FrameImagesKey {
    pub fn new(plan: &Plan, stays_on_device: bool) -> FrameImagesKey {
        FrameImagesKey {
            resolution_px: plan.resolution_px,
            is_specular: plan.is_specular,
            is_seen_by_rays: plan.primary_rays.is_some(),
            direct_phasor_layers: plan.tof.map(TofPlan::pair_count),
            indirect_phasor_layers: plan.bounced_tof().map(TofPlan::pair_count),
            has_indirect: plan.indirect.is_some(),
            has_indirect_stderr: plan.has_stderr_layer(),
            has_energy: plan.joule_per_irradiance.is_some(),
            has_radiance: stays_on_device,
        }
    }
}

impl<A: Allocate> FrameImages<A> {
    /// Images without contents.
    pub fn new(allocate: &A, plan: &Plan, key: FrameImagesKey) -> Result<FrameImages<A>> {
        let shape = ImageShape::plain(key.resolution_px);
        let image = |name| allocate.image(name, shape);
        let phasors = |name, layers: Option<u32>| {
            let shape = layers.map(|layers| ImageShape {
                layers: Some(layers),
                ..shape
            });
            shape.map(|shape| allocate.image(name, shape)).transpose()
        };
        Ok(FrameImages {
            gbuffer: GBuffer::new(allocate, plan)?,
            direct: image("direct radiance")?,
            direct_phasors: phasors("direct phasors", key.direct_phasor_layers)?,
            indirect_phasors: phasors("indirect phasors", key.indirect_phasor_layers)?,
            indirect: key
                .has_indirect
                .then(|| image("indirect radiance"))
                .transpose()?,
            indirect_stderr: key
                .has_indirect_stderr
                .then(|| image("standard error of indirect radiance"))
                .transpose()?,
            energy: key.has_energy.then(|| image("energy")).transpose()?,
            radiance: key.has_radiance.then(|| image("radiance")).transpose()?,
            key,
        })
    }
}

impl FrameImages {
    /// Zeros, to which light after light is added, and which stay where there is nothing to gather.
    pub fn record_clears(&self, recorder: &mut Recorder) {
        let others = self.indirect.iter().chain(&self.indirect_stderr);
        let others = others.chain(&self.indirect_phasors);
        let direct = [&self.direct].into_iter().chain(&self.direct_phasors);
        for image in others.chain(direct) {
            recorder.prepare_images(&[image]);
            recorder.clear_image(image);
        }
    }
}
