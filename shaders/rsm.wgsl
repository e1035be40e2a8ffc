// The reflective shadow map (Dachsbacher & Stamminger 2005): what the light sees in each texel of its emission domain.

#import surface
#import light

// Per texel: ΔΩ (sr; directional: ΔA_perp, local units²) of its part inside the emission domain, and the mean of s(θ) there.
var<storage, read> emission: array<vec2<f32>>;

// Q; the index of its triangle (negative: no surface), exact up to 2^24. Then n_Q; the geometric normal, packed. Then k_d; L_{L→Q} over the
// light's axial intensity I_0: s/d² (directional: 1). Then the lobe.
#if SPECULAR
struct Rsm {
    @location(0) position: vec4<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) kd_irradiance: vec4<f32>,
    @location(3) lobe: LobeParameters,
}

fn with_lobe(position: vec4<f32>, normal: vec4<f32>, kd_irradiance: vec4<f32>, lobe: LobeParameters) -> Rsm {
    return Rsm(position, normal, kd_irradiance, lobe);
}
#else
struct Rsm {
    @location(0) position: vec4<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) kd_irradiance: vec4<f32>,
}

fn with_lobe(position: vec4<f32>, normal: vec4<f32>, kd_irradiance: vec4<f32>, lobe: LobeParameters) -> Rsm {
    return Rsm(position, normal, kd_irradiance);
}
#endif

@fragment
fn fragment_main(raster: Raster) -> Rsm {
    let hit = raster_hit(raster);
    let column_row = vec2<u32>(raster.position.xy);
    let from_light = hit.position - view.origin;
    // A surface that contains the light, up to rounding, does not block it; the same holds for shadows (triangle_hit.wgsl). A texel of that
    // surface would be at distance 0.
    let height = abs(dot(hit.geometric_normal, from_light));
    if ((view.is_parallel == 0u) & (height <= LIGHT_IN_PLANE * dot(abs(hit.geometric_normal), vec3<f32>(1.0)))) {
        discard;
    }
    let falloff = emission[view.first_texel + column_row.y * view.size_px + column_row.x].y;
    // Parallel light does not fall off with distance.
    let irradiance = falloff / select(dot(from_light, from_light), 1.0, view.is_parallel == 1u);
    let normal = vec4<f32>(hit.shading_normal, pack_direction(hit.geometric_normal));
    return with_lobe(vec4<f32>(hit.position, f32(raster.triangle)), normal, vec4<f32>(hit.brdf.kd, irradiance), hit.brdf.lobe);
}
