// How a pixel was sampled.

#import refinement
#import reflect

var samples: texture_storage_2d_array<rgba32float, read_write>;

// Layers of `samples`. First: packets of samples; and, from the pixels around, the variance of one sample, diffuse and specular, and their
// packets.
const SAMPLING: u32 = 0u;
// What the smooth pass found: errors and leverage of a model, and 1.
const MODEL: u32 = 1u;
// A, as the unoccluded pass stores it.
const UNOCCLUDED: u32 = 2u;
// Σ of the samples' contributions, and of their squared differences.
const SUMS_DIFFUSE: u32 = 3u;
const SUMS_SPECULAR: u32 = 4u;

// After all sums: the variances of Z from the pixels around, each as if it were one of light, diffuse and specular. Then for each lobe Σ of
// the squared differences of each frequency's Z.
fn phasor_variances_layer() -> u32 {
    return SUMS_DIFFUSE + phasor_layer(phasor_layer_count(), 0u);
}

fn phasor_squares_layer(lobe: u32) -> u32 {
    return phasor_variances_layer() + 1u + lobe;
}

fn phasor_sums_layer(index: u32, lobe: u32) -> u32 {
    return SUMS_DIFFUSE + phasor_layer(index, lobe);
}

// What the smooth pass found out about a pixel's neighbours as its model.
struct Model {
    // Squared error of the model less that of its noise, diffuse and specular.
    errors: vec2<f32>,
    // Variance of its value over that of a pixel's.
    leverage: f32,
    // false: the pixel has no model, because it has too few neighbours.
    is_known: bool,
}

fn model_at(pixel: vec2<u32>) -> Model {
    let stored = textureLoad(samples, pixel, MODEL);
    return Model(stored.xy, stored.z, stored.w == 1.0);
}

struct Sampling {
    packets: f32,
    // Of one sample, diffuse and specular.
    variances: vec2<f32>,
    // Of Z: the largest over all frequencies, as if it were one of light.
    phasor_variances: vec2<f32>,
}

// The pixel's own sampling, or that known from the pixels around.
fn known_sampling(pixel: vec2<u32>) -> Sampling {
    let around = textureLoad(samples, pixel, SAMPLING);
    var squares = vec2<f32>(textureLoad(samples, pixel, SUMS_DIFFUSE).w, 0.0);
    if (SPECULAR) {
        squares.y = textureLoad(samples, pixel, SUMS_SPECULAR).w;
    }
    let is_own = around.x > 0.0;
    let scale = 1.0 / (PACKET_SAMPLES * max(around.x, 1.0));
    var sampling: Sampling;
    sampling.packets = select(around.w, around.x, is_own);
    sampling.variances = select(around.yz, scale * squares, is_own);
    if (PHASORS) {
        let scales = error_scales_at(pixel);
        var phasor_squares = vec2<f32>(worst_of(scales * textureLoad(samples, pixel, phasor_squares_layer(0u))), 0.0);
        if (SPECULAR) {
            phasor_squares.y = worst_of(scales * textureLoad(samples, pixel, phasor_squares_layer(1u)));
        }
        sampling.phasor_variances = select(textureLoad(samples, pixel, phasor_variances_layer()).xy, scale * phasor_squares, is_own);
    }
    return sampling;
}

// Variance of one sample of what the pixel reflects; with phasors, the largest variance of light and Z.
fn reflect_variances(pixel: vec2<u32>, sampling: Sampling) -> f32 {
    var variance = reflect_squares(pixel, sampling.variances);
    if (PHASORS) {
        variance = max(variance, reflect_phasor_squares(pixel, sampling.phasor_variances));
    }
    return variance;
}

// Squared error of the model of what the pixel reflects. The smooth pass measures it against the noise of light; with phasors, it is as many
// times the noise of the worst of light and Z.
fn reflect_model_errors(pixel: vec2<u32>, model: Model, sampling: Sampling) -> f32 {
    var error = reflect_squares(pixel, model.errors);
    if (PHASORS) {
        let of_light = reflect_squares(pixel, sampling.variances);
        error *= select(1.0, reflect_variances(pixel, sampling) / of_light, of_light > 0.0);
    }
    return error;
}

// The sampling known from the pixels around.
fn sampling_around(pixel: vec2<u32>) -> Sampling {
    let around = textureLoad(samples, pixel, SAMPLING);
    var sampling: Sampling;
    sampling.packets = around.w;
    sampling.variances = around.yz;
    if (PHASORS) {
        sampling.phasor_variances = textureLoad(samples, pixel, phasor_variances_layer()).xy;
    }
    return sampling;
}
