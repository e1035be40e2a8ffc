// The light's shadow map: where its rays end, and on which triangle. The first attachment of the RSM alone.

#import surface

@fragment
fn fragment_main(raster: Raster) -> @location(0) vec4<f32> {
    let hit = hit_surface(raster);
    return vec4<f32>(hit.position, f32(raster.triangle));
}
