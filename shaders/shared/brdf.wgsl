// The BRDF of a surface: a sum of lobes. Each lobe is a factor per band times a shape, so sums over light need only the shape. Only this
// file knows what the specular lobe is; others hand its parameters on.
//
//   diffuse       k_d/π · 1
//   Phong         k_s·(s+2)/(2π) · max(0, r·w)^s, modified Phong: r mirrors one of the two directions, w is the other
//   microfacets   D·V·F, GGX (glTF 2.0, appendix B), n·v > 0 and n·w > 0; h is half-way between the two directions v and w:
//                 D = α²/(π·((n·h)²·(α²−1)+1)²), F = F_0 + (F_90−F_0)·(1−h·w)⁵,
//                 V = ½/(n·w·√(α²+(1−α²)·(n·v)²) + n·v·√(α²+(1−α²)·(n·w)²))

#import math

// Phong: k_s per band; s, the exponent. Microfacets: F_0 per band; −α, or −α·BARE where k_d is 0. 0 without a lobe. A texel of materials, of
// the G-buffer and of RSMs.
alias LobeParameters = vec4<f32>;

// A power of two, so that α stays as it is, and so large that the least α becomes more than the largest.
const BARE: f32 = 2048.0;

struct Brdf {
    // k_d per band.
    kd: vec3<f32>,
    lobe: LobeParameters,
}

// The maps of a material that change its lobe. Phong: k_s; s in red. Microfacets: none; roughness in green and metallic in blue.
const LOBE_MAPS: u32 = 2u;

// Materials of microfacets are stored as their base colour; F_0 without metal, metallic, 0, −roughness. Maps multiply these. The smallest
// roughness keeps a lobe wider than f32 directions can express.
const SMOOTHEST: f32 = 0.03;

fn is_microfacet(parameters: LobeParameters) -> bool {
    return MICROFACET & (parameters.w < 0.0);
}

// What the value of a map makes of a material.
fn mapped_lobe(parameters: LobeParameters, map: u32, value: vec3<f32>) -> LobeParameters {
    let of_phong = select(vec4<f32>(value, 1.0), vec4<f32>(1.0, 1.0, 1.0, value.x), map == 1u);
    return parameters * select(of_phong, vec4<f32>(1.0, value.z, 1.0, value.y), is_microfacet(parameters));
}

// The BRDF of a material after its maps.
fn brdf_of_material(material: Brdf) -> Brdf {
    if (MICROFACET) {
        let metallic = material.lobe.y;
        let dielectric = material.lobe.x;
        let roughness = clamp(-material.lobe.w, SMOOTHEST, 1.0);
        let kd = material.kd * ((1.0 - metallic) * (1.0 - dielectric));
        let alpha = roughness * roughness * select(BARE, 1.0, any(kd > vec3<f32>(0.0)));
        let lobe = vec4<f32>(mix(vec3<f32>(dielectric), material.kd, metallic), -alpha);
        let is_it = is_microfacet(material.lobe);
        return Brdf(select(material.kd, kd, is_it), select(material.lobe, lobe, is_it));
    } else {
        return material;
    }
}

// Whether the surface reflects by its lobe alone. Then no direction is drawn for the base. (Phong lobes are not told apart.)
fn is_bare(parameters: LobeParameters) -> bool {
    return MICROFACET & (parameters.w < -1.0);
}

fn has_lobe(parameters: LobeParameters) -> bool {
    return any(parameters.rgb > vec3<f32>(0.0));
}

// F_90 of microfacets: what reflects less than any dielectric straight on reflects less at grazing angles, too.
fn grazing_reflectance(f0: vec3<f32>) -> f32 {
    return min(50.0 * max(max(f0.x, f0.y), f0.z), 1.0);
}

// The mean of F over a hemisphere, weighted by the cosine. ∫ 2μ·(1−μ)⁵ dμ is 1/21.
fn mean_reflectance(f0: vec3<f32>) -> vec3<f32> {
    return (20.0 * f0 + grazing_reflectance(f0)) / 21.0;
}

// Factor from a gather of a lobe's shape to what the lobe reflects.
fn reflected_share(parameters: LobeParameters) -> vec3<f32> {
    var share = parameters.rgb;
    if (MICROFACET) {
        share = select(share, mean_reflectance(parameters.rgb), is_microfacet(parameters));
    }
    return share;
}

// Whether the light that two lobes reflect can be interpolated. Facets need not be quite alike, because textures differ from texel to texel.
fn is_one_lobe(a: LobeParameters, b: LobeParameters) -> bool {
    var is_alike = a.w == b.w;
    if (MICROFACET) {
        let of_facets = max(a.w, b.w) <= 0.75 * min(a.w, b.w) && abs(straight_on_share(a.rgb) - straight_on_share(b.rgb)) <= 0.1;
        is_alike = select(is_alike, of_facets, a.w < 0.0 && b.w < 0.0);
    }
    return is_alike && has_lobe(a) == has_lobe(b);
}

// How much less facets reflect straight on than on average: about a half for dielectrics, nothing for metals.
fn straight_on_share(f0: vec3<f32>) -> f32 {
    let strongest = max(max(f0.x, f0.y), f0.z);
    return 21.0 * strongest / max(20.0 * strongest + grazing_reflectance(f0), 1e-30);
}

// The specular lobe with one of its two directions fixed. It is the same for light in the reverse direction.
struct Lobe {
    // The fixed direction, mirrored.
    mirror: vec3<f32>,
    // s, or −α.
    spread: f32,
    // Of microfacets.
    normal: vec3<f32>,
    f0: vec3<f32>,
}

// The result of eval_lobe, per band.
alias Shape = vec3<f32>;

// For weights of samples.
fn mean_shape(shape: Shape) -> f32 {
    var mean = shape.x;
    if (MICROFACET) {
        mean = (shape.x + shape.y + shape.z) / 3.0;
    }
    return mean;
}

fn lobe_of(direction: vec3<f32>, normal: vec3<f32>, parameters: LobeParameters) -> Lobe {
    let spread = select(parameters.w, parameters.w / BARE, is_bare(parameters));
    return Lobe(2.0 * dot(normal, direction) * normal - direction, spread, normal, parameters.rgb);
}

// Texels of a stored lobe, one per layer of a list: of Phong lobes, and of any.
const PHONG_LAYERS: u32 = 1u;
const LOBE_LAYERS: u32 = 3u;

fn lobe_layers() -> u32 {
    return select(PHONG_LAYERS, LOBE_LAYERS, MICROFACET);
}

fn lobe_texel(lobe: Lobe, layer: u32) -> vec4<f32> {
    var texel = vec4<f32>(lobe.mirror, lobe.spread);
    if (MICROFACET) {
        texel = select(texel, vec4<f32>(lobe.normal, 0.0), layer == 1u);
        texel = select(texel, vec4<f32>(lobe.f0, 0.0), layer == 2u);
    }
    return texel;
}

fn lobe_of_texels(texels: array<vec4<f32>, LOBE_LAYERS>) -> Lobe {
    return Lobe(texels[0].xyz, texels[0].w, texels[1].xyz, texels[2].xyz);
}

#if BROADCAST8 BROADCAST4
#repeat LANE 8
fn broadcast_of_LANE(mine: Lobe) -> Lobe {
    var lobe: Lobe;
    lobe.mirror = subgroupBroadcast(mine.mirror, LANEu);
    lobe.spread = subgroupBroadcast(mine.spread, LANEu);
    if (MICROFACET) {
        lobe.normal = subgroupBroadcast(mine.normal, LANEu);
        lobe.f0 = subgroupBroadcast(mine.f0, LANEu);
    }
    return lobe;
}
#endrepeat
#endif

fn diffuse_factor(kd: vec3<f32>) -> vec3<f32> {
    return kd / PI;
}

fn specular_factor(parameters: LobeParameters) -> vec3<f32> {
    return reflected_share(parameters) * unit_factor(parameters.w);
}

// specular_factor for a reflected_share of 1.
fn unit_specular_factor(lobe: Lobe) -> f32 {
    return unit_factor(lobe.spread);
}

fn unit_factor(spread: f32) -> f32 {
    var factor = (spread + 2.0) / (2.0 * PI);
    if (MICROFACET) {
        factor = select(factor, 1.0, spread < 0.0);
    }
    return factor;
}

// Shape of the specular lobe.
fn eval_lobe(lobe: Lobe, direction: vec3<f32>) -> Shape {
    var shape = vec3<f32>(eval_phong(lobe, direction));
    if (MICROFACET) {
        shape = select(shape, eval_microfacets(lobe, direction), lobe.spread < 0.0);
    }
    return shape;
}

// It is 0 for r·w ≤ 0, even where s = 0.
fn eval_phong(lobe: Lobe, direction: vec3<f32>) -> f32 {
    let cosine = dot(lobe.mirror, direction);
    // 1 − cosθ = |r − w|²/2 avoids cancellation: in a sharp lobe the cosine is 1 to six digits.
    let apart = lobe.mirror - direction;
    let shape = exp2_of_negative(lobe.spread * min(log2_near_one(max(cosine, 1e-30), 0.5 * dot(apart, apart)), 0.0));
    return select(0.0, shape, cosine > 0.0);
}

// D·V·F relative to the mean of F.
fn eval_microfacets(lobe: Lobe, direction: vec3<f32>) -> vec3<f32> {
    let alpha_squared = lobe.spread * lobe.spread;
    let cosine_v = dot(lobe.normal, lobe.mirror);
    let cosine_w = dot(lobe.normal, direction);
    let half_way = half_way_to(lobe, direction);
    let smith = cosine_w * sqrt(alpha_squared + (1.0 - alpha_squared) * cosine_v * cosine_v)
        + cosine_v * sqrt(alpha_squared + (1.0 - alpha_squared) * cosine_w * cosine_w);
    let away = 1.0 - clamp(dot(half_way, direction), 0.0, 1.0);
    let away_squared = away * away;
    let fresnel = mix(lobe.f0, vec3<f32>(grazing_reflectance(lobe.f0)), away_squared * away_squared * away);
    let shape = facet_density(lobe, half_way) * 0.5 / max(smith, 1e-30) * fresnel / max(mean_reflectance(lobe.f0), vec3<f32>(1e-30));
    return select(vec3<f32>(0.0), shape, cosine_v > 0.0 && cosine_w > 0.0);
}

// The fixed direction of a lobe of microfacets.
fn fixed_direction(lobe: Lobe) -> vec3<f32> {
    return 2.0 * dot(lobe.normal, lobe.mirror) * lobe.normal - lobe.mirror;
}

// h
fn half_way_to(lobe: Lobe, direction: vec3<f32>) -> vec3<f32> {
    let sum = fixed_direction(lobe) + direction;
    return sum * inverseSqrt(max(dot(sum, sum), 1e-30));
}

// D. The sine avoids cancellation: in a sharp lobe the cosine is 1 to six digits.
fn facet_density(lobe: Lobe, half_way: vec3<f32>) -> f32 {
    let across = cross(lobe.normal, half_way);
    let cosine = dot(lobe.normal, half_way);
    let ratio = abs(lobe.spread) / max(lobe.spread * lobe.spread * cosine * cosine + dot(across, across), 1e-30);
    return ratio * ratio / PI;
}

fn eval_brdf(brdf: Brdf, normal: vec3<f32>, to_light: vec3<f32>, to_viewer: vec3<f32>) -> vec3<f32> {
    var value = diffuse_factor(brdf.kd);
    if (SPECULAR) {
        value += specular_factor(brdf.lobe) * eval_lobe(lobe_of(to_light, normal, brdf.lobe), to_viewer);
    }
    return value;
}

// The base's share of what a surface reflects.
fn base_share(brdf: Brdf) -> f32 {
    var share = 1.0;
    if (SPECULAR) {
        let base = band_sum(brdf.kd);
        share = base / max(base + band_sum(reflected_share(brdf.lobe)), 1e-30);
    }
    return share;
}

// Light along a direction over its mean, weighted by the cosine, if light comes from the fixed direction of the lobe. It is the same for
// light in the reverse direction. `shape` is the result of eval_lobe.
fn directivity(base_share: f32, lobe: Lobe, shape: Shape) -> f32 {
    var directivity = 1.0;
    if (SPECULAR) {
        directivity = base_share + (1.0 - base_share) * PI * unit_specular_factor(lobe) * mean_shape(shape);
    }
    return directivity;
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
    var axis = lobe.mirror;
    if (MICROFACET) {
        axis = select(axis, lobe.normal, lobe.spread < 0.0);
    }
    return frame_around(axis);
}

fn sample_lobe(square: vec2<f32>, lobe: Lobe, frame: Frame) -> vec3<f32> {
    let disc = to_disc(square);
    var direction = sample_phong(disc, lobe, frame);
    if (MICROFACET) {
        direction = select(direction, sample_microfacets(disc, lobe, frame), lobe.spread < 0.0);
    }
    return direction;
}

fn sample_phong(disc: vec2<f32>, lobe: Lobe, frame: Frame) -> vec3<f32> {
    // 1 − |disc|² is uniform in [0, 1], so cosθ = (1 − |disc|²)^(1/(s+1)).
    let inner = dot(disc, disc);
    let cosine = exp2(log2(max(1.0 - inner, 1e-30)) / (lobe.spread + 1.0));
    let scale = sqrt(max(1.0 - cosine * cosine, 0.0)) * inverseSqrt(max(inner, 1e-30));
    return normalize(scale * disc.x * frame.right + scale * disc.y * frame.up + cosine * frame.axis);
}

// Visible normals, of those that mirror to above the surface (Eto & Tokuyoshi 2023, "Bounded VNDF sampling for Smith-GGX reflections").
// Facets stretched to a sphere mirror to a cap of it, evenly.
fn sample_microfacets(disc: vec2<f32>, lobe: Lobe, frame: Frame) -> vec3<f32> {
    let alpha = -lobe.spread;
    let fixed = fixed_direction(lobe);
    let v = vec3<f32>(dot(fixed, frame.right), dot(fixed, frame.up), dot(fixed, frame.axis));
    let stretched = normalize(vec3<f32>(alpha * v.xy, v.z));
    let lowest = cap_share(alpha, v.z) * stretched.z;
    // |disc|² is uniform in [0, 1], and so is the height on the cap, from −lowest to 1.
    let down = dot(disc, disc) * (1.0 + lowest);
    let mirrored = vec3<f32>(disc * sqrt(max((1.0 + lowest) * (2.0 - down), 0.0)), 1.0 - down);
    let facet = stretched + mirrored;
    let m = normalize(vec3<f32>(alpha * facet.xy, max(facet.z, 1e-30)));
    let m_world = m.x * frame.right + m.y * frame.up + m.z * frame.axis;
    return normalize(2.0 * dot(fixed, m_world) * m_world - fixed);
}

// How much of the stretched sphere's lower half reflects to above the surface, for n·v.
fn cap_share(alpha: f32, cosine: f32) -> f32 {
    let alpha_squared = alpha * alpha;
    let s = 1.0 + sqrt(max(1.0 - cosine * cosine, 0.0));
    let share = (1.0 - alpha_squared) * s * s / (s * s + alpha_squared * cosine * cosine);
    return select(1.0, share, cosine > 0.0);
}

// `shape` is the result of eval_lobe for the direction.
fn lobe_density(samples: f32, lobe: Lobe, direction: vec3<f32>, shape: Shape) -> f32 {
    var density = (lobe.spread + 1.0) / (2.0 * PI) * shape.x;
    if (MICROFACET) {
        density = select(density, microfacet_density(lobe, direction), lobe.spread < 0.0);
    }
    return samples * density;
}

fn microfacet_density(lobe: Lobe, direction: vec3<f32>) -> f32 {
    let alpha = -lobe.spread;
    let cosine = dot(lobe.normal, lobe.mirror);
    let across = alpha * alpha * max(1.0 - cosine * cosine, 0.0);
    let length = sqrt(across + cosine * cosine);
    // The same from behind, without cancellation.
    let inverse = select((length - cosine) / max(across, 1e-30), 1.0 / (cap_share(alpha, cosine) * cosine + length), cosine > 0.0);
    return 0.5 * facet_density(lobe, half_way_to(lobe, direction)) * inverse;
}
