// Writes the results of a gather to the pixels of its receivers, with the measured errors of their predictions.

#import refinement
#import reflect
#import sampling

struct ScatterParameters {
    first_receiver: u32,
    receiver_count: u32,
    // Errors are relative to this, W/sr/m², or to own_share times the pixel's own radiance, if that is more.
    least_radiance: f32,
    own_share: f32,
    // Noise of gathers, as in variance_of_mean.
    evenness: f32,
    variance_rate: f32,
}

var gathered: texture_storage_2d_array<rgba32float, read_write>;
var<storage, read> receivers: array<u32>;
// In the refinement's layout. Noisy gathers: the sums over samples, and over their squared differences.
var<storage, read> results: array<vec4<f32>>;
// Noisy gathers: in the layout of the sample_counts pass.
var<storage, read> sample_ranges: array<u32>;
var<immediate> parameters: ScatterParameters;

// Part of a prediction's squared error that chance explains, over the variance of the gather: two standard deviations.
const NOISE_SQUARED: f32 = 4.0;
// Interpolated pixels may have so many times the error of range as of light: few pixels have most of it, and gathering many more of them
// takes more samples than it saves. (Measured in a room, 5 and 2 mm: 24 and 126 M rays with 1, 20 and 56 M with 3.)
const RANGE_SLACK: f32 = 3.0;

// Adds to the sums of earlier samples.
fn add_phasor_sums(pixel: vec2<u32>, first: u32) {
    for (var lobe = 0u; lobe < lobe_count(); lobe++) {
        let squares = phasor_squares_layer(lobe);
        textureStore(samples, pixel, squares, textureLoad(samples, pixel, squares) + results[first + PHASOR_SQUARES + lobe]);
        for (var i = 0u; i < phasor_layer_count(); i++) {
            let layer = phasor_sums_layer(i, lobe);
            textureStore(samples, pixel, layer, textureLoad(samples, pixel, layer) + results[first + phasor_result(pair_of(i), band_of(i), lobe)]);
        }
    }
}

// Gathered Z of two frequencies and one band.
fn gathered_phasor(pixel: vec2<u32>, first: u32, index: u32, lobe: u32, sample_count: f32) -> vec4<f32> {
    if (NOISY) {
        return textureLoad(samples, pixel, phasor_sums_layer(index, lobe)) / sample_count;
    } else {
        return results[first + phasor_result(pair_of(index), band_of(index), lobe)];
    }
}

// Largest difference between gathered and predicted Z, as an error of light.
fn worst_phasor_deviation(pixel: vec2<u32>, first: u32, sample_count: f32) -> f32 {
    var worst = 0.0;
    for (var pair = 0u; pair < modulation.pair_count; pair++) {
        var deviation = vec4<f32>(0.0);
        for (var i = pair * modulation.band_count; i < (pair + 1u) * modulation.band_count; i++) {
            let shares = seen_shares(pixel, band_of(i));
            for (var lobe = 0u; lobe < lobe_count(); lobe++) {
                let predicted = textureLoad(gathered, pixel, phasor_layer(i, lobe));
                deviation += shares[lobe] * (gathered_phasor(pixel, first, i, lobe, sample_count) - predicted);
            }
        }
        worst = max(worst, worst_error_squared(pixel, pair, deviation));
    }
    if (RANGE) {
        worst /= RANGE_SLACK * RANGE_SLACK;
    }
    return sqrt(worst);
}

fn store_phasors(pixel: vec2<u32>, first: u32, sample_count: f32) {
    for (var lobe = 0u; lobe < lobe_count(); lobe++) {
        for (var i = 0u; i < phasor_layer_count(); i++) {
            textureStore(gathered, pixel, phasor_layer(i, lobe), gathered_phasor(pixel, first, i, lobe, sample_count));
        }
    }
}

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.receiver_count) {
        return;
    }
    let packed = receivers[parameters.first_receiver + id.x];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    let predicted = textureLoad(gathered, pixel, DIFFUSE_LOBE);
    let kind = decode_state(predicted.w).kind;
    let first = RESULT_VECTORS * id.x;
    var diffuse = results[first].rgb;
    var specular = vec3<f32>(0.0);
    var predicted_specular = vec3<f32>(0.0);
    if (SPECULAR) {
        specular = results[first + 1u].rgb;
        predicted_specular = textureLoad(gathered, pixel, SPECULAR_LOBE).rgb;
    }
    var packets = 1.0;
    var sample_count = 1.0;
    if (NOISY) {
        // Adds to the sums of earlier samples.
        let sums = textureLoad(samples, pixel, SUMS_DIFFUSE) + results[first];
        textureStore(samples, pixel, SUMS_DIFFUSE, sums);
        packets = f32(sample_ranges[parameters.first_receiver + id.x] >> 16u);
        sample_count = PACKET_SAMPLES * packets;
        diffuse = sums.rgb / sample_count;
        if (SPECULAR) {
            let specular_sums = textureLoad(samples, pixel, SUMS_SPECULAR) + results[first + 1u];
            textureStore(samples, pixel, SUMS_SPECULAR, specular_sums);
            specular = specular_sums.rgb / sample_count;
        }
        textureStore(samples, pixel, SAMPLING, vec4<f32>(packets, textureLoad(samples, pixel, SAMPLING).yzw));
    }
    var deviation = length(reflect(pixel, diffuse - predicted.rgb, specular - predicted_specular));
    if (PHASORS) {
        if (NOISY) {
            add_phasor_sums(pixel, first);
        }
        deviation = max(deviation, worst_phasor_deviation(pixel, first, sample_count));
    }
    var error = deviation;
    if (NOISY) {
        let own_variance = variance_of_mean(reflect_variances(pixel, known_sampling(pixel)), packets, parameters.evenness, parameters.variance_rate);
        let variance_around = variance_of_mean(reflect_variances(pixel, sampling_around(pixel)), packets, parameters.evenness, parameters.variance_rate);
        let expected = reflect(pixel, predicted.rgb, predicted_specular);
        let is_doubtful = own_variance == 0.0 && variance_around > RARE * dot(expected, expected);
        let variance = select(own_variance, variance_around, is_doubtful);
        error = sqrt(max(deviation * deviation - NOISE_SQUARED * variance, 0.0));
    }
    if (SPECULAR) {
        textureStore(gathered, pixel, SPECULAR_LOBE, vec4<f32>(specular, 0.0));
    }
    if (PHASORS) {
        store_phasors(pixel, first, sample_count);
    }
    var state = PixelState(GATHERED_UNPREDICTED, 0.0);
    if (kind == PREDICTED) {
        let radiance = length(reflect(pixel, diffuse, specular)) * 0.57735027;
        state = PixelState(GATHERED_PREDICTED, error * 0.57735027 / max(parameters.own_share * radiance, parameters.least_radiance));
    }
    textureStore(gathered, pixel, DIFFUSE_LOBE, vec4<f32>(diffuse, encode_state(state)));
}
