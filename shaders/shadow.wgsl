// The light's shadow map: the end points of its rays, and their triangles. It is the RSM's first attachment, without the others.

#import surface

@fragment
fn fragment_main(raster: Raster) -> @location(0) vec4<f32> {
    let hit = raster_hit(raster);
    return vec4<f32>(hit.position, f32(raster.triangle));
}
