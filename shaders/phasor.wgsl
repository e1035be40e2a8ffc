// Phases of paths in turns of the modulation, for up to four frequencies at a time. A path's length counts from what it would be by way of the
// local origin, so that f32 keeps the digits of lengths within the scene, however far the light is.

#import light

struct Modulation {
    // f/c times the local unit; 0 where there are fewer frequencies.
    turns_per_unit: vec4<f32>,
    // What the pixels see of each band.
    band_weights: vec3<f32>,
    // Of images of phasors, two frequencies a layer.
    layer_count: u32,
}

var<uniform> modulation: Modulation;

// Real and imaginary parts, one of each frequency.
struct Phasors {
    re: vec4<f32>,
    im: vec4<f32>,
}

// |LP| less the light's distance from the origin: |v| − |L| = (v² − L²)/(|v| + |L|), v = P − L, without cancellation.
fn excess_length(light: Light, position: vec3<f32>) -> f32 {
    let from_light = position - light.position;
    return dot(position, from_light - light.position) / max(length(from_light) + length(light.position), 1e-30);
}

// e^{i·2π·turns}, within 2e-7; Vulkan's own sin and cos promise 2^-11. Polynomials of sinf and cosf of Cephes, on ±π/4.
fn phasors_of(turns: vec4<f32>) -> Phasors {
    let quarters = 4.0 * (turns - round(turns));
    let nearest = round(quarters);
    let angle = 0.5 * PI * (quarters - nearest);
    let z = angle * angle;
    let sine = angle + angle * z * (-1.6666654611e-1 + z * (8.3321608736e-3 - z * 1.9515295891e-4));
    let cosine = 1.0 - 0.5 * z + z * z * (4.166664568298827e-2 + z * (-1.388731625493765e-3 + z * 2.443315711809948e-5));
    let is_odd = abs(nearest) == vec4<f32>(1.0);
    let is_half = abs(nearest) == vec4<f32>(2.0);
    // By a quarter: cos is ∓sin and sin is ±cos; by a half both change their sign.
    let turned_re = select(cosine, -nearest * sine, is_odd);
    let turned_im = select(sine, nearest * cosine, is_odd);
    return Phasors(select(turned_re, -cosine, is_half), select(turned_im, -sine, is_half));
}
