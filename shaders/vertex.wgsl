// The vertex stage of all raster passes.

#import surface

@vertex
fn vertex_main(@builtin(vertex_index) corner: u32, @builtin(instance_index) instance: u32) -> Raster {
    var position = positions[indices[corner]].xyz;
    for (var i = 0u; i < min(instance, 1u); i++) {
        position = placed_point(to_scene(instance), position);
    }
    return Raster(view.clip_from_offset * vec4<f32>(position - view.origin, 1.0), corner / 3u, instance);
}
