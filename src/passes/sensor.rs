//! Sensor pass: energy on each pixel in the exposure.

use super::Context;
use crate::{
    Result,
    vulkan::{Image, Recorder, Resource, shaders::SensorParameters},
};

/// What is added up, and what for.
pub(crate) struct Exposure<'e> {
    /// Of what each pixel gets, over its radiance along the axis.
    pub factor: f64,
    /// Where the pixels look, for those behind an aperture: the kernel's word, and an image by its name there.
    pub seen: Option<(&'static str, &'static str, &'e Image)>,
    pub direct: &'e Image,
    pub indirect: Option<&'e Image>,
    pub sum: &'e Image,
}

/// sum = (direct + indirect) · factor, and behind an aperture cos⁴ of the angle to the axis.
pub(crate) fn expose(
    recorder: &mut Recorder,
    context: &Context,
    exposure: &Exposure,
) -> Result<()> {
    let Exposure {
        factor,
        seen,
        direct,
        indirect,
        sum,
    } = *exposure;
    let words = [
        indirect.map_or("", |_| "indirect"),
        seen.map_or("", |(word, ..)| word),
    ];
    let mut resources = vec![
        ("direct_radiance", Resource::Image(direct)),
        ("energy", Resource::Image(sum)),
    ];
    resources.extend(indirect.map(|image| ("indirect_radiance", Resource::Image(image))));
    resources.extend(seen.map(|(_, name, image)| (name, Resource::Image(image))));
    let forward = context.scene.camera.basis().forward;
    let parameters = SensorParameters {
        camera_position: context.camera_position(),
        joule_per_radiance: factor as f32,
        forward: forward.as_vec3().to_array(),
        ..SensorParameters::default()
    };
    recorder.prepare_images(&[sum]);
    let size = context.plan.resolution_px;
    context.dispatch(recorder, ("sensor", &words), &resources, &parameters, size)
}
