// Lowers the noise of gathers. It keeps what a model of the pixels around explains, and of the rest the part that exceeds noise (after Lee,
// "Digital image enhancement and noise filtering by use of local statistics", 1980). The gathers themselves measure the noise. The model is
// linear in the place in the image and in the normal (after Bitterli et al., "Nonlinearly weighted first-order regression for denoising
// Monte Carlo renderings", 2016): light from afar changes as the normal does, even on facets as small as pixels. The model is fitted to
// samples, not to smoothed values.

#import refinement
#import reflect
#import sampling

struct SmoothParameters {
    // Pixels between the points of the grid.
    stride: u32,
    columns: u32,
    item_count: u32,
    // Noise of gathers, as in variance_of_mean.
    evenness: f32,
    variance_rate: f32,
}

var normal_geometric: texture_2d<f32>;
var gathered: texture_storage_2d_array<rgba32float, read_write>;
var<immediate> parameters: SmoothParameters;

// Points of the grid to each side.
const REACH: i32 = 2;
const EDGE: i32 = 2 * REACH + 1;
const POINTS: i32 = EDGE * EDGE;
// A pixel has the weight exp(−(turn/TURN)² − (distance/DISTANCE)²). turn is the difference of the normals; distance is between the points,
// over that to the nearest neighbour.
const TURN: f32 = 0.6;
const DISTANCE: f32 = 3.0;
// Added to the features' variances, so that features that do not vary explain nothing.
const RIDGE: f32 = 1e-3;
// Unknowns of a fit: a mean and a slope for each feature. And about how many pixels a fit needs.
const UNKNOWNS: f32 = 5.0;
const LEAST_PIXELS: f32 = 7.0;
// Part of a pixel's squared deviation that chance explains, over the variance of its noise: four standard deviations.
const CHANCE_SQUARED: f32 = 16.0;
// Largest noise around a pixel, over its own.
const MAX_OVER_OWN: f32 = 4.0;

// Variances of what was gathered: diffuse, specular.
fn variances(known: Sampling) -> vec2<f32> {
    return vec2<f32>(variance_of_mean(known.variances.x, known.packets, parameters.evenness, parameters.variance_rate),
        variance_of_mean(known.variances.y, known.packets, parameters.evenness, parameters.variance_rate));
}

fn sampled_light(pixel: vec2<u32>, layer: u32, packets: f32) -> Value {
    let light = textureLoad(samples, pixel, layer).rgb / (PACKET_SAMPLES * max(packets, 1.0));
#if PHASORS
    return vec4<f32>(light, 0.0);
#else
    return light;
#endif
}

// A value to smooth: light per band, or with phasors also Z of two frequencies.
#if PHASORS
alias Value = vec4<f32>;
#else
alias Value = vec3<f32>;
#endif

// Sums over pixels of weight · value, of that times each feature, and of weight · value².
struct Sums {
    value: Value,
    first: vec4<f32>,
    second: vec4<f32>,
    third: vec4<f32>,
#if PHASORS
    fourth: vec4<f32>,
#endif
    squares: f32,
}

fn add(sums: ptr<function, Sums>, value: Value, features: vec4<f32>, weight: f32) {
    let weighted = weight * value;
    (*sums).value += weighted;
    (*sums).first += weighted.x * features;
    (*sums).second += weighted.y * features;
    (*sums).third += weighted.z * features;
#if PHASORS
    (*sums).fourth += weighted.w * features;
#endif
    (*sums).squares += dot(weighted, value);
}

// Statistics of the features of the pixels around, relative to the pixel's own.
struct Fit {
    weight: f32,
    // Number of pixels of equal weight with the same information.
    count: f32,
    mean: vec4<f32>,
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
}

// The gain is large where the pixels around, or the pixel itself, scatter about the model by more than noise. `variance` is that of a
// value's noise, all components together.
fn smooth_value(own: Value, sums: Sums, fit: Fit, variance: f32) -> Smoothed {
    let mean = sums.value / fit.weight;
    let first = sums.first / fit.weight - mean.x * fit.mean;
    let second = sums.second / fit.weight - mean.y * fit.mean;
    let third = sums.third / fit.weight - mean.z * fit.mean;
    let first_slopes = slopes(fit, first);
    let second_slopes = slopes(fit, second);
    let third_slopes = slopes(fit, third);
    var explained = dot(mean, mean) + dot(first_slopes, first + RIDGE * first_slopes) + dot(second_slopes, second + RIDGE * second_slopes)
        + dot(third_slopes, third + RIDGE * third_slopes);
    var modelled = mean;
    modelled.x -= dot(first_slopes, fit.mean);
    modelled.y -= dot(second_slopes, fit.mean);
    modelled.z -= dot(third_slopes, fit.mean);
#if PHASORS
    let fourth = sums.fourth / fit.weight - mean.w * fit.mean;
    let fourth_slopes = slopes(fit, fourth);
    explained += dot(fourth_slopes, fourth + RIDGE * fourth_slopes);
    modelled.w -= dot(fourth_slopes, fit.mean);
#endif
    let scatter = max(sums.squares / fit.weight - explained, 0.0) * fit.count / (fit.count - UNKNOWNS);
    let deviation = own - modelled;
    let signal = max(max(scatter - variance, dot(deviation, deviation) - CHANCE_SQUARED * variance), 0.0);
    return Smoothed(modelled, wiener_gain(signal, variance));
}

// Offset of a surrounding grid point, in steps of the grid.
fn place_around(index: i32) -> vec2<i32> {
    return vec2<i32>(index % EDGE, index / EDGE) - REACH;
}

fn features_of(index: i32, turned: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(vec2<f32>(place_around(index)) / f32(REACH), turned);
}

#if PHASORS
fn sampled_phasors(pixel: vec2<u32>, layer: u32, lobe: u32, packets: f32) -> vec4<f32> {
    return textureLoad(samples, pixel, phasor_sums_layer(layer, lobe)) / (PACKET_SAMPLES * max(packets, 1.0));
}

// Sum over both frequencies, as if the bands were alike.
fn phasor_variance(pixel: vec2<u32>, layer: u32, lobe: u32, packets: f32) -> f32 {
    let of_frequencies = textureLoad(samples, pixel, phasor_squares_layer(lobe));
    let squares = select(of_frequencies.xy, of_frequencies.zw, pair_of(layer) == 1u);
    let of_sample = (squares.x + squares.y) / (f32(modulation.band_count) * PACKET_SAMPLES * max(packets, 1.0));
    return variance_of_mean(of_sample, packets, parameters.evenness, parameters.variance_rate);
}

// Weights of the pixels around, and their features of the normal.
struct Neighbours {
    weights: array<f32, POINTS>,
    turned: array<vec2<f32>, POINTS>,
}

// For all layers of a lobe; the gain is the largest.
struct SmoothedPhasors {
    modelled: array<vec4<f32>, MAX_PHASOR_LAYERS>,
    gain: f32,
}

fn smooth_phasors(pixel: vec2<u32>, lobe: u32, neighbours: Neighbours, fit: Fit) -> SmoothedPhasors {
    var around = neighbours;
    let size = vec2<i32>(textureDimensions(position_mesh));
    let own_packets = textureLoad(samples, pixel, SAMPLED).x;
    var phasors = SmoothedPhasors();
    for (var layer = 0u; layer < phasor_layer_count(); layer++) {
        var sums: Sums;
        var variance_sum = 0.0;
        for (var i = 0; i < POINTS; i++) {
            let place = vec2<i32>(pixel) + i32(parameters.stride) * place_around(i);
            let other = vec2<u32>(clamp(place, vec2<i32>(0), size - 1));
            let packets = textureLoad(samples, other, SAMPLED).x;
            let weight = around.weights[i];
            add(&sums, sampled_phasors(other, layer, lobe, packets), features_of(i, around.turned[i]), weight);
            variance_sum += weight * phasor_variance(other, layer, lobe, packets);
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

fn store_phasors(pixel: vec2<u32>, lobe: u32, phasors: SmoothedPhasors, gain: f32, light: vec3<f32>) {
    var smoothed = phasors;
    let packets = textureLoad(samples, pixel, SAMPLED).x;
    for (var layer = 0u; layer < phasor_layer_count(); layer++) {
        let kept = mix(smoothed.modelled[layer], sampled_phasors(pixel, layer, lobe, packets), gain);
        textureStore(gathered, pixel, phasor_layer(layer, lobe), limit_phasors(kept, light[band_of(layer)]));
    }
}
#endif

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let item = 64u * (group.y * groups.x + group.x) + local;
    let pixel = parameters.stride * vec2<u32>(item % parameters.columns, item / parameters.columns);
    let size = textureDimensions(position_mesh);
    if (item >= parameters.item_count || !is_gathered(decode_state(textureLoad(gathered, pixel, DIFFUSE).w))) {
        return;
    }
    let position = textureLoad(position_mesh, pixel).xyz;
    let normal = textureLoad(normal_geometric, pixel, 0).xyz;
    let around = frame_around(normal);
    let own_sampling = known_sampling(pixel);
    var own_lobe: vec4<f32>;
    var specular_sums: Sums;
#if PHONG
    own_lobe = textureLoad(ks_shininess, pixel);
#endif
    // Squared distance to the nearest neighbour, and number of neighbours that were sampled.
    var spacing_squared = 1e30;
    var sampled_neighbours = 0u;
    for (var i = 0; i < 4; i++) {
        let along = 2 * (i & 1) - 1;
        let place = vec2<i32>(pixel) + i32(parameters.stride) * select(vec2<i32>(along, 0), vec2<i32>(0, along), i > 1);
        let other = vec2<u32>(clamp(place, vec2<i32>(0), vec2<i32>(size) - 1));
        let there = textureLoad(position_mesh, other);
        let offset = there.xyz - position;
        let is_other = there.w != 0.0 && any(other != pixel);
        spacing_squared = select(spacing_squared, min(spacing_squared, dot(offset, offset)), is_other);
        sampled_neighbours += u32(is_other && textureLoad(samples, other, SAMPLED).x > 0.0);
    }
    let end = select(0, POINTS, sampled_neighbours > 0u);
#if PHASORS
    var neighbours: Neighbours;
#endif
    var diffuse_sums: Sums;
    var sum_of_variances = vec2<f32>(0.0);
    var fit: Fit;
    var squared_weights = 0.0;
    // Sums of products of features: the first two with themselves, the first two with the last two, the last two with themselves.
    var squares_a = mat2x2<f32>();
    var squares_b = mat2x2<f32>();
    var squares_d = mat2x2<f32>();
    for (var i = 0; i < end; i++) {
        let at = place_around(i);
        let place = vec2<i32>(pixel) + i32(parameters.stride) * at;
        let is_inside = all(place >= vec2<i32>(0)) && all(place < vec2<i32>(size));
        let other = select(pixel, vec2<u32>(place), is_inside);
        let known = known_sampling(other);
        let is_sampled = textureLoad(samples, other, SAMPLED).x > 0.0;
        let offset = textureLoad(position_mesh, other).xyz - position;
        let other_normal = textureLoad(normal_geometric, other, 0).xyz;
        let turn = other_normal - normal;
        var is_wanted = is_sampled && any(other != pixel);
#if PHONG
        is_wanted = is_wanted && is_one_lobe(own_lobe, textureLoad(ks_shininess, other));
#endif
        let farness = dot(turn, turn) / (TURN * TURN) + dot(offset, offset) / (DISTANCE * DISTANCE * spacing_squared);
        let weight = select(0.0, exp(-farness), is_wanted);
        let turned = vec2<f32>(dot(other_normal, around.right), dot(other_normal, around.up));
        let features = features_of(i, turned);
#if PHASORS
        neighbours.weights[i] = weight;
        neighbours.turned[i] = turned;
#endif
        fit.weight += weight;
        squared_weights += weight * weight;
        fit.mean += weight * features;
        squares_a += weight * mat2x2<f32>(features.x * features.xy, features.y * features.xy);
        squares_b += weight * mat2x2<f32>(features.z * features.xy, features.w * features.xy);
        squares_d += weight * mat2x2<f32>(features.z * features.zw, features.w * features.zw);
        sum_of_variances += weight * variances(known);
        add(&diffuse_sums, sampled_light(other, SUMS_DIFFUSE, known.packets), features, weight);
#if PHONG
        add(&specular_sums, sampled_light(other, SUMS_SPECULAR, known.packets), features, weight);
#endif
    }
    fit.count = fit.weight * fit.weight / max(squared_weights, 1e-30);
    if (fit.count < LEAST_PIXELS) {
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

    // A pixel that is certainly dark stays so beside bright ones. If few samples find the light, a pixel whose samples found none is not
    // certainly dark.
    let own_variance = variances(own_sampling);
    let mean_variance = scale * sum_of_variances;
    var squares = vec2<f32>(diffuse_sums.squares, 0.0);
#if PHONG
    squares.y = specular_sums.squares;
#endif
    let is_doubtful = own_variance == vec2<f32>(0.0) & mean_variance > RARE * scale * squares;
    let variance = select(min(mean_variance, MAX_OVER_OWN * own_variance), mean_variance, is_doubtful);
    let own = sampled_light(pixel, SUMS_DIFFUSE, own_sampling.packets);
    var smoothed = smooth_value(own, diffuse_sums, fit, variance.x);
#if PHASORS
    // One gain for light and Z: Z equals the light where its phases are alike.
    var phasors = smooth_phasors(pixel, 0u, neighbours, fit);
    smoothed.gain = max(smoothed.gain, phasors.gain);
#endif
    let diffuse = max(mix(smoothed.modelled, own, smoothed.gain).xyz, vec3<f32>(0.0));
    textureStore(gathered, pixel, DIFFUSE, vec4<f32>(diffuse, textureLoad(gathered, pixel, DIFFUSE).w));
#if PHASORS
    store_phasors(pixel, 0u, phasors, smoothed.gain, diffuse);
#endif
#if PHONG
    let own_specular = sampled_light(pixel, SUMS_SPECULAR, own_sampling.packets);
    var smoothed_specular = smooth_value(own_specular, specular_sums, fit, variance.y);
#if PHASORS
    phasors = smooth_phasors(pixel, 1u, neighbours, fit);
    smoothed_specular.gain = max(smoothed_specular.gain, phasors.gain);
#endif
    let specular = max(mix(smoothed_specular.modelled, own_specular, smoothed_specular.gain).xyz, vec3<f32>(0.0));
    textureStore(gathered, pixel, SPECULAR, vec4<f32>(specular, 0.0));
#if PHASORS
    store_phasors(pixel, 1u, phasors, smoothed_specular.gain, specular);
#endif
#endif
}
