//! RSM pass: the reflective shadow map (Dachsbacher & Stamminger 2005) of a light.

use super::{
    Context,
    light::DeviceLight,
    surface::{Drawn, Surfaces},
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{Allocate, Device, Image, ImageShape, Resource, Target, shaders::Key},
};

/// A pixel of a position image that shows no surface.
pub(crate) const NO_SURFACE: [f32; 4] = [0.0, 0.0, 0.0, -1.0];

/// Images with one layer per face of the light.
pub(crate) struct Rsm<A: Allocate = Device> {
    /// Q, local; its triangle.
    pub position: A::Image,
    /// n_Q; the geometric normal, packed.
    pub normal: A::Image,
    /// k_d; L_{L→Q} over the light's axial intensity.
    pub kd_irradiance: A::Image,
    /// As [`Lobe::texel`](crate::model::Lobe::texel). Only if some material is specular.
    pub lobe_parameters: Option<A::Image>,
    depth: A::Image,
}

impl<A: Allocate> Rsm<A> {
    /// Room for the light with the most faces; the others use the first layers. `None` if nothing reads an RSM.
    pub fn for_plan(allocate: &A, plan: &Plan) -> Result<Option<Rsm<A>>> {
        let Some(rsm_size) = plan.rsm_size() else {
            return Ok(None);
        };
        let shape = ImageShape::plain([rsm_size; 2]).with_layers(plan.max_faces());
        let image = |name| allocate.image(name, shape);
        Ok(Some(Rsm {
            position: image("RSM positions")?,
            normal: image("RSM normals")?,
            kd_irradiance: image("RSM k_d and irradiance")?,
            lobe_parameters: allocate.image_if("RSM lobes", plan.is_specular.then_some(shape))?,
            depth: allocate.image("RSM depth", shape.depth())?,
        }))
    }
}

impl Rsm {
    /// All images except the depth, with their names in the shaders.
    fn images(&self) -> impl Iterator<Item = (&'static str, &Image)> {
        let images = [
            ("rsm_position", &self.position),
            ("rsm_normal", &self.normal),
            ("rsm_kd_irradiance", &self.kd_irradiance),
        ];
        let lobe_parameters = self.lobe_parameters.as_ref();
        images
            .into_iter()
            .chain(lobe_parameters.map(|image| ("rsm_lobe_parameters", image)))
    }

    pub fn colors(&self) -> Vec<&Image> {
        self.images().map(|(_, image)| image).collect()
    }

    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let resource = |(name, image)| (name, Resource::Image(image));
        self.images().map(resource).collect()
    }
}

/// Draws the surfaces as seen through each of the light's faces.
pub(crate) fn draw(
    context: &Context,
    surfaces: &Surfaces,
    light: &DeviceLight,
    rsm: &Rsm,
) -> Result<()> {
    let colors = rsm.colors();
    context.prepare_images(&colors)?;
    context.prepare_images(&[&rsm.depth])?;
    let brdf = context.plan.brdf();
    let key = |drawn: Drawn| Key::Rsm {
        brdf,
        surface: drawn.surface,
        cutout: drawn.cutout,
    };
    let emission = [("emission", Resource::Buffer(&light.emission))];
    context.pass("rsm", |recorder| {
        for (layer, view) in light.rsm_views.iter().enumerate() {
            let target = Target {
                colors: &colors,
                depth: &rsm.depth,
                layer: layer as u32,
                clear: &[NO_SURFACE, [0.0; 4], [0.0; 4], [0.0; 4]],
            };
            surfaces.draw(recorder, context, key, &target, view, &emission)?;
        }
        Ok(())
    })
}
