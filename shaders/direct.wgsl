// Direct radiance of one light: L_{P→C} = f_P(l, n_P, v) · L_{L→P} · cosθ_{P→L} · V(L, P), added to the direct image.

struct DirectParameters {
    // C
    camera_position: vec3<f32>,
    // Nodes of the tree of boxes; 0 where there are no rays.
    node_count: u32,
}

@group(0) @binding(0) var position_mesh: texture_2d<f32>;
@group(0) @binding(1) var normal_geometric: texture_2d<f32>;
@group(0) @binding(2) var kd_material: texture_2d<f32>;
@group(0) @binding(3) var ks_shininess: texture_2d<f32>;
@group(0) @binding(4) var<uniform> light: Light;
@group(0) @binding(6) var direct_radiance: texture_storage_2d<rgba32float, read_write>;
var<immediate> parameters: DirectParameters;

// Edge of the pixels that a workgroup takes.
const TILE_PX: u32 = 8u;

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
#if PACKET
    @builtin(subgroup_invocation_id) lane: u32,
#endif
) {
#if PACKET
    // Eight lanes in a row take 4 x 2 pixels, whose rays part later than those of 8 x 1.
    let place = vec2<u32>((local >> 3u & 1u) * 4u + (local & 3u), (local >> 4u) * 2u + (local >> 2u & 1u));
#else
    let lane = 0u;
    let place = vec2<u32>(local & 7u, local >> 3u);
#endif
    // No lane leaves early: they go through the tree of boxes together.
    let size = textureDimensions(position_mesh);
    let is_in_image = all(TILE_PX * group.xy + place < size);
    let pixel = min(TILE_PX * group.xy + place, size - 1u);
    let surface = textureLoad(position_mesh, pixel, 0);
    let is_surface = is_in_image && surface.w != 0.0;
    let normal = textureLoad(normal_geometric, pixel, 0);
    let kd = textureLoad(kd_material, pixel, 0).rgb;

    let from_light = surface.xyz - light.position;
#if DIRECTIONAL
    let to_light = -light.axis;
    let irradiance = light.intensity;
#else
    // A light in the surface itself lights nothing there: the direction to it is not defined.
    let distance_squared = max(dot(from_light, from_light), 1e-18);
    let to_light = -from_light * inverseSqrt(distance_squared);
    var irradiance = select(vec3<f32>(0.0), light.intensity / distance_squared, any(from_light != vec3<f32>(0.0)));
#endif
#if SPOT
    irradiance *= spot_falloff(light.axis, light.outer_half_angle, light.inverse_penumbra, -to_light);
#endif

    var brdf = kd / PI;
#if PHONG
    let to_camera = normalize(parameters.camera_position - surface.xyz);
    let mirror = 2.0 * dot(normal.xyz, to_light) * normal.xyz - to_light;
    let specular = textureLoad(ks_shininess, pixel, 0);
    brdf += specular.rgb * ((specular.w + 2.0) / (2.0 * PI)) * phong_lobe(mirror, to_camera, specular.w);
#endif
    let cosine = max(dot(normal.xyz, to_light), 0.0);
    let is_faced = is_surface && cosine > 0.0 && any(irradiance > vec3<f32>(0.0));
    let radiance = brdf * irradiance * (cosine * visibility(surface.xyz, unpack_direction(normal.w), is_faced, lane));
    if (is_faced) {
        let sum = textureLoad(direct_radiance, pixel).rgb + radiance;
        textureStore(direct_radiance, pixel, vec4<f32>(sum, 0.0));
    }
}
