//! RSM pass: the reflective shadow map (Dachsbacher & Stamminger 2005) of a light.

use super::{
    Context,
    light::DeviceLight,
    surface::{RasterPass, Surfaces},
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{Allocate, Device, Image, ImageShape, Recorder, Resource, Target},
};

/// A position image's pixel that shows no surface.
pub(crate) const NO_SURFACE: [f32; 4] = [0.0, 0.0, 0.0, -1.0];

/// Images with one layer per face of the light.
pub(crate) struct Rsm<A: Allocate = Device> {
    /// Q, local; its triangle.
    pub position: A::Image,
    /// n_Q; the geometric normal, packed.
    pub normal: A::Image,
    /// k_d; L_{L→Q} over the light's axial intensity.
    pub kd_irradiance: A::Image,
    /// k_s; s. Only where some material is specular.
    pub ks_shininess: Option<A::Image>,
    depth: A::Image,
}

impl<A: Allocate> Rsm<A> {
    /// Room for the light with the most faces; the others use the first layers. `None` without indirect light.
    pub fn for_plan(allocate: &A, plan: &Plan) -> Result<Option<Rsm<A>>> {
        let Some(indirect) = plan.indirect else {
            return Ok(None);
        };
        let shape = ImageShape::layers(indirect.rsm_size, plan.max_faces());
        let image = |name| allocate.image(name, shape);
        Ok(Some(Rsm {
            position: image("RSM positions")?,
            normal: image("RSM normals")?,
            kd_irradiance: image("RSM k_d and irradiance")?,
            ks_shininess: plan.is_specular.then(|| image("RSM k_s")).transpose()?,
            depth: allocate.image("RSM depth", shape.depth())?,
        }))
    }
}

impl Rsm {
    pub fn colors(&self) -> Vec<&Image> {
        let images = [&self.position, &self.normal, &self.kd_irradiance];
        images.into_iter().chain(&self.ks_shininess).collect()
    }

    /// The images under the names that the shaders give them.
    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![
            ("rsm_position", Resource::Image(&self.position)),
            ("rsm_normal", Resource::Image(&self.normal)),
            ("rsm_kd_irradiance", Resource::Image(&self.kd_irradiance)),
        ];
        if let Some(image) = &self.ks_shininess {
            resources.push(("rsm_ks_shininess", Resource::Image(image)));
        }
        resources
    }
}

/// Draws the surfaces as seen through each of the light's faces.
pub(crate) fn draw<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    surfaces: &'r Surfaces,
    light: &'r DeviceLight,
    rsm: &'r Rsm,
) -> Result<()> {
    let colors = rsm.colors();
    recorder.prepare_images(&colors);
    recorder.prepare_images(&[&rsm.depth]);
    recorder.pass("rsm", |recorder| {
        let pass = RasterPass {
            name: "rsm",
            pipelines: context.pipelines,
            brdf: Some(context.plan.brdf_word()),
            color_count: colors.len(),
        };
        for (layer, view) in light.rsm_views.iter().enumerate() {
            let target = Target {
                colors: &colors,
                depth: &rsm.depth,
                layer: layer as u32,
                clear: &[NO_SURFACE, [0.0; 4], [0.0; 4], [0.0; 4]],
            };
            let emission = ("emission", Resource::Buffer(&light.emission));
            surfaces.draw(recorder, &pass, &target, view, &[emission])?;
        }
        Ok(())
    })
}
