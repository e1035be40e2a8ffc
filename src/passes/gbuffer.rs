//! G-buffer pass: what the camera sees at each pixel's centre.

use super::{
    Context,
    surface::{RasterPass, Surfaces},
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{Allocate, Buffer, Device, Image, ImageShape, Recorder, Resource, Target},
};

/// Images of the camera's size.
pub(crate) struct GBuffer<A: Allocate = Device> {
    /// P, local; mesh id (0: no surface).
    pub position_mesh: A::Image,
    /// n_P; the geometric normal, packed.
    pub normal_geometric: A::Image,
    /// k_d; material id.
    pub kd_material: A::Image,
    /// k_s; s. Only where some material is specular.
    pub ks_shininess: Option<A::Image>,
    depth: A::Image,
}

impl<A: Allocate> GBuffer<A> {
    pub fn new(allocate: &A, plan: &Plan) -> Result<GBuffer<A>> {
        let shape = ImageShape::plain(plan.resolution_px);
        let image = |name| allocate.image(name, shape);
        Ok(GBuffer {
            position_mesh: image("G-buffer positions")?,
            normal_geometric: image("G-buffer normals")?,
            kd_material: image("G-buffer k_d")?,
            ks_shininess: plan
                .is_specular
                .then(|| image("G-buffer k_s"))
                .transpose()?,
            depth: allocate.image("G-buffer depth", shape.depth())?,
        })
    }
}

impl GBuffer {
    /// All but the depth.
    pub fn colors(&self) -> Vec<&Image> {
        let images = [
            &self.position_mesh,
            &self.normal_geometric,
            &self.kd_material,
        ];
        images.into_iter().chain(&self.ks_shininess).collect()
    }

    /// The images under the names that the shaders give them.
    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![
            ("position_mesh", Resource::Image(&self.position_mesh)),
            ("normal_geometric", Resource::Image(&self.normal_geometric)),
            ("kd_material", Resource::Image(&self.kd_material)),
        ];
        if let Some(image) = &self.ks_shininess {
            resources.push(("ks_shininess", Resource::Image(image)));
        }
        resources
    }
}

/// Fills the G-buffer with the surfaces as seen from `view`.
pub(crate) fn draw<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    surfaces: &'r Surfaces,
    view: &'r Buffer,
    gbuffer: &'r GBuffer,
) -> Result<()> {
    let colors = gbuffer.colors();
    recorder.prepare_images(&colors);
    recorder.prepare_images(&[&gbuffer.depth]);
    recorder.pass("gbuffer", |recorder| {
        let pass = RasterPass {
            name: "gbuffer",
            pipelines: context.pipelines,
            brdf: Some(context.plan.brdf_word()),
            color_count: colors.len(),
        };
        let target = Target {
            colors: &colors,
            depth: &gbuffer.depth,
            layer: 0,
            clear: &[[0.0; 4]; 4],
        };
        surfaces.draw(recorder, &pass, &target, view, &[])
    })
}
