// The vertex stage of all raster passes.

#import surface

@vertex
fn vertex_main(@builtin(vertex_index) corner: u32) -> Raster {
    let offset = positions[indices[corner]].xyz - view.origin;
    return Raster(view.clip_from_offset * vec4<f32>(offset, 1.0), corner / 3u);
}
