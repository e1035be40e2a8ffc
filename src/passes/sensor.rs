//! Sensor pass: energy on each pixel in the exposure.

use super::Context;
use crate::{
    Result,
    vulkan::{Image, Recorder, Resource, shaders::SensorParameters},
};

/// energy = (direct + indirect) · joule_per_irradiance.
pub(crate) fn expose(
    recorder: &mut Recorder,
    context: &Context,
    joule_per_irradiance: f64,
    direct: &Image,
    indirect: Option<&Image>,
    energy: &Image,
) -> Result<()> {
    let word = if indirect.is_some() { "indirect" } else { "" };
    let mut resources = vec![
        ("direct_radiance", Resource::Image(direct)),
        ("energy", Resource::Image(energy)),
    ];
    resources.extend(indirect.map(|image| ("indirect_radiance", Resource::Image(image))));
    let parameters = SensorParameters {
        joule_per_irradiance: joule_per_irradiance as f32,
    };
    recorder.prepare_images(&[energy]);
    let size = context.plan.resolution_px;
    context.dispatch(recorder, ("sensor", &[word]), &resources, &parameters, size)
}
