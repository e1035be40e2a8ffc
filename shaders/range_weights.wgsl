// What a squared error of the bounce's Z is worth in each pixel, as one of light, because of the error of range that it makes. It decides
// where samples go.

#import range

struct RangeWeightParameters {
    // Least |Z|² of a pixel that counts, of each frequency.
    least_squares: vec4<f32>,
    // 1: the bounce's Z is known. 0: there is no image yet.
    has_bounce: u32,
}

var direct_phasors: texture_2d_array<f32>;
var indirect_phasors: texture_2d_array<f32>;
// For each frequency.
var range_weights: texture_storage_2d<rgba32float, write>;
var<immediate> parameters: RangeWeightParameters;

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if (any(pixel >= textureDimensions(range_weights))) {
        return;
    }
    var weights: array<vec2<f32>, 2>;
    for (var pair = 0u; pair < modulation.pair_count; pair++) {
        var total = textureLoad(direct_phasors, pixel, pair, 0);
        if (parameters.has_bounce == 1u) {
            total += textureLoad(indirect_phasors, pixel, pair, 0);
        }
        let squares = squared_magnitudes(total);
        let least = select(parameters.least_squares.xy, parameters.least_squares.zw, pair == 1u);
        let weight = squared_range_per_phasor(pair, max(squares, least));
        // A pixel below does not count. Before there is an image, its bounce may be more than that.
        let counted = select(min(squares / max(least, vec2<f32>(1e-37)), vec2<f32>(1.0)), vec2<f32>(1.0), parameters.has_bounce == 0u);
        weights[pair] = counted * weight;
    }
    textureStore(range_weights, pixel, modulation.error_scales * vec4<f32>(weights[0], weights[1]));
}
