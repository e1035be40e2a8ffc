// Phases of paths, in turns of the modulation. Lengths are differences to the path by way of the local origin, so f32 keeps the digits of
// lengths within the scene, however far the light is.

#import light
#import modulation

// A value of each frequency.
#if ONE
alias Frequencies = f32;
// Pairs of frequencies.
const PAIRS: u32 = 1u;

fn of_frequencies(values: vec4<f32>) -> Frequencies {
    return values.x;
}

// re and im of the first frequency of a pair, then of the second.
fn phasor_pair(phasors: Phasors, pair: u32) -> vec4<f32> {
    return vec4<f32>(phasors.re, phasors.im, 0.0, 0.0);
}
#else
alias Frequencies = vec4<f32>;
const PAIRS: u32 = 2u;

fn of_frequencies(values: vec4<f32>) -> Frequencies {
    return values;
}

fn phasor_pair(phasors: Phasors, pair: u32) -> vec4<f32> {
    return select(vec4<f32>(phasors.re.xy, phasors.im.xy), vec4<f32>(phasors.re.zw, phasors.im.zw), pair == 1u).xzyw;
}
#endif

// Real and imaginary parts.
struct Phasors {
    re: Frequencies,
    im: Frequencies,
}

// Turns of the path from a light to a point.
fn turns_from_light(light: Light, position: vec3<f32>) -> vec4<f32> {
    return turns_between(light.position, light.origin_turns, position);
}

// origin_turns. For an area light, that of the point of its area at light.position.
fn area_origin_turns(light: Light) -> vec4<f32> {
    return select(light.origin_turns, fract(modulation.turns_per_unit * length(light.position)), light.area_aspect != 0.0);
}

// Turns of the path between a point A and another point. `origin_turns` are those from A to the local origin.
fn turns_between(a: vec3<f32>, origin_turns: vec4<f32>, position: vec3<f32>) -> vec4<f32> {
    return fract(origin_turns + modulation.turns_per_unit * excess_length(a, position));
}

// |AP| less the distance of A from the origin: |v| − |A| = (v² − A²)/(|v| + |A|), v = P − A, without cancellation.
fn excess_length(a: vec3<f32>, position: vec3<f32>) -> f32 {
    let from_a = position - a;
    return dot(position, from_a - a) / max(length(from_a) + length(a), 1e-30);
}

// e^{i·2π·turns} of each used frequency, within 5e-7. Vulkan's own sin and cos guarantee only 2^-11. Minimax polynomials on half a turn to
// either side.
fn phasors_of(turns: Frequencies) -> Phasors {
    let x = turns - round(turns);
    let z = x * x;
    let sine = x * (6.28318527 + z * (-41.3416971 + z * (81.6050246 + z * (-76.7015512 + z * (42.0161658 + z * (-14.8686108 + z * 3.19969338))))));
    let cosine = 1.0 + z * (-19.7392045 + z * (64.939119 + z * (-85.4501656 + z * (60.1678318 + z * (-25.9683134 + z * 6.52961042)))));
    let is_used = of_frequencies(modulation.is_used);
    return Phasors(is_used * cosine, is_used * sine);
}

// Phasors of each band.
struct BandPhasors {
    red: Phasors,
    green: Phasors,
    blue: Phasors,
}

fn band_phasors(radiance: vec3<f32>, path: Phasors) -> BandPhasors {
    return BandPhasors(Phasors(radiance.r * path.re, radiance.r * path.im), Phasors(radiance.g * path.re, radiance.g * path.im),
        Phasors(radiance.b * path.re, radiance.b * path.im));
}

fn add_phasors(a: BandPhasors, b: BandPhasors) -> BandPhasors {
    return BandPhasors(Phasors(a.red.re + b.red.re, a.red.im + b.red.im), Phasors(a.green.re + b.green.re, a.green.im + b.green.im),
        Phasors(a.blue.re + b.blue.re, a.blue.im + b.blue.im));
}

fn scaled_phasors(phasors: BandPhasors, factor: vec3<f32>) -> BandPhasors {
    return BandPhasors(Phasors(factor.r * phasors.red.re, factor.r * phasors.red.im),
        Phasors(factor.g * phasors.green.re, factor.g * phasors.green.im), Phasors(factor.b * phasors.blue.re, factor.b * phasors.blue.im));
}
