//! Shadow pass: where a light's rays end, for lights whose RSM is absent or too coarse for the shadow test.

use super::surface::{RasterPass, Surfaces};
use crate::{
    Result,
    vulkan::{Buffer, Device, Image, ImageShape, Pipelines, Recorder, Target},
};

/// Position and triangle of what the light sees, one layer per face of the light.
pub(crate) struct ShadowMap {
    pub position: Image,
    depth: Image,
}

impl ShadowMap {
    /// Room for the light with the most faces; the others use the first layers.
    pub fn new(device: &Device, size: u32, max_faces: u32) -> Result<ShadowMap> {
        let shape = ImageShape::layers(size, max_faces);
        Ok(ShadowMap {
            position: Image::new(device, "shadow map", shape)?,
            depth: Image::new(device, "shadow map depth", shape.depth())?,
        })
    }
}

/// Draws the surfaces as seen through each of the light's faces.
pub(crate) fn draw<'r>(
    recorder: &mut Recorder<'r>,
    pipelines: &Pipelines,
    surfaces: &'r Surfaces,
    faces: &'r [Buffer],
    map: &'r ShadowMap,
) -> Result<()> {
    recorder.prepare_images(&[&map.position, &map.depth]);
    recorder.pass("shadow", |recorder| {
        let pass = RasterPass {
            name: "shadow",
            pipelines,
            brdf: None,
            color_count: 1,
        };
        for (layer, view) in faces.iter().enumerate() {
            let target = Target {
                colors: &[&map.position],
                depth: &map.depth,
                layer: layer as u32,
                clear: &[super::rsm::NO_SURFACE],
            };
            surfaces.draw(recorder, &pass, &target, view, &[])?;
        }
        Ok(())
    })
}
