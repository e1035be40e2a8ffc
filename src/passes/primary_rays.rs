//! Primary rays pass: fills the G-buffer like the gbuffer pass, but with rays through the pixels' centres.

use std::sync::Arc;

use glam::DVec2;

use super::{Context, gbuffer::GBuffer, hits::HitSurfaces, rays::RayTriangles};
use crate::{
    Error, RayKernel, Result,
    output::per_pixel,
    plan::Plan,
    scene::Camera,
    vulkan::{
        Allocate, Buffer, BufferUse, CommandPool, Recorder, Resource, shaders::PrimaryRayParameters,
    },
};

/// Declares the memory for the lens of a plan.
pub(crate) fn declare(allocate: &impl Allocate, plan: &Plan) -> Result<()> {
    if plan.has_distortion {
        let pixels: u64 = plan.resolution_px.map(u64::from).iter().product();
        let bytes = pixels * size_of::<[f32; 4]>() as u64;
        allocate.buffer("rays of the lens", bytes, BufferUse::Device)?;
        allocate.buffer("rays of the lens", bytes, BufferUse::Staging)?;
    }
    Ok(())
}

/// Uploads the direction of the ray through each pixel's centre, in the camera's axes and the shader's order: Z, X, Y.
pub(crate) fn upload_lens(commands: &CommandPool, camera: &Camera) -> Result<Arc<Buffer>> {
    let [width, height] = camera.resolution_px.map(|size| size as usize);
    let mut rays = vec![0.0; 4 * width * height];
    per_pixel(&mut rays, |i| {
        let [x_px, y_px] = [i % width, i / width].map(|place| place as f64 + 0.5);
        let direction = camera.unproject(x_px, y_px).unwrap_or_default();
        [direction.z, direction.x, direction.y, 0.0].map(|value| value as f32)
    });
    commands.upload("rays of the lens", &rays)
}

/// Fills the G-buffer with the surfaces as seen from `view`, through points at `offset_px` from the pixels' centres.
pub(crate) fn draw(
    recorder: &mut Recorder,
    context: &Context,
    kernel: RayKernel,
    (tree, surfaces): (&RayTriangles, &HitSurfaces),
    (view, lens, offset_px): (&Buffer, Option<&Buffer>, DVec2),
    gbuffer: &GBuffer,
) -> Result<()> {
    let (plan, pipelines) = (context.plan, context.pipelines);
    let seen = gbuffer.seen_triangles.as_ref();
    let seen = seen.ok_or_else(|| Error::internal("the G-buffer is not for rays"))?;
    let lens_word = if plan.has_distortion { "lens" } else { "" };
    let trace_words = ["trace", lens_word, kernel.name(), tree.kernel_word()];
    let trace = pipelines.compute("primary_rays", &trace_words)?;
    let [shading, textured] = plan.shading_words();
    let shade = pipelines.compute(
        "primary_rays",
        &["shade", lens_word, plan.brdf_word(), shading, textured],
    )?;
    let mut resources = vec![
        ("view", Resource::Buffer(view)),
        ("seen_triangles", Resource::Buffer(seen)),
    ];
    resources.extend(lens.map(|lens| ("lens_rays", Resource::Buffer(lens))));
    resources.extend(tree.resources());
    resources.extend(surfaces.resources());
    let (mesh_ends, mesh_count) = surfaces.mesh_ends();
    resources.push(("mesh_ends", mesh_ends));
    resources.extend(gbuffer.resources());
    let [width, height] = plan.resolution_px;
    let parameters = PrimaryRayParameters {
        resolution_px: [width, height],
        material_count: context.scene.materials.len() as u32,
        mesh_count,
        offset_px: offset_px.as_vec2().to_array(),
    };
    recorder.prepare_images(&gbuffer.colors());
    recorder.pass("primary_rays", |recorder| {
        let columns = width.div_ceil(trace.module.constant("TILE_COLUMNS")?);
        let rows = height.div_ceil(trace.module.constant("TILE_ROWS")?);
        recorder.dispatch(&trace, &resources, &parameters, [columns, rows, 1])?;
        recorder.barrier();
        let [x, y, _] = shade.module.workgroup_size;
        let groups = [width.div_ceil(x), height.div_ceil(y), 1];
        recorder.dispatch(&shade, &resources, &parameters, groups)
    })
}
