// What the camera sees at each pixel's centre.

#import surface

struct GBuffer {
    // P; mesh id (0: no surface).
    @location(0) position_mesh: vec4<f32>,
    // n_P; the geometric normal, packed.
    @location(1) normal: vec4<f32>,
    // k_d; material id.
    @location(2) kd_material: vec4<f32>,
#if PHONG
    // k_s; s.
    @location(3) ks_shininess: vec4<f32>,
#endif
}

@fragment
fn fragment_main(raster: Raster) -> GBuffer {
    let hit = hit_surface(raster);
    var pixel: GBuffer;
    var mesh_id = draw.mesh_id;
    for (var i = 0u; i < min(raster.instance, 1u); i++) {
        mesh_id = f32(mesh_id_of(raster.instance));
    }
    pixel.position_mesh = vec4<f32>(hit.position, mesh_id);
    pixel.normal = vec4<f32>(hit.shading_normal, pack_direction(hit.geometric_normal));
    pixel.kd_material = vec4<f32>(hit.brdf.kd, draw.material_id);
#if PHONG
    pixel.ks_shininess = vec4<f32>(hit.brdf.ks, hit.brdf.shininess);
#endif
    return pixel;
}
