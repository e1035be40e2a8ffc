// What the camera sees at each pixel's centre.

#import surface

// Whether the ray through the pixel's centre comes from behind the triangle.
fn shows_back(raster: Raster) -> bool {
    let corner0 = corner(raster.instance, indices[3u * raster.triangle]).position;
    let corner1 = corner(raster.instance, indices[3u * raster.triangle + 1u]).position;
    let corner2 = corner(raster.instance, indices[3u * raster.triangle + 2u]).position;
    let front = handedness(raster.instance) * cross(corner1 - corner0, corner2 - corner0);
    return dot(front, view.ray_direction * vec3<f32>(1.0, raster.position.xy)) > 0.0;
}

#if TRIANGLES
// For layers on request. First: 1 + the triangle's index among those of the scene, or 0. Then the barycentric coordinates of corners 1 and 2.
@fragment
fn fragment_main(raster: Raster) -> @location(0) vec4<f32> {
    if (ONE_SIDED) {
        if (shows_back(raster)) {
            discard;
        }
    }
    let pixel = vec3<f32>(1.0, raster.position.xy);
    let b = place_on_plane(raster_triangle(raster), view.origin, view.ray_offset * pixel, view.ray_direction * pixel, view.forward);
    return vec4<f32>(f32(1u + raster.triangle), b.yz, 0.0);
}
#else
// P; instance id (0: no surface). Then n_P; the geometric normal, packed. Then k_d; material id. Then the lobe.
#if SPECULAR
struct GBuffer {
    @location(0) position_instance: vec4<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) kd_material: vec4<f32>,
    @location(3) lobe: LobeParameters,
}

fn with_lobe(position_instance: vec4<f32>, normal: vec4<f32>, kd_material: vec4<f32>, lobe: LobeParameters) -> GBuffer {
    return GBuffer(position_instance, normal, kd_material, lobe);
}
#else
struct GBuffer {
    @location(0) position_instance: vec4<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) kd_material: vec4<f32>,
}

fn with_lobe(position_instance: vec4<f32>, normal: vec4<f32>, kd_material: vec4<f32>, lobe: LobeParameters) -> GBuffer {
    return GBuffer(position_instance, normal, kd_material);
}
#endif

@fragment
fn fragment_main(raster: Raster) -> GBuffer {
    if (ONE_SIDED) {
        if (shows_back(raster)) {
            discard;
        }
    }
    let hit = raster_hit(raster);
    var instance_id = draw.instance_id;
    for (var i = 0u; i < min(raster.instance, 1u); i++) {
        instance_id = f32(instance_id_of(raster.instance));
    }
    let normal = vec4<f32>(hit.shading_normal, pack_direction(hit.geometric_normal));
    return with_lobe(vec4<f32>(hit.position, instance_id), normal, vec4<f32>(hit.brdf.kd, draw.material_id), hit.brdf.lobe);
}
#endif
