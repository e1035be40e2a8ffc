//! The images that a frame ends with.

use crate::{
    Result,
    passes::{Context, gbuffer::GBuffer},
    vulkan::{Image, ImageShape},
};

/// Of the camera's size.
pub(crate) struct FrameImages {
    pub key: FrameImagesKey,
    pub gbuffer: GBuffer,
    pub direct: Image,
    /// With indirect light.
    pub indirect: Option<Image>,
    /// With a sensor.
    pub energy: Option<Image>,
    /// Direct and indirect together: for a host alone.
    pub radiance: Option<Image>,
}

/// Which images there are, and how large.
#[derive(Clone, PartialEq)]
pub(crate) struct FrameImagesKey {
    resolution_px: [u32; 2],
    is_specular: bool,
    has_indirect: bool,
    has_energy: bool,
    has_radiance: bool,
}

impl FrameImagesKey {
    pub fn new(context: &Context) -> FrameImagesKey {
        let plan = context.plan;
        FrameImagesKey {
            resolution_px: plan.resolution_px,
            is_specular: plan.is_specular,
            has_indirect: plan.indirect.is_some(),
            has_energy: plan.joule_per_irradiance.is_some(),
            has_radiance: context.stays_on_device,
        }
    }
}

impl FrameImages {
    /// Images without contents.
    pub fn new(context: &Context) -> Result<FrameImages> {
        let key = FrameImagesKey::new(context);
        let shape = ImageShape::plain(key.resolution_px);
        let image = |what| Image::new(context.device, what, shape);
        Ok(FrameImages {
            gbuffer: GBuffer::new(context.device, context.plan)?,
            direct: image("direct radiance")?,
            indirect: key
                .has_indirect
                .then(|| image("indirect radiance"))
                .transpose()?,
            energy: key.has_energy.then(|| image("energy")).transpose()?,
            radiance: key.has_radiance.then(|| image("radiance")).transpose()?,
            key,
        })
    }

    /// Those to which light after light is added.
    pub fn sums(&self) -> impl Iterator<Item = &Image> {
        [&self.direct].into_iter().chain(&self.indirect)
    }
}
