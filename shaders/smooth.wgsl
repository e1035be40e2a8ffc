// Lowers the noise of gathers: what a model of the pixels around explains is kept, and of the rest as much as is more than noise (after
// Lee, "Digital image enhancement and noise filtering by use of local statistics", 1980). How much noise there is, the gathers say
// themselves. The model is linear in the place in the image and in the normal (after Bitterli et al., "Nonlinearly weighted first-order
// regression for denoising Monte Carlo renderings", 2016): light that comes from afar changes as the normal does, on facets as small as
// pixels, too. It is fitted to what was sampled, not to what was smoothed before.

#import refinement
#import reflect
#import sampling

struct SmoothParameters {
    // Pixels between the points of the grid.
    stride: u32,
    columns: u32,
    item_count: u32,
    // Of gathers, as variance_of_mean has it.
    evenness: f32,
    variance_rate: f32,
}

var normal_geometric: texture_2d<f32>;
var gathered: texture_storage_2d_array<rgba32float, read_write>;
var<immediate> parameters: SmoothParameters;

// Points of the grid to either side.
const REACH: i32 = 2;
const EDGE: i32 = 2 * REACH + 1;
// A pixel counts exp(−(turn/TURN)² − (distance/DISTANCE)²): of normals, and of points, over that of the nearest neighbour.
const TURN: f32 = 0.6;
const DISTANCE: f32 = 3.0;
// Added to the features' variances, so that those that do not vary explain nothing.
const RIDGE: f32 = 1e-3;
// What a fit has to tell: a mean and a slope for each feature. And pixels, about, that make one.
const UNKNOWNS: f32 = 5.0;
const LEAST_PIXELS: f32 = 7.0;
// What chance does to a pixel, over the variance of its noise: four standard deviations.
const CHANCE_SQUARED: f32 = 16.0;
// Noise around a pixel over its own.
const MAX_OVER_OWN: f32 = 4.0;

// Of what was gathered: diffuse, specular.
fn variances(known: Sampling) -> vec2<f32> {
    return vec2<f32>(variance_of_mean(known.variances.x, known.packets, parameters.evenness, parameters.variance_rate),
        variance_of_mean(known.variances.y, known.packets, parameters.evenness, parameters.variance_rate));
}

fn sampled_mean(pixel: vec2<u32>, layer: u32, packets: f32) -> vec3<f32> {
    return textureLoad(samples, pixel, layer).rgb / (PACKET_SAMPLES * max(packets, 1.0));
}

// Sums over pixels of weight · value, of that times each feature, and of weight · value².
struct Sums {
    value: vec3<f32>,
    red: vec4<f32>,
    green: vec4<f32>,
    blue: vec4<f32>,
    squares: f32,
}

fn add(sums: ptr<function, Sums>, value: vec3<f32>, features: vec4<f32>, weight: f32) {
    let weighted = weight * value;
    (*sums).value += weighted;
    (*sums).red += weighted.r * features;
    (*sums).green += weighted.g * features;
    (*sums).blue += weighted.b * features;
    (*sums).squares += dot(weighted, value);
}

// Of the features of the pixels around, relative to the pixel's own.
struct Fit {
    weight: f32,
    // Pixels of equal weight that would tell as much.
    count: f32,
    mean: vec4<f32>,
    // Their covariances and RIDGE are ((a, b), (bᵀ, d)): a⁻¹, b and (d − bᵀ·a⁻¹·b)⁻¹.
    inverse_a: mat2x2<f32>,
    b: mat2x2<f32>,
    inverse_rest: mat2x2<f32>,
}

fn inverse2(m: mat2x2<f32>) -> mat2x2<f32> {
    return (1.0 / determinant(m)) * mat2x2<f32>(m[1].y, -m[0].y, -m[1].x, m[0].x);
}

// Slopes of what has such covariances with the features.
fn slopes(fit: Fit, covariances: vec4<f32>) -> vec4<f32> {
    let rest = fit.inverse_rest * (covariances.zw - covariances.xy * fit.inverse_a * fit.b);
    return vec4<f32>(fit.inverse_a * (covariances.xy - fit.b * rest), rest);
}

// What the model says of the pixel, moved towards the pixel's own value by as much as the pixels around scatter about it for other reasons
// than noise, or the pixel itself does. `variance` is that of a value's noise, all bands together.
fn smooth_value(own: vec3<f32>, sums: Sums, fit: Fit, variance: f32) -> vec3<f32> {
    let mean = sums.value / fit.weight;
    let red = sums.red / fit.weight - mean.r * fit.mean;
    let green = sums.green / fit.weight - mean.g * fit.mean;
    let blue = sums.blue / fit.weight - mean.b * fit.mean;
    let slope_red = slopes(fit, red);
    let slope_green = slopes(fit, green);
    let slope_blue = slopes(fit, blue);
    let explained = dot(mean, mean) + dot(slope_red, red + RIDGE * slope_red) + dot(slope_green, green + RIDGE * slope_green)
        + dot(slope_blue, blue + RIDGE * slope_blue);
    let scatter = max(sums.squares / fit.weight - explained, 0.0) * fit.count / (fit.count - UNKNOWNS);
    let modelled = mean - vec3<f32>(dot(slope_red, fit.mean), dot(slope_green, fit.mean), dot(slope_blue, fit.mean));
    let deviation = own - modelled;
    let signal = max(max(scatter - variance, dot(deviation, deviation) - CHANCE_SQUARED * variance), 0.0);
    let gain = wiener_gain(signal, variance);
    return max(mix(modelled, own, gain), vec3<f32>(0.0));
}

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
#if PHONG
    let own_lobe = textureLoad(ks_shininess, pixel);
    var specular_sums: Sums;
#endif
    // The square of the distance to the nearest neighbour, and how many of them were sampled.
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
    let end = select(0, EDGE * EDGE, sampled_neighbours > 0u);
    var diffuse_sums: Sums;
    var sum_of_variances = vec2<f32>(0.0);
    var fit: Fit;
    var squared_weights = 0.0;
    // Of products of features: the first two with themselves, with the others, and those with themselves.
    var squares_a = mat2x2<f32>();
    var squares_b = mat2x2<f32>();
    var squares_d = mat2x2<f32>();
    for (var i = 0; i < end; i++) {
        let at = vec2<i32>(i % EDGE, i / EDGE) - REACH;
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
        let features = vec4<f32>(vec2<f32>(at) / f32(REACH), dot(other_normal, around.right), dot(other_normal, around.up));
        fit.weight += weight;
        squared_weights += weight * weight;
        fit.mean += weight * features;
        squares_a += weight * mat2x2<f32>(features.x * features.xy, features.y * features.xy);
        squares_b += weight * mat2x2<f32>(features.z * features.xy, features.w * features.xy);
        squares_d += weight * mat2x2<f32>(features.z * features.zw, features.w * features.zw);
        sum_of_variances += weight * variances(known);
        add(&diffuse_sums, sampled_mean(other, SUMS_DIFFUSE, known.packets), features, weight);
#if PHONG
        add(&specular_sums, sampled_mean(other, SUMS_SPECULAR, known.packets), features, weight);
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

    let own_variance = variances(own_sampling);
    let mean_variance = scale * sum_of_variances;
    // A pixel that is dark without doubt stays so beside bright ones. Where few samples find the light, one that has found none is not.
    var squares = vec2<f32>(diffuse_sums.squares, 0.0);
#if PHONG
    squares.y = specular_sums.squares;
#endif
    let is_doubtful = own_variance == vec2<f32>(0.0) & mean_variance > RARE * scale * squares;
    let variance = select(min(mean_variance, MAX_OVER_OWN * own_variance), mean_variance, is_doubtful);
    let state = textureLoad(gathered, pixel, DIFFUSE).w;
    let own = sampled_mean(pixel, SUMS_DIFFUSE, own_sampling.packets);
    textureStore(gathered, pixel, DIFFUSE, vec4<f32>(smooth_value(own, diffuse_sums, fit, variance.x), state));
#if PHONG
    let own_specular = sampled_mean(pixel, SUMS_SPECULAR, own_sampling.packets);
    textureStore(gathered, pixel, SPECULAR, vec4<f32>(smooth_value(own_specular, specular_sums, fit, variance.y), 0.0));
#endif
}
