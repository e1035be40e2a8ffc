//! Shadow pass: draws where a light's rays end, for lights whose RSM is missing or too coarse for the shadow test.

use super::{Context, light::DeviceLight, surface::Surfaces};
use crate::{
    Plan, Result,
    vulkan::{Allocate, Device, ImageShape, Target, shaders::Key},
};

/// Position and triangle of what the light sees, one layer per face of the light.
pub(crate) struct ShadowMap<A: Allocate = Device> {
    pub position: A::Image,
    depth: A::Image,
}

impl<A: Allocate> ShadowMap<A> {
    /// Room for the light with the most faces; `None` if RSMs or rays serve all lights.
    pub fn for_plan(allocate: &A, plan: &Plan) -> Result<Option<ShadowMap<A>>> {
        let Some(size) = plan.own_map_size() else {
            return Ok(None);
        };
        let shape = ImageShape::plain([size; 2]).with_layers(plan.max_faces());
        Ok(Some(ShadowMap {
            position: allocate.image("shadow map", shape)?,
            depth: allocate.image("shadow map depth", shape.depth())?,
        }))
    }
}

/// Draws the surfaces as seen through each of the light's faces.
pub(crate) fn draw(
    context: &Context,
    surfaces: &Surfaces,
    light: &DeviceLight,
    map: &ShadowMap,
) -> Result<()> {
    context.prepare_images(&[&map.position, &map.depth])?;
    context.pass("shadow", |recorder| {
        for (layer, view) in light.shadow_views.iter().enumerate() {
            let target = Target {
                colors: &[&map.position],
                depth: &map.depth,
                layer: layer as u32,
                clear: &[super::rsm::NO_SURFACE],
            };
            let key = |_| Key::Shadow {};
            surfaces.draw(recorder, context, key, &target, view, &[])?;
        }
        Ok(())
    })
}
