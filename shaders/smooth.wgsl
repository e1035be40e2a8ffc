// Models gathers by the pixels around, to lower their noise: of a pixel's own gather, only the part that exceeds noise is kept (after Lee,
// "Digital image enhancement and noise filtering by use of local statistics", 1980). The gathers themselves measure the noise. The model is
// linear in the place in the image and in the normal (after Bitterli et al., "Nonlinearly weighted first-order regression for denoising
// Monte Carlo renderings", 2016): light from afar changes as the normal does, even on facets as small as pixels. The model is fitted to
// samples, not to smoothed values. The smooth_residuals pass makes the smoothed light of it.
//
// Where that is better, the model is of the light over A, the light of the VPLs without occlusion: what is hidden varies less from facet to
// facet than what arrives. (A ratio estimator, after Heitz et al., "Combining analytic direct illumination and stochastic shadows", 2018.)

#import refinement
#import reflect
#import sampling
#import smoothing

struct SmoothParameters {
    // Pixels between the points of the grid.
    stride: u32,
    columns: u32,
    item_count: u32,
    // Noise of gathers, as in variance_of_mean.
    evenness: f32,
    variance_rate: f32,
    // 1: the model is of the light over A.
    by_ratio: u32,
}

var normal_geometric: texture_2d<f32>;
var modelled: texture_storage_2d_array<rgba32float, write>;
var<immediate> parameters: SmoothParameters;

// Points of the grid to each side.
const REACH: i32 = 2;
const EDGE: i32 = 2 * REACH + 1;
const POINTS: i32 = EDGE * EDGE;
// Farness of a pixel, as in weight_of, at which it has 1/e of the weight.
const DISTANCE: f32 = 3.0;
// Added to the features' variances, so that features that do not vary explain nothing.
const RIDGE: f32 = 1e-3;
// Unknowns of a fit: a mean and a slope for each feature. And about how many pixels a fit needs.
const UNKNOWNS: f32 = 5.0;
const LEAST_PIXELS: f32 = 7.0;
// Part of a pixel's squared deviation that chance explains, over the variance of its noise: four standard deviations.
const CHANCE_SQUARED: f32 = 16.0;
// Least A over that of the pixel, so that nothing is divided by 0. Largest weight of a pixel with more light than the smoothed one.
const LEAST_UNOCCLUDED: f32 = 1e-3;
const MAX_RATIO_WEIGHT: f32 = 4.0;
// Largest noise around a pixel, over its own.
const MAX_OVER_OWN: f32 = 4.0;

// Variances of what was gathered: diffuse, specular.
fn variances(known: Sampling) -> vec2<f32> {
    return vec2<f32>(variance_of_mean(known.variances.x, known.packets, parameters.evenness, parameters.variance_rate),
        variance_of_mean(known.variances.y, known.packets, parameters.evenness, parameters.variance_rate));
}

// A value to smooth: light per band, or with phasors also Z of two frequencies. And a column of features for each of its components.
#if PHASORS
alias Value = vec4<f32>;
alias Products = mat4x4<f32>;
const COMPONENTS: i32 = 4;

fn value_of_light(light: vec3<f32>) -> Value {
    return vec4<f32>(light, 0.0);
}
#else
alias Value = vec3<f32>;
alias Products = mat3x4<f32>;
const COMPONENTS: i32 = 3;

fn value_of_light(light: vec3<f32>) -> Value {
    return light;
}
#endif

// Sums over pixels of weight · value, of that times each feature, and of weight · value².
struct Sums {
    value: Value,
    products: Products,
    squares: f32,
}

fn add(sums: ptr<function, Sums>, value: Value, features: vec4<f32>, weight: f32) {
    let weighted = weight * value;
    (*sums).value += weighted;
    for (var i = 0; i < COMPONENTS; i++) {
        (*sums).products[i] += weighted[i] * features;
    }
    (*sums).squares += dot(weighted, value);
}

// Statistics of the features of the pixels around, relative to the pixel's own.
struct Fit {
    weight: f32,
    // Number of pixels of equal weight with the same information.
    count: f32,
    mean: vec4<f32>,
    // Variance of the model's value over that of a pixel's.
    leverage: f32,
    // Their covariances plus RIDGE are ((a, b), (bᵀ, d)). Stored: a⁻¹, b and (d − bᵀ·a⁻¹·b)⁻¹.
    inverse_a: mat2x2<f32>,
    b: mat2x2<f32>,
    inverse_rest: mat2x2<f32>,
}

fn inverse2(m: mat2x2<f32>) -> mat2x2<f32> {
    return (1.0 / determinant(m)) * mat2x2<f32>(m[1].y, -m[0].y, -m[1].x, m[0].x);
}

// Slopes of a value that has these covariances with the features.
fn slopes(fit: Fit, covariances: vec4<f32>) -> vec4<f32> {
    let rest = fit.inverse_rest * (covariances.zw - covariances.xy * fit.inverse_a * fit.b);
    return vec4<f32>(fit.inverse_a * (covariances.xy - fit.b * rest), rest);
}

// The model's value of a pixel, and the weight of the pixel's own value in the smoothed one.
struct Smoothed {
    modelled: Value,
    gain: f32,
    // Squared error of the model, less that of its noise.
    error: f32,
}

// The gain is large where the pixels around, or the pixel itself, scatter about the model by more than noise. `variance` is that of a
// value's noise, all components together.
fn smooth_value(own: Value, sums: Sums, fit: Fit, variance: f32) -> Smoothed {
    let mean = sums.value / fit.weight;
    var explained = dot(mean, mean);
    var modelled = mean;
    for (var i = 0; i < COMPONENTS; i++) {
        let covariances = sums.products[i] / fit.weight - mean[i] * fit.mean;
        let along = slopes(fit, covariances);
        explained += dot(along, covariances + RIDGE * along);
        modelled[i] -= dot(along, fit.mean);
    }
    let scatter = max(sums.squares / fit.weight - explained, 0.0) * fit.count / (fit.count - UNKNOWNS);
    let deviation = own - modelled;
    let error = max(max(scatter - variance, dot(deviation, deviation) - CHANCE_SQUARED * variance), 0.0);
    return Smoothed(modelled, wiener_gain(error + fit.leverage * variance, variance), error);
}

// Offset of a surrounding grid point, in steps of the grid.
fn place_around(index: i32) -> vec2<i32> {
    return vec2<i32>(index % EDGE, index / EDGE) - REACH;
}

fn features_of(index: i32, turned: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(vec2<f32>(place_around(index)) / f32(REACH), turned);
}

// Sum over both frequencies, as if the bands were alike.
fn phasor_variance(pixel: vec2<u32>, layer: u32, lobe: u32, packets: f32) -> f32 {
    let of_frequencies = textureLoad(samples, pixel, phasor_squares_layer(lobe));
    let squares = select(of_frequencies.xy, of_frequencies.zw, pair_of(layer) == 1u);
    let of_sample = (squares.x + squares.y) / (f32(modulation.band_count) * PACKET_SAMPLES * max(packets, 1.0));
    return variance_of_mean(of_sample, packets, parameters.evenness, parameters.variance_rate);
}

// A, all bands together.
fn unoccluded_at(pixel: vec2<u32>) -> f32 {
    return dot(textureLoad(samples, pixel, UNOCCLUDED).rgb, vec3<f32>(1.0));
}

// Factor from the light of another pixel to this one's, if the same part of A is hidden.
fn ratio_to(unoccluded: f32, other: vec2<u32>) -> f32 {
    let floor = LEAST_UNOCCLUDED * unoccluded + 1e-30;
    return select(1.0, (unoccluded + floor) / (unoccluded_at(other) + floor), parameters.by_ratio == 1u);
}

// Weights of the pixels around, factors to their diffuse light, and their features of the normal.
struct Neighbours {
    weights: array<f32, POINTS>,
    ratios: array<f32, POINTS>,
    turned: array<vec2<f32>, POINTS>,
}

// For all layers of a lobe; the gain is the largest.
struct SmoothedPhasors {
    modelled: array<vec4<f32>, MAX_PHASOR_LAYERS>,
    gain: f32,
}

#if PHASORS
fn smooth_phasors(pixel: vec2<u32>, lobe: u32, neighbours: Neighbours, fit: Fit) -> SmoothedPhasors {
    var around = neighbours;
    let size = vec2<i32>(textureDimensions(position_instance));
    let own_packets = textureLoad(samples, pixel, SAMPLING).x;
    var phasors = SmoothedPhasors();
    for (var layer = 0u; layer < phasor_layer_count(); layer++) {
        var sums: Sums;
        var variance_sum = 0.0;
        for (var i = 0; i < POINTS; i++) {
            let place = vec2<i32>(pixel) + i32(parameters.stride) * place_around(i);
            let other = vec2<u32>(clamp(place, vec2<i32>(0), size - 1));
            let packets = textureLoad(samples, other, SAMPLING).x;
            let weight = around.weights[i];
            let ratio = select(around.ratios[i], 1.0, lobe == SPECULAR_LOBE);
            add(&sums, ratio * sampled_phasors(other, layer, lobe, packets), features_of(i, around.turned[i]), weight);
            variance_sum += weight * ratio * ratio * phasor_variance(other, layer, lobe, packets);
        }
        let mean_variance = variance_sum / fit.weight;
        let own_variance = phasor_variance(pixel, layer, lobe, own_packets);
        let is_doubtful = own_variance == 0.0 && mean_variance > RARE * sums.squares / fit.weight;
        let variance = select(min(mean_variance, MAX_OVER_OWN * own_variance), mean_variance, is_doubtful);
        let own = sampled_phasors(pixel, layer, lobe, own_packets);
        let smoothed = smooth_value(own, sums, fit, variance);
        phasors.modelled[layer] = smoothed.modelled;
        // Without modulated light there is nothing to keep.
        let is_dark = sums.squares == 0.0 && dot(own, own) == 0.0;
        phasors.gain = max(phasors.gain, select(smoothed.gain, 0.0, is_dark));
    }
    return phasors;
}

fn store_phasors(pixel: vec2<u32>, lobe: u32, phasors: SmoothedPhasors) {
    var smoothed = phasors;
    for (var layer = 0u; layer < phasor_layer_count(); layer++) {
        textureStore(modelled, pixel, phasor_layer(layer, lobe), smoothed.modelled[layer]);
    }
}
#else
fn smooth_phasors(pixel: vec2<u32>, lobe: u32, neighbours: Neighbours, fit: Fit) -> SmoothedPhasors {
    return SmoothedPhasors();
}

fn store_phasors(pixel: vec2<u32>, lobe: u32, phasors: SmoothedPhasors) {}
#endif

// Models what a lobe reflects. `variance` is that of the light. Returns the squared error of the model.
fn smooth_lobe(pixel: vec2<u32>, lobe: u32, sums: Sums, neighbours: Neighbours, fit: Fit, variance: f32, packets: f32) -> f32 {
    let own = value_of_light(sampled_light(pixel, lobe, packets));
    let smoothed = smooth_value(own, sums, fit, variance);
    var gain = smoothed.gain;
    var phasors: SmoothedPhasors;
    if (PHASORS) {
        // One gain for light and Z: Z equals the light where its phases are alike.
        phasors = smooth_phasors(pixel, lobe, neighbours, fit);
        gain = max(gain, phasors.gain);
    }
    textureStore(modelled, pixel, lobe, vec4<f32>(smoothed.modelled.xyz, gain));
    store_phasors(pixel, lobe, phasors);
    // If Z deviates more than the light, the error of light that has this gain.
    let of_gain = variance * (gain / max(1.0 - gain, 1e-6) - fit.leverage);
    return select(smoothed.error, max(of_gain, smoothed.error), gain > smoothed.gain);
}

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let item = 64u * (group.y * groups.x + group.x) + local;
    let pixel = parameters.stride * vec2<u32>(item % parameters.columns, item / parameters.columns);
    let size = textureDimensions(position_instance);
    if (item >= parameters.item_count) {
        return;
    }
    let position = textureLoad(position_instance, pixel).xyz;
    let normal = textureLoad(normal_geometric, pixel, 0).xyz;
    let around = frame_around(normal);
    let own_sampling = known_sampling(pixel);
    let own_lobe = lobe_at(pixel);
    let spacing = spacing_at(pixel, position, parameters.stride);
    let is_here = textureLoad(samples, pixel, SAMPLING).x > 0.0;
    let end = select(0, POINTS, is_here && spacing.sampled > 0u);
    var neighbours: Neighbours;
    var diffuse_sums: Sums;
    var specular_sums: Sums;
    var sum_of_variances = vec2<f32>(0.0);
    var fit: Fit;
    var squared_weights = 0.0;
    // Sums of products of features: the first two with themselves, the first two with the last two, the last two with themselves.
    var squares_a = mat2x2<f32>();
    var squares_b = mat2x2<f32>();
    var squares_d = mat2x2<f32>();
    let unoccluded = unoccluded_at(pixel);
    for (var i = 0; i < end; i++) {
        let at = place_around(i);
        let place = vec2<i32>(pixel) + i32(parameters.stride) * at;
        let is_inside = all(place >= vec2<i32>(0)) && all(place < vec2<i32>(size));
        let other = select(pixel, vec2<u32>(place), is_inside);
        let known = known_sampling(other);
        let is_sampled = textureLoad(samples, other, SAMPLING).x > 0.0;
        let offset = textureLoad(position_instance, other).xyz - position;
        let other_normal = textureLoad(normal_geometric, other, 0).xyz;
        let turn = other_normal - normal;
        let is_wanted = is_sampled && any(other != pixel) && is_one_lobe(own_lobe, lobe_at(other));
        let ratio = ratio_to(unoccluded, other);
        // By the noise of what the ratio makes of the other's light.
        let weight = select(0.0, weight_of(turn, offset, DISTANCE, spacing) * min(1.0 / (ratio * ratio), MAX_RATIO_WEIGHT), is_wanted);
        let turned = vec2<f32>(dot(other_normal, around.right), dot(other_normal, around.up));
        let features = features_of(i, turned);
        neighbours.weights[i] = weight;
        neighbours.ratios[i] = ratio;
        neighbours.turned[i] = turned;
        fit.weight += weight;
        squared_weights += weight * weight;
        fit.mean += weight * features;
        squares_a += weight * mat2x2<f32>(features.x * features.xy, features.y * features.xy);
        squares_b += weight * mat2x2<f32>(features.z * features.xy, features.w * features.xy);
        squares_d += weight * mat2x2<f32>(features.z * features.zw, features.w * features.zw);
        sum_of_variances += weight * vec2<f32>(ratio * ratio, 1.0) * variances(known);
        add(&diffuse_sums, value_of_light(ratio * sampled_light(other, DIFFUSE_LOBE, known.packets)), features, weight);
        if (SPECULAR) {
            add(&specular_sums, value_of_light(sampled_light(other, SPECULAR_LOBE, known.packets)), features, weight);
        }
    }
    fit.count = fit.weight * fit.weight / max(squared_weights, 1e-30);
    if (fit.count < LEAST_PIXELS) {
        textureStore(modelled, pixel, DIFFUSE_LOBE, vec4<f32>(0.0, 0.0, 0.0, -1.0));
        return;
    }
    let scale = 1.0 / fit.weight;
    fit.mean *= scale;
    let low = fit.mean.xy;
    let high = fit.mean.zw;
    let ridge = mat2x2<f32>(RIDGE, 0.0, 0.0, RIDGE);
    fit.inverse_a = inverse2(scale * squares_a - mat2x2<f32>(low.x * low, low.y * low) + ridge);
    fit.b = scale * squares_b - mat2x2<f32>(high.x * low, high.y * low);
    let d = scale * squares_d - mat2x2<f32>(high.x * high, high.y * high) + ridge;
    fit.inverse_rest = inverse2(d - transpose(fit.b) * fit.inverse_a * fit.b);
    fit.leverage = min((1.0 + dot(fit.mean, slopes(fit, fit.mean))) / fit.count, 1.0);

    // A pixel that is certainly dark stays so beside bright ones. If few samples find the light, a pixel whose samples found none is not
    // certainly dark.
    let own_variance = variances(own_sampling);
    let mean_variance = scale * sum_of_variances;
    let squares = vec2<f32>(diffuse_sums.squares, specular_sums.squares);
    let is_doubtful = own_variance == vec2<f32>(0.0) & mean_variance > RARE * scale * squares;
    let variance = select(min(mean_variance, MAX_OVER_OWN * own_variance), mean_variance, is_doubtful);
    var errors = vec2<f32>(0.0);
    errors.x = smooth_lobe(pixel, DIFFUSE_LOBE, diffuse_sums, neighbours, fit, variance.x, own_sampling.packets);
    if (SPECULAR) {
        errors.y = smooth_lobe(pixel, SPECULAR_LOBE, specular_sums, neighbours, fit, variance.y, own_sampling.packets);
    }
    textureStore(samples, pixel, MODEL, vec4<f32>(errors, fit.leverage, 1.0));
}
