// The BRDF of a surface: a sum of lobes. Each lobe is a factor per band times a shape, so sums over light need only the shape.
//
//   diffuse    k_d/π · 1
//   specular   k_s·(s+2)/(2π) · max(0, r·w)^s, the modified Phong lobe: r mirrors one of its two directions, w is the other

#import math

struct Brdf {
    // k_d, k_s per band.
    kd: vec3<f32>,
    ks: vec3<f32>,
    // s, the Phong exponent.
    shininess: f32,
}

// The specular lobe with one of its two directions fixed. It is the same for light in the reverse direction.
struct Lobe {
    mirror: vec3<f32>,
    shininess: f32,
}

// The result of eval_lobe.
alias Shape = f32;

// `ks_shininess` is a texel of the G-buffer or of an RSM.
fn lobe_of(direction: vec3<f32>, normal: vec3<f32>, ks_shininess: vec4<f32>) -> Lobe {
    return Lobe(2.0 * dot(normal, direction) * normal - direction, ks_shininess.w);
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

// Factor from a gather with k_s = 1 to what the lobe reflects.
fn reflected_share(ks_shininess: vec4<f32>) -> vec3<f32> {
    return ks_shininess.rgb;
}

// Whether the light that two lobes reflect can be interpolated.
fn is_one_lobe(a: vec4<f32>, b: vec4<f32>) -> bool {
    return a.w == b.w && any(a.rgb > vec3<f32>(0.0)) == any(b.rgb > vec3<f32>(0.0));
}

fn diffuse_factor(kd: vec3<f32>) -> vec3<f32> {
    return kd / PI;
}

fn specular_factor(ks: vec3<f32>, shininess: f32) -> vec3<f32> {
    return ks * ((shininess + 2.0) / (2.0 * PI));
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
    if (PHONG) {
        value += specular_factor(brdf.ks, brdf.shininess) * eval_lobe(lobe_of(to_light, normal, vec4<f32>(brdf.ks, brdf.shininess)), to_viewer);
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
