//! G-buffer pass: what the camera sees at each pixel's centre.

use super::{
    Context,
    surface::{Drawn, Surfaces},
};
use crate::{
    Error, Result,
    plan::{Plan, surface_axis},
    vulkan::{Allocate, Buffer, Device, Image, ImageShape, Resource, Target, shaders::Key},
};

/// The images of the G-buffer, at the camera's resolution.
pub(crate) struct GBuffer<A: Allocate = Device> {
    /// P, local; instance id (0: no surface).
    pub position_instance: A::Image,
    /// n_P; the geometric normal, packed.
    pub normal_geometric: A::Image,
    /// k_d; material id.
    pub kd_material: A::Image,
    /// As [`Lobe::texel`](crate::model::Lobe::texel). Only if some material is specular.
    pub lobe_parameters: Option<A::Image>,
    /// Which triangle each pixel shows, and where on it; only for the layers that need it. `frame/seen_triangles` reads it.
    pub triangles: Option<A::Image>,
    /// Only if the rasteriser fills the G-buffer.
    depth: Option<A::Image>,
}

impl<A: Allocate> GBuffer<A> {
    pub fn new(allocate: &A, plan: &Plan, has_triangles: bool) -> Result<GBuffer<A>> {
        let shape = ImageShape::plain(plan.resolution_px);
        let depth = (!plan.has_primary_rays).then(|| shape.depth());
        let image = |name| allocate.image(name, shape);
        Ok(GBuffer {
            position_instance: image("G-buffer positions")?,
            normal_geometric: image("G-buffer normals")?,
            kd_material: image("G-buffer k_d")?,
            lobe_parameters: allocate
                .image_if("G-buffer lobes", plan.is_specular.then_some(shape))?,
            triangles: allocate.image_if("G-buffer triangles", has_triangles.then_some(shape))?,
            depth: allocate.image_if("G-buffer depth", depth)?,
        })
    }
}

impl GBuffer {
    /// All images except triangles and depth, with their names in the shaders.
    fn images(&self) -> impl Iterator<Item = (&'static str, &Image)> {
        let images = [
            ("position_instance", &self.position_instance),
            ("normal_geometric", &self.normal_geometric),
            ("kd_material", &self.kd_material),
        ];
        let lobe_parameters = self.lobe_parameters.as_ref();
        images
            .into_iter()
            .chain(lobe_parameters.map(|image| ("lobe_parameters", image)))
    }

    pub fn colors(&self) -> Vec<&Image> {
        self.images().map(|(_, image)| image).collect()
    }

    /// What the pixels' centres show, except k_d, with the names used next to the images of samples.
    pub fn resources_of_centres(&self) -> Vec<(&'static str, Resource<'_>)> {
        let images = [
            ("centre_position_instance", Some(&self.position_instance)),
            ("centre_normal_geometric", Some(&self.normal_geometric)),
            ("centre_lobe_parameters", self.lobe_parameters.as_ref()),
        ];
        let resource = |(name, image): (_, Option<_>)| Some((name, Resource::Image(image?)));
        images.into_iter().filter_map(resource).collect()
    }

    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let resource = |(name, image)| (name, Resource::Image(image));
        self.images().map(resource).collect()
    }
}

/// Fills the G-buffer with the surfaces as seen from `view`.
pub(crate) fn draw(
    context: &Context,
    surfaces: &Surfaces,
    view: &Buffer,
    gbuffer: &GBuffer,
) -> Result<()> {
    let colors = gbuffer.colors();
    let depth = gbuffer.depth.as_ref();
    let depth = depth.ok_or_else(|| Error::internal("the G-buffer is for rays"))?;
    context.prepare_images(&colors)?;
    context.prepare_images(&[depth])?;
    let target = Target {
        colors: &colors,
        depth,
        layer: 0,
        clear: &[[0.0; 4]; 4],
    };
    let brdf = context.plan.brdf();
    let key = |drawn: Drawn| Key::Gbuffer {
        brdf,
        surface: drawn.surface,
        cutout: drawn.cutout,
        one_sided: drawn.one_sided,
    };
    context.pass("gbuffer", |recorder| {
        surfaces.draw(recorder, context, key, &target, view, &[])
    })?;
    // Once more, rather than into a fifth image: devices need not have more than four to draw to. The same triangles win.
    let Some(triangles) = &gbuffer.triangles else {
        return Ok(());
    };
    context.prepare_images(&[triangles])?;
    let target = Target {
        colors: &[triangles],
        ..target
    };
    let key = |drawn: Drawn| Key::GbufferTriangles {
        // What else the surface has does not matter here.
        surface: surface_axis(false, false, drawn.cutout),
        cutout: drawn.cutout,
        one_sided: drawn.one_sided,
    };
    context.pass("gbuffer", |recorder| {
        surfaces.draw(recorder, context, key, &target, view, &[])
    })
}
