//! The images that a frame ends with.

use crate::{
    Result,
    passes::{Context, gbuffer::GBuffer},
    vulkan::{Image, ImageShape},
};

/// Of the camera's size.
pub(crate) struct FrameImages {
    made_for: Shape,
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
#[derive(PartialEq)]
struct Shape {
    resolution_px: [u32; 2],
    is_specular: bool,
    has_indirect: bool,
    has_energy: bool,
    has_radiance: bool,
}

impl Shape {
    fn of(context: &Context) -> Shape {
        let plan = context.plan;
        Shape {
            resolution_px: plan.resolution_px,
            is_specular: plan.is_specular,
            has_indirect: plan.indirect.is_some(),
            has_energy: plan.joule_per_irradiance.is_some(),
            has_radiance: context.stays_on_device,
        }
    }
}

impl FrameImages {
    /// Those of the frame before, where they fit.
    pub fn kept(images: Option<FrameImages>, context: &Context) -> Option<FrameImages> {
        images.filter(|images| images.made_for == Shape::of(context))
    }

    /// Images without contents.
    pub fn new(context: &Context) -> Result<FrameImages> {
        let made_for = Shape::of(context);
        let shape = ImageShape::plain(made_for.resolution_px);
        let image = |what| Image::new(context.device, what, shape);
        Ok(FrameImages {
            gbuffer: GBuffer::new(context.device, context.plan)?,
            direct: image("direct radiance")?,
            indirect: made_for
                .has_indirect
                .then(|| image("indirect radiance"))
                .transpose()?,
            energy: made_for.has_energy.then(|| image("energy")).transpose()?,
            radiance: made_for
                .has_radiance
                .then(|| image("radiance"))
                .transpose()?,
            made_for,
        })
    }

    /// Those to which light after light is added.
    pub fn sums(&self) -> impl Iterator<Item = &Image> {
        [&self.direct].into_iter().chain(&self.indirect)
    }
}
