// The modulation of the lights, as a time-of-flight camera sees it, for up to four frequencies at a time. Each layer of an image holds two
// frequencies: re and im of the first, re and im of the second.

struct Modulation {
    // f/c times the local unit; 0 for unused frequencies.
    turns_per_unit: vec4<f32>,
    // 1 for each used frequency, else 0.
    is_used: vec4<f32>,
    // Weight of each band in what the pixels see.
    band_weights: vec3<f32>,
    // Layers of a phasor image.
    pair_count: u32,
    // Indices of the bands that the pixels see, and their number.
    bands: vec3<u32>,
    band_count: u32,
    // 1 for each of these bands, else 0.
    is_seen: vec3<f32>,
    // c/(4πf) of each used frequency, m: range over phase.
    metres_per_radian: vec4<f32>,
    // Share of the squared noise of Z that turns its phase, of each frequency.
    turning_shares: vec4<f32>,
    // An error of Z times the square root of this counts as an error of light: (rms of light / rms of Z)² of each frequency. If the target is
    // one of range, for the range that an error of Z makes: (rms of light / m)².
    error_scales: vec4<f32>,
}

var<uniform> modulation: Modulation;

// |Z|² of two frequencies.
fn squared_magnitudes(phasors: vec4<f32>) -> vec2<f32> {
    return vec2<f32>(dot(phasors.xy, phasors.xy), dot(phasors.zw, phasors.zw));
}
