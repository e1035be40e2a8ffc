// Direct radiance of one light: L_{P→C} = f_P(l, n_P, v) · L_{L→P} · cosθ_{P→L} · V(L, P), added to the direct image.

struct DirectParameters {
    // C
    camera_position: vec3<f32>,
}

@group(0) @binding(0) var position_mesh: texture_2d<f32>;
@group(0) @binding(1) var normal_geometric: texture_2d<f32>;
@group(0) @binding(2) var kd_material: texture_2d<f32>;
@group(0) @binding(3) var ks_shininess: texture_2d<f32>;
@group(0) @binding(4) var<uniform> light: Light;
// Position and triangle of what the light sees: of the RSM where it is fine enough, else a map of its own.
@group(0) @binding(5) var light_map: texture_2d_array<f32>;
@group(0) @binding(6) var direct_radiance: texture_storage_2d<rgba32float, read_write>;
@group(0) @binding(7) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read> indices: array<u32>;
var<immediate> parameters: DirectParameters;

// Local units by which rounding moves a position out of its plane.
const ROUNDING: f32 = 2e-6;

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    let size = textureDimensions(position_mesh);
    if (pixel.x >= size.x || pixel.y >= size.y) {
        return;
    }
    let surface = textureLoad(position_mesh, pixel, 0);
    if (surface.w == 0.0) {
        return;
    }
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
    irradiance *= spot_falloff(-to_light);
#endif

    var brdf = kd / PI;
#if PHONG
    let to_camera = normalize(parameters.camera_position - surface.xyz);
    let mirror = 2.0 * dot(normal.xyz, to_light) * normal.xyz - to_light;
    let specular = textureLoad(ks_shininess, pixel, 0);
    brdf += specular.rgb * ((specular.w + 2.0) / (2.0 * PI)) * phong_lobe(mirror, to_camera, specular.w);
#endif
    let cosine = max(dot(normal.xyz, to_light), 0.0);
    let radiance = brdf * irradiance * (cosine * visibility(surface.xyz, unpack_direction(normal.w)));
    let sum = textureLoad(direct_radiance, pixel).rgb + radiance;
    textureStore(direct_radiance, pixel, vec4<f32>(sum, 0.0));
}

// V(L, P) from the light's map. P is hidden if the segment from L to P crosses a triangle that the light sees in one of the
// four texels whose centres enclose P. A straight edge that has P on its inner side has one of the four there too, so
// that shadows have the edges of their triangles however coarse the texels are; only corners of a triangle, and
// triangles smaller than a texel, slip through.
//
// For the sake of those, P is hidden, too, if each of the four texels hides it by planes alone: the surface Q that the light
// sees lies in front of P's tangent plane *and* P lies behind Q's, by more than facets rise from their neighbours. A plane, a convex edge and a concave edge each fail one of the two however coarse the texels are, so that neither
// acne nor a depth bias that grows with the slope is there to be traded.
fn visibility(position: vec3<f32>, geometric_normal: vec3<f32>) -> f32 {
    let offset = position - light.position;
    var face = 0u;
    var depth = dot(offset, light.faces[0].forward);
    for (var i = 1u; i < light.face_count; i++) {
        let other = dot(offset, light.faces[i].forward);
        if (other > depth) {
            depth = other;
            face = i;
        }
    }
#if DIRECTIONAL
    let extent = light.half_extent;
    let ray = light.axis;
#else
    let extent = light.half_extent * depth;
    let ray = offset;
#endif
    let size = f32(light.shadow_size);
    let u = dot(offset, light.faces[face].right) / extent;
    let v = dot(offset, light.faces[face].up) / extent;
    let corner = vec2<i32>(floor(vec2<f32>(0.5 + 0.5 * u, 0.5 - 0.5 * v) * size - 0.5));
    // Facets finer than a texel lie off the plane of their neighbours.
    let roughness = 0.05 * (2.0 * extent / size);
    var crossed = false;
    var hiding_texels = 0u;
    for (var i = 0; i < 4; i++) {
        let texel = clamp(corner + vec2<i32>(i % 2, i / 2), vec2<i32>(0), vec2<i32>(i32(light.shadow_size) - 1));
        let seen = textureLoad(light_map, texel, face, 0);
        let triangle = u32(max(seen.w, 0.0));
        // Corners from P: what two triangles share cancels exactly, so that no ray slips between them.
        let corner0 = positions[indices[3u * triangle]].xyz - position;
        let corner1 = positions[indices[3u * triangle + 1u]].xyz - position;
        let corner2 = positions[indices[3u * triangle + 2u]].xyz - position;
        let normal = normalize(cross(corner1 - corner0, corner2 - corner0));
        // How far P lies behind the triangle's plane, as the light sees it.
        let behind = -dot(normal, corner0) * sign(dot(normal, ray));
#if DIRECTIONAL
        let is_ahead_of_light = true;
#else
        let is_ahead_of_light = dot(normal, corner0 + ray) * dot(normal, ray) > 0.0;
#endif
        let side0 = dot(ray, cross(corner1, corner2));
        let side1 = dot(ray, cross(corner2, corner0));
        let side2 = dot(ray, cross(corner0, corner1));
        let is_inside = min(min(side0, side1), side2) >= 0.0 || max(max(side0, side1), side2) <= 0.0;
        let is_surface = seen.w >= 0.0;
        crossed = crossed || (is_surface && is_inside && is_ahead_of_light && behind > ROUNDING);
        let is_before_receiver = dot(geometric_normal, seen.xyz - position) > ROUNDING + roughness;
        hiding_texels += u32(is_surface && is_before_receiver && behind > ROUNDING + roughness);
    }
    return select(1.0, 0.0, crossed || hiding_texels == 4u);
}

#if SPOT
// s(θ): 1 inside θ_i, cos(½π·(θ−θ_i)/(θ_o−θ_i)) up to θ_o, 0 outside.
fn spot_falloff(direction: vec3<f32>) -> f32 {
    let angle = angle_between(light.axis, direction);
    let inside = clamp((light.outer_half_angle - angle) * light.inverse_penumbra, 0.0, 1.0);
    return sin_quarter(inside * (0.5 * PI));
}

// The angle in [0, π]; from sine and cosine, for acos loses narrow cones to rounding.
fn angle_between(a: vec3<f32>, b: vec3<f32>) -> f32 {
    let sine = length(cross(a, b));
    let cosine = dot(a, b);
    let ratio = min(sine, abs(cosine)) / max(sine, abs(cosine));
    let is_wide = ratio > 0.41421356;
    let x = select(ratio, (ratio - 1.0) / (ratio + 1.0), is_wide);
    let z = x * x;
    // Minimax polynomial of atan on |x| ≤ tan(π/8), Cephes atanf: within 1e-7.
    let near = x + x * z * (-0.333329491539 + z * (0.199777106478 + z * (-0.138776856032 + z * 0.0805374449538)));
    let octant = select(near, near + 0.25 * PI, is_wide);
    let quadrant = select(octant, 0.5 * PI - octant, sine > abs(cosine));
    return select(quadrant, PI - quadrant, cosine < 0.0);
}

// sin(x) on [0, π/2], Taylor to x^13: within 7e-10. Drivers' sin may be off by 2^-11.
fn sin_quarter(x: f32) -> f32 {
    let z = x * x;
    return x + x * z * (-0.16666667 + z * (0.0083333333 + z * (-0.00019841270 + z * (2.7557319e-6
        + z * (-2.5052108e-8 + z * 1.6059044e-10)))));
}
#endif
