//! Sensor pass: computes the energy on each pixel during the exposure.

use super::Context;
use crate::{
    Result,
    vulkan::{
        Image, Resource,
        shaders::{Key, Seen, SensorParameters},
    },
};

/// The factor, the input images and the output image of the sum.
pub(crate) struct Exposure<'e> {
    /// What a pixel gets, over its radiance along the axis.
    pub factor: f64,
    /// Where the pixels look; only behind an aperture. What shows it, the image's name in the kernel, and the image.
    pub seen: Option<(Seen, &'static str, &'e Image)>,
    pub direct: &'e Image,
    pub indirect: Option<&'e Image>,
    pub emission: Option<&'e Image>,
    pub sum: &'e Image,
}

/// Computes sum = (direct + indirect + emission) · factor; behind an aperture, also times cos⁴ of the angle to the axis.
pub(crate) fn expose(context: &Context, exposure: &Exposure) -> Result<()> {
    let Exposure {
        factor,
        seen,
        direct,
        indirect,
        emission,
        sum,
    } = *exposure;
    let key = Key::Sensor {
        indirect: indirect.is_some(),
        emissive: emission.is_some(),
        seen: seen.map(|(seen, ..)| seen),
    };
    let mut resources = vec![
        ("direct_radiance", Resource::Image(direct)),
        ("energy", Resource::Image(sum)),
    ];
    resources.extend(indirect.map(|image| ("indirect_radiance", Resource::Image(image))));
    resources.extend(emission.map(|image| ("emission", Resource::Image(image))));
    resources.extend(seen.map(|(_, name, image)| (name, Resource::Image(image))));
    let forward = context.scene.camera.basis().forward;
    let parameters = SensorParameters {
        camera_position: context.camera_position(),
        joule_per_radiance: factor as f32,
        forward: forward.as_vec3().to_array(),
        ..SensorParameters::default()
    };
    context.prepare_images(&[sum])?;
    let size = context.plan.resolution_px;
    context.dispatch(key, &resources, &parameters, size)
}
