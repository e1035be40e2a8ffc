// What the lighting passes share: lights and virtual point lights as they lie in memory. Lengths are local units.

const PI: f32 = 3.14159265358979;

// One face of a light's map: the direction of (u, v) in [−1, 1]² is forward + half_extent·(u·right + v·up).
struct LightFace {
    right: vec3<f32>,
    up: vec3<f32>,
    forward: vec3<f32>,
}

// Of a cube; spots and parallel light have one.
const MAX_FACES: u32 = 6u;

struct Light {
    // L; directional: the centre of the map's plane.
    position: vec3<f32>,
    // Tangent of the half opening of a face; directional: half the edge of the map's plane.
    half_extent: f32,
    // Unit vector: axis of the cone (spot), direction in which the light travels (directional).
    axis: vec3<f32>,
    // θ_o, rad; spot only.
    outer_half_angle: f32,
    // I_0 per band over the local unit squared, so that I_0/d² is W/m²; directional: E_L, W/m².
    intensity: vec3<f32>,
    // 1/(θ_o − θ_i); huge where they are equal; spot only.
    inverse_penumbra: f32,
    faces: array<LightFace, MAX_FACES>,
    face_count: u32,
    // Texels along a face's edge of the map that the shadow test reads.
    shadow_size: u32,
    // Texels along a face's edge of the RSM.
    rsm_size: u32,
    // ΣΔΩ over the RSM: the measure of the emission domain.
    emission_measure: f32,
    // 1 for a directional light, else 0.
    is_parallel: u32,
    // Where its VPLs, and the tiles of its RSM, begin in lists that all lights share.
    first_vpl: u32,
    first_tile: u32,
}

// Area that an RSM's texel has where its ray meets a surface that faces the light, local units². Not cut at the rim of the
// emission domain.
fn facing_texel_area(is_parallel: u32, half_extent: f32, rsm_size: u32, from_light: vec3<f32>, depth: f32) -> f32 {
    let edge = 2.0 * half_extent / f32(rsm_size);
    // ΔΩ·d² = edge²·(depth/d)³·d²
    let narrowing = depth * depth * depth * inverseSqrt(max(dot(from_light, from_light), 1e-18));
    return edge * edge * select(narrowing, 1.0, is_parallel == 1u);
}

// A virtual point light on a matte surface.
struct Vpl {
    // Q
    position: vec3<f32>,
    // n_Q
    normal: vec3<f32>,
    // What it sends in every direction of its hemisphere. rsm-average: radiance times the texel's share of the domain,
    // (k_d/π)·L_{L→Q}·cosθ_{Q→L}·ΔΩ/ΣΔΩ. instant-radiosity: intensity per cosine, (k_d/π)·I·ΔΩ.
    diffuse: vec3<f32>,
}

// A virtual point light on a surface with a specular lobe.
struct GlossyVpl {
    position: vec3<f32>,
    // s, the Phong exponent.
    shininess: f32,
    normal: vec3<f32>,
    diffuse: vec3<f32>,
    // As `diffuse`, with k_s·(s+2)/(2π) in the place of k_d/π; the lobe is left to the gather.
    specular: vec3<f32>,
    // Direction of mirror reflection of the light at Q.
    mirror: vec3<f32>,
}

// Lists of VPLs lie in image arrays, one layer per member: lavapipe fetches a texel for eight lanes in half the time of a
// buffer load, and images have no limit of 128 MiB. A row holds this many VPLs.
const VPLS_PER_ROW: u32 = 1024u;
// Layers: position, normal, diffuse; specular and s, mirror.
const VPL_LAYERS: u32 = 3u;
const GLOSSY_VPL_LAYERS: u32 = 5u;

fn vpl_place(index: u32) -> vec2<u32> {
    return vec2<u32>(index % VPLS_PER_ROW, index / VPLS_PER_ROW);
}

fn unpack_direction(packed: f32) -> vec3<f32> {
    let row = floor(packed / 4096.0);
    let flat = vec2<f32>(packed - row * 4096.0, row) / 4094.0 * 2.0 - 1.0;
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    let fold = max(-z, 0.0);
    return normalize(vec3<f32>(flat - select(vec2<f32>(-fold), vec2<f32>(fold), flat >= vec2<f32>(0.0)), z));
}
