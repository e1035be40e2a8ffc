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
    // (rms of light / rms of Z)² of each frequency. An error of Z times the square root of this counts as an error of light.
    error_scales: vec4<f32>,
}

var<uniform> modulation: Modulation;
