// Estimates the error of the image from two independent gathers t₁, t₂ of a pixel: (x − t₁)(x − t₂) is the square of its error plus noise
// of mean 0.

#import reflect
#import refinement
#import sampling
#import range

struct ErrorEstimateParameters {
    receiver_count: u32,
    // Index of the first result of the second gather.
    second_result: u32,
    // 1: there is no image yet, and its errors mean nothing.
    is_pilot: u32,
}

var indirect_radiance: texture_storage_2d<rgba32float, read>;
var indirect_phasors: texture_storage_2d_array<rgba32float, read>;
// Only if the target is an error of range.
var direct_phasors: texture_2d_array<f32>;
const ESTIMATE_VECTORS: u32 = select(3u, 7u, PHASORS);
var<storage, read> receivers: array<u32>;
// In the refinement's layout. Noisy gathers: the sums over samples, and over their squared differences. If gathers have no noise, the
// second may be the first.
var<storage, read> results: array<vec4<f32>>;
// Noisy gathers: in the layout of the sample_counts pass, for both gathers.
var<storage, read> sample_ranges: array<u32>;
// Three vectors per receiver. The first: Σ over bands of (x − t₁)(x − t₂), of t₁·t₂ and of (t₁ − t₂)²; the variance of a sample. The second:
// the pixel; the expected error, as the resolve pass stores it; packets of samples of a gather. The third: of the image's samples, the
// variance of one and the number of packets; the squared error of the model and its leverage, which is below 0 without a model. With
// phasors, a vector like the first follows for Z of each frequency. If the target is an error of range, it is for the range, in metres, with
// |Z|² of all light as the second number.
var<storage, read_write> estimates: array<vec4<f32>>;
var<immediate> parameters: ErrorEstimateParameters;

// Z of two frequencies that a receiver's results reflect, as the pixel sees them.
fn seen_phasors(pixel: vec2<u32>, first: u32, pair: u32) -> vec4<f32> {
    var phasors = vec4<f32>(0.0);
    for (var i = 0u; i < modulation.band_count; i++) {
        let band = modulation.bands[i];
        let shares = seen_shares(pixel, band);
        for (var lobe = 0u; lobe < lobe_count(); lobe++) {
            phasors += shares[lobe] * results[first + phasor_result(pair, band, lobe)];
        }
    }
    return phasors;
}

// Differences of Z, two frequencies, as differences of range, m: d(range) = c/(4πf)·Im(dZ/Z).
fn range_differences(pair: u32, total: vec4<f32>, difference: vec4<f32>) -> vec2<f32> {
    let squares = squared_magnitudes(total);
    let turned = difference.yw * total.xz - difference.xz * total.yw;
    return select(vec2<f32>(0.0), metres_per_radian(pair) * turned / squares, squares > vec2<f32>(0.0));
}

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = parameters.receiver_count;
    if (id.x >= count) {
        return;
    }
    let packed = receivers[id.x];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    let first = RESULT_VECTORS * id.x;
    let second = RESULT_VECTORS * (id.x + parameters.second_result);
    let estimate = ESTIMATE_VECTORS * id.x;
    var per_sample = 1.0;
    var packets = 0.0;
    if (NOISY) {
        packets = f32(sample_ranges[id.x] >> 16u);
        per_sample = 1.0 / (PACKET_SAMPLES * packets);
    }
    let first_radiance = per_sample * reflect(pixel, results[first].rgb, results[first + 1u].rgb);
    let second_radiance = per_sample * reflect(pixel, results[second].rgb, results[second + 1u].rgb);
    let difference = first_radiance - second_radiance;
    let image_error = textureLoad(indirect_radiance, pixel);
    let image = image_error.rgb;
    estimates[estimate] = vec4<f32>(dot(image - first_radiance, image - second_radiance), dot(first_radiance, second_radiance), dot(difference, difference),
        0.5 * per_sample * reflect_squares(pixel, vec2<f32>(results[first].w + results[second].w, results[first + 1u].w + results[second + 1u].w)));
    estimates[estimate + 1u] = vec4<f32>(vec2<f32>(pixel), image_error.w, packets);
    estimates[estimate + 2u] = vec4<f32>(0.0, 0.0, 0.0, -1.0);
    if (NOISY) {
        let model = model_at(pixel);
        // As the sample_counts pass does, from the pixels around if they are known.
        var sampling = sampling_around(pixel);
        var variance = reflect_variances(pixel, sampling);
        if (variance == 0.0) {
            sampling = known_sampling(pixel);
            variance = reflect_variances(pixel, sampling);
        }
        estimates[estimate + 2u] = vec4<f32>(variance, textureLoad(samples, pixel, SAMPLING).x,
            reflect_model_errors(pixel, model, sampling), select(-1.0, model.leverage, model.is_known));
    }
    if (PHASORS) {
        for (var pair = 0u; pair < modulation.pair_count; pair++) {
            let image_phasors = textureLoad(indirect_phasors, pixel, pair);
            let first_phasors = per_sample * seen_phasors(pixel, first, pair);
            let second_phasors = per_sample * seen_phasors(pixel, second, pair);
            let change = first_phasors - second_phasors;
            var errors = (image_phasors - first_phasors) * (image_phasors - second_phasors);
            var signals = first_phasors * second_phasors;
            var noise = change * change;
            var per_variance = vec2<f32>(1.0);
            if (RANGE) {
                let bounce = select(image_phasors, 0.5 * (first_phasors + second_phasors), parameters.is_pilot == 1u);
                let total = textureLoad(direct_phasors, pixel, pair, 0) + bounce;
                let ranges = range_differences(pair, total, image_phasors - first_phasors) * range_differences(pair, total, image_phasors - second_phasors);
                let scatter = range_differences(pair, total, change);
                errors = vec4<f32>(ranges.x, 0.0, ranges.y, 0.0);
                signals = total * total;
                noise = vec4<f32>(scatter.x * scatter.x, 0.0, scatter.y * scatter.y, 0.0);
                per_variance = squared_range_per_phasor(pair, squared_magnitudes(total));
            }
            for (var i = 0u; i < 2u; i++) {
                let frequency = 2u * pair + i;
                let of_frequency = select(vec4<f32>(1.0, 1.0, 0.0, 0.0), vec4<f32>(0.0, 0.0, 1.0, 1.0), i == 1u);
                var variance = 0.0;
                if (NOISY) {
                    let squares = vec2<f32>(results[first + PHASOR_SQUARES][frequency] + results[second + PHASOR_SQUARES][frequency],
                        results[first + PHASOR_SQUARES + 1u][frequency] + results[second + PHASOR_SQUARES + 1u][frequency]);
                    variance = 0.5 * per_sample * per_variance[i] * reflect_phasor_squares(pixel, squares);
                }
                estimates[estimate + 3u + frequency] = vec4<f32>(dot(of_frequency, errors), dot(of_frequency, signals),
                    dot(of_frequency, noise), variance);
            }
        }
    }
}
