// The BRDF of a surface: a sum of lobes. Each lobe is a factor per band times a shape, so sums over light need only the shape. Only this
// file knows what the specular lobe is; others hand its parameters on.
//
//   diffuse    k_d/π · 1
//   specular   k_s·(s+2)/(2π) · max(0, r·w)^s, the modified Phong lobe: r mirrors one of its two directions, w is the other

#import math

// k_s per band; s, the Phong exponent. 0 without a lobe. A texel of materials, of the G-buffer and of RSMs.
alias LobeParameters = vec4<f32>;

struct Brdf {
    // k_d per band.
    kd: vec3<f32>,
    lobe: LobeParameters,
}

// The maps of a material that multiply its lobe: k_s, and s in red.
const LOBE_MAPS: u32 = 2u;

// The factor that the value of a map is.
fn lobe_scale(map: u32, value: vec3<f32>) -> LobeParameters {
    return select(vec4<f32>(value, 1.0), vec4<f32>(1.0, 1.0, 1.0, value.x), map == 1u);
}

fn has_lobe(parameters: LobeParameters) -> bool {
    return any(parameters.rgb > vec3<f32>(0.0));
}

// Factor from a gather with k_s = 1 to what the lobe reflects.
fn reflected_share(parameters: LobeParameters) -> vec3<f32> {
    return parameters.rgb;
}

// Whether the light that two lobes reflect can be interpolated.
fn is_one_lobe(a: LobeParameters, b: LobeParameters) -> bool {
    return a.w == b.w && has_lobe(a) == has_lobe(b);
}

// The specular lobe with one of its two directions fixed. It is the same for light in the reverse direction.
struct Lobe {
    mirror: vec3<f32>,
    shininess: f32,
}

// The result of eval_lobe.
alias Shape = f32;

fn lobe_of(direction: vec3<f32>, normal: vec3<f32>, parameters: LobeParameters) -> Lobe {
    return Lobe(2.0 * dot(normal, direction) * normal - direction, parameters.w);
}

// Texels of a stored lobe, one per layer of a list.
const LOBE_LAYERS: u32 = 1u;

fn lobe_texel(lobe: Lobe, layer: u32) -> vec4<f32> {
    return vec4<f32>(lobe.mirror, lobe.shininess);
}

fn lobe_of_texels(texels: array<vec4<f32>, LOBE_LAYERS>) -> Lobe {
    return Lobe(texels[0].xyz, texels[0].w);
}

#if BROADCAST8 BROADCAST4
#repeat LANE 8
fn broadcast_of_LANE(mine: Lobe) -> Lobe {
    return Lobe(subgroupBroadcast(mine.mirror, LANEu), subgroupBroadcast(mine.shininess, LANEu));
}
#endrepeat
#endif

fn diffuse_factor(kd: vec3<f32>) -> vec3<f32> {
    return kd / PI;
}

fn specular_factor(parameters: LobeParameters) -> vec3<f32> {
    return parameters.rgb * phong_factor(parameters.w);
}

// specular_factor for k_s = 1.
fn unit_specular_factor(lobe: Lobe) -> f32 {
    return phong_factor(lobe.shininess);
}

fn phong_factor(shininess: f32) -> f32 {
    return (shininess + 2.0) / (2.0 * PI);
}

// Shape of the specular lobe. It is 0 for r·w ≤ 0, even where s = 0.
fn eval_lobe(lobe: Lobe, direction: vec3<f32>) -> Shape {
    let cosine = dot(lobe.mirror, direction);
    // 1 − cosθ = |r − w|²/2 avoids cancellation: in a sharp lobe the cosine is 1 to six digits.
    let apart = lobe.mirror - direction;
    let shape = exp2_of_negative(lobe.shininess * min(log2_near_one(max(cosine, 1e-30), 0.5 * dot(apart, apart)), 0.0));
    return select(0.0, shape, cosine > 0.0);
}

fn eval_brdf(brdf: Brdf, normal: vec3<f32>, to_light: vec3<f32>, to_viewer: vec3<f32>) -> vec3<f32> {
    var value = diffuse_factor(brdf.kd);
    if (SPECULAR) {
        value += specular_factor(brdf.lobe) * eval_lobe(lobe_of(to_light, normal, brdf.lobe), to_viewer);
    }
    return value;
}

// sample_* maps a point of the unit square to a direction, neighbours to neighbours. *_density is the number of such directions per solid
// angle, of `samples` samples: for one sample, the pdf.
fn sample_diffuse(square: vec2<f32>, around_normal: Frame) -> vec3<f32> {
    let disc = to_disc(square);
    return disc.x * around_normal.right + disc.y * around_normal.up
        + sqrt(max(1.0 - dot(disc, disc), 0.0)) * around_normal.axis;
}

fn diffuse_density(samples: f32, cosine: f32) -> f32 {
    return samples * cosine / PI;
}

fn lobe_frame(lobe: Lobe) -> Frame {
    return frame_around(lobe.mirror);
}

fn sample_lobe(square: vec2<f32>, lobe: Lobe, frame: Frame) -> vec3<f32> {
    let disc = to_disc(square);
    // 1 − |disc|² is uniform in [0, 1], so cosθ = (1 − |disc|²)^(1/(s+1)).
    let inner = dot(disc, disc);
    let cosine = exp2(log2(max(1.0 - inner, 1e-30)) / (lobe.shininess + 1.0));
    let scale = sqrt(max(1.0 - cosine * cosine, 0.0)) * inverseSqrt(max(inner, 1e-30));
    return normalize(scale * disc.x * frame.right + scale * disc.y * frame.up + cosine * frame.axis);
}

// `shape` is the result of eval_lobe for the direction.
fn lobe_density(samples: f32, lobe: Lobe, direction: vec3<f32>, shape: Shape) -> f32 {
    return samples * (lobe.shininess + 1.0) / (2.0 * PI) * shape;
}
