//! Sensor pass: computes the energy on each pixel during the exposure.

use super::Context;
use crate::{
    Result,
    scene::{Intrinsics, Shared, VignettingMap},
    vulkan::{
        Buffer, Image, Resource,
        shaders::{Falloff, Key, SensorParameters},
    },
};

/// The factor, the input images and the output image of the sum.
pub(crate) struct Exposure<'e> {
    /// What a pixel gets, over its radiance along the axis.
    pub factor: f64,
    /// How light off the axis is weaker; only behind an aperture. If an image shows it: the image's name in the kernel, and the image.
    pub falloff: Option<(Falloff, Option<(&'static str, &'e Image)>)>,
    pub direct: &'e Image,
    pub indirect: Option<&'e Image>,
    pub emission: Option<&'e Image>,
    pub sum: &'e Image,
}

/// Computes sum = (direct + indirect + emission) · factor; behind an aperture, also times the falloff.
pub(crate) fn expose(context: &Context, exposure: &Exposure) -> Result<()> {
    let Exposure {
        factor,
        falloff,
        direct,
        indirect,
        emission,
        sum,
    } = *exposure;
    let key = Key::Sensor {
        indirect: indirect.is_some(),
        emissive: emission.is_some(),
        falloff: falloff.map(|(falloff, _)| falloff),
    };
    let mut resources = vec![
        ("direct_radiance", Resource::Image(direct)),
        ("energy", Resource::Image(sum)),
    ];
    resources.extend(indirect.map(|image| ("indirect_radiance", Resource::Image(image))));
    resources.extend(emission.map(|image| ("emission", Resource::Image(image))));
    let shown = falloff.and_then(|(_, shown)| shown);
    resources.extend(shown.map(|(name, image)| (name, Resource::Image(image))));
    let map = context.scene.vignetting_map.as_ref();
    let map = map.filter(|_| matches!(falloff, Some((Falloff::Mapped, _))));
    let upload =
        |map: &Shared<VignettingMap>| Buffer::upload(context.device, "vignetting map", &map.values);
    let texels = map.map(upload).transpose()?;
    resources.extend(
        texels
            .iter()
            .map(|texels| ("vignetting_map", Resource::Buffer(texels))),
    );
    let camera = &context.scene.camera;
    let Intrinsics { cx, cy, .. } = camera.intrinsics_px();
    let vignetting = context.scene.sensor.and_then(|sensor| sensor.vignetting);
    let parameters = SensorParameters {
        camera_position: context.camera_position(),
        joule_per_radiance: factor as f32,
        forward: camera.basis().forward.as_vec3().to_array(),
        per_half_diagonal: (1.0 / camera.half_diagonal_px()) as f32,
        vignetting: vignetting.unwrap_or_default().0.map(|k| k as f32),
        principal_point: [cx, cy].map(|place| place as f32),
        map_size: map.map_or([0; 2], |map| map.size_px),
        ..SensorParameters::default()
    };
    context.prepare_images(&[sum])?;
    let size = context.plan.resolution_px;
    context.dispatch(key, &resources, &parameters, size)
}
