// The modulation of the lights, as a time-of-flight camera sees it, for up to four frequencies at a time. Images hold two frequencies a layer:
// re and im of the first, re and im of the second.

struct Modulation {
    // f/c times the local unit; 0 where there are fewer frequencies.
    turns_per_unit: vec4<f32>,
    // 1 for each frequency; 0 where there are fewer.
    is_used: vec4<f32>,
    // What the pixels see of each band.
    band_weights: vec3<f32>,
    // Layers of an image of phasors.
    pair_count: u32,
    // Bands that the pixels see, and how many there are.
    bands: vec3<u32>,
    band_count: u32,
    // 1 for each of them; 0 for the others.
    is_seen: vec3<f32>,
    // (rms of light / rms of Z)² of each frequency: an error of Z times the root counts as one of light.
    error_scales: vec4<f32>,
}

var<uniform> modulation: Modulation;
