// Predicts a pixel of a finer grid from its neighbours on the coarser one. If these are on one surface, and such predictions have been
// right so far, the pixel is interpolated. Otherwise it becomes a candidate for the gather.

#import refinement
#import reflect
#import sampling
#import one_surface

struct PredictParameters {
    // Pixels from a new point to its neighbours, along an axis.
    reach: u32,
    // CENTRES or EDGES.
    pattern: u32,
    // New points per row, and in total.
    columns: u32,
    item_count: u32,
    // Largest expected error of an interpolated pixel, over the radiance that errors are relative to; negative: nothing is interpolated; at
    // least ANY_ERROR: everything is.
    tolerance: f32,
    // Errors are relative to this, W/sr/m², or to own_share times the pixel's own radiance, if that is more.
    least_radiance: f32,
    own_share: f32,
}

var gathered: texture_storage_2d_array<rgba32float, read_write>;
// Pixels to gather, as column + 65536 · row; or NO_PIXEL.
var<storage, read_write> candidates: array<u32>;
var<immediate> parameters: PredictParameters;

// First the centres of the squares of the current grid, with neighbours along the diagonals. Then the middles of the edges, with neighbours
// along the axes.
const CENTRES: u32 = 0u;
const EDGES: u32 = 1u;
const ANY_ERROR: f32 = 1.0;
// Expected error of a prediction where none was tested, over the pixel's radiance or what errors are relative to.
const UNTESTED: f32 = 0.5;
// If everything is interpolated: weight of a neighbour on another surface over that of one on the same. It counts only where it is alone.
const FAINT: f32 = 1e-6;
const LEAST_WEIGHT: f32 = 1e-12;
// Largest leverage of a plane through the neighbours.
const MAX_LEVERAGE: f32 = 2.5;
// Relative error of an interpolation over the difference between the normal and the interpolated normal. (Measured on the knot: an error of
// 2 % for a difference of 1 % gathers 3 % more pixels and has 6 % less error.)
const TURNING: f32 = 2.0;
// Error of an interpolation over the rms deviation of the neighbours from their plane: among few neighbours, an edge of the light bends the
// plane more than it stands out.
const SCATTER: f32 = 1.0;
// Least value that the plane predicts for the square of a coordinate, in squared reaches. Below it, the prediction does not test
// interpolation.
const LEAST_BEND: f32 = 0.1;
// Known pixels around a new one: the nearest four, and the next eight.
const NEIGHBOURS: u32 = 12u;
// A curvature is used if it adds at most this to the leverage of a plane. (All twelve neighbours: 1.41.)
const MAX_LEVERAGE_OF_CURVATURE: f32 = 2.0;

// In reaches. New centres are in the middle of a square lattice: (±1, ±1), (±3, ±1), (±1, ±3). New middles of edges are in a lattice turned
// by 45°: (±1, 0), (0, ±1), (±2, ±1), (±1, ±2).
fn neighbour_offset(index: u32, is_axial: bool) -> vec2<i32> {
    let signs = vec2<i32>(select(-1, 1, (index & 1u) == 1u), select(-1, 1, (index & 2u) == 2u));
    let long = select(3, 2, is_axial);
    if (index >= 8u) {
        return signs * vec2<i32>(1, long);
    }
    if (index >= 4u) {
        return signs * vec2<i32>(long, 1);
    }
    return select(signs, select(vec2<i32>(signs.x, 0), vec2<i32>(0, signs.x), signs.y > 0), is_axial);
}

// Sums over neighbours of weight, times their places, times products of these; and of weight · r², of that times their places, and times r²,
// where r is their distance.
struct Moments {
    weight: f32,
    place: vec2<f32>,
    squares: vec3<f32>,
    distance: f32,
    distance_place: vec2<f32>,
    distance_squares: f32,
}

fn add_place(moments: ptr<function, Moments>, weight: f32, at: vec2<f32>) {
    let r2 = dot(at, at);
    (*moments).weight += weight;
    (*moments).place += weight * at;
    (*moments).squares += weight * vec3<f32>(at.x * at.x, at.x * at.y, at.y * at.y);
    (*moments).distance += weight * r2;
    (*moments).distance_place += weight * r2 * at;
    (*moments).distance_squares += weight * r2 * r2;
}

// Sums of weight · value, and of that times (x, y), and times r².
struct CurvedSums {
    plane: Plane,
    by_distance: vec3<f32>,
}

fn add_curved(sums: ptr<function, CurvedSums>, value: vec3<f32>, weight: f32, at: vec2<f32>) {
    (*sums).plane.sum += weight * value;
    (*sums).plane.sum_x += weight * at.x * value;
    (*sums).plane.sum_y += weight * at.y * value;
    (*sums).by_distance += weight * dot(at, at) * value;
}

fn value_of_curve(sums: CurvedSums, fit: CurvedFit) -> vec3<f32> {
    return value_of(sums.plane, fit.shares.xyz) + fit.shares.w * sums.by_distance;
}

// A fit of 1, x, y and r² by least squares. Its value at the pixel is Σ weight·dot(shares, (1, x, y, r²))·value.
struct CurvedFit {
    shares: vec4<f32>,
    is_there: bool,
}

fn fit_curved(moments: Moments) -> CurvedFit {
    let scale = 1.0 / max(moments.weight, LEAST_WEIGHT);
    let mean = scale * moments.place;
    let spread = scale * moments.squares - vec3<f32>(mean.x * mean.x, mean.x * mean.y, mean.y * mean.y);
    let determinant = spread.x * spread.z - spread.y * spread.y;
    let inverse = vec3<f32>(spread.z, -spread.y, spread.x) / determinant;
    let pull = -vec2<f32>(inverse.x * mean.x + inverse.y * mean.y, inverse.y * mean.x + inverse.z * mean.y);
    // The part of r² that a plane explains: its slope, and its value at the pixel.
    let mean_distance = scale * moments.distance;
    let covariance = scale * moments.distance_place - mean_distance * mean;
    let slope = vec2<f32>(inverse.x * covariance.x + inverse.y * covariance.y, inverse.y * covariance.x + inverse.z * covariance.y);
    let at_pixel = mean_distance - dot(slope, mean);
    let rest = scale * moments.distance_squares - mean_distance * mean_distance - dot(slope, covariance);
    let of_rest = at_pixel / rest;
    let leverage = 1.0 - dot(pull, mean);
    let is_there = determinant > 1e-3 && leverage <= MAX_LEVERAGE && rest > 1e-3 && at_pixel * of_rest <= MAX_LEVERAGE_OF_CURVATURE;
    return CurvedFit(scale * vec4<f32>(leverage + at_pixel * of_rest, pull + of_rest * slope, -of_rest), is_there);
}

// Mean square of the plane's values at the neighbours. `spread` are the variances of their places, with this determinant; 0: they are on a
// line, and the plane is level.
fn explained(plane: Plane, scale: f32, mean: vec2<f32>, spread: vec3<f32>, determinant: f32) -> f32 {
    let value = scale * plane.sum;
    let along_x = scale * plane.sum_x - mean.x * value;
    let along_y = scale * plane.sum_y - mean.y * value;
    let slopes_squared = spread.z * dot(along_x, along_x) - 2.0 * spread.y * dot(along_x, along_y) + spread.x * dot(along_y, along_y);
    return dot(value, value) + select(0.0, slopes_squared / determinant, determinant > 0.0);
}

@compute @workgroup_size(64)
fn compute_main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let item = 64u * (group.y * groups.x + group.x) + local;
    if (item >= parameters.item_count) {
        return;
    }
    let column = item % parameters.columns;
    let row = item / parameters.columns;
    let is_axial = parameters.pattern == EDGES;
    var pixel = vec2<u32>(column, row);
    if (parameters.pattern == CENTRES) {
        pixel = 2u * pixel + 1u;
    }
    if (is_axial) {
        pixel.x = 2u * column + (1u - row % 2u);
    }
    pixel *= parameters.reach;
    let size = textureDimensions(position_instance);
    if (any(pixel >= size)) {
        candidates[item] = NO_PIXEL;
        return;
    }
    // If gathers are exact, an earlier attempt may have gathered this pixel.
    if (textureLoad(position_instance, pixel).w == 0.0 || is_gathered(decode_state(textureLoad(gathered, pixel, DIFFUSE_LOBE).w))) {
        candidates[item] = NO_PIXEL;
        return;
    }
    let own = facing_at(pixel);
    let takes_any = parameters.tolerance >= ANY_ERROR;
    var normal_plane: Plane;
    var square_plane: Plane;
    // Of what the lobes reflect: diffuse, specular.
    var light_squares = vec2<f32>(0.0);
    var near = 0u;
    // Fits a plane over the image to the neighbours' values by least squares. If the nearest four are all on the surface, its value is
    // their mean. At the surface's border the next eight help.
    var expected_error = 0.0;
    // Whether the prediction of a neighbour was compared with its gather.
    var has_error = false;
    // Variances and packets of the neighbours: of those on the surface, or of all if none is on it.
    var sampled = vec4<f32>(0.0);
    var sampled_anyhow = vec4<f32>(0.0);
    var phasor_variances = vec2<f32>(0.0);
    var phasor_variances_anyhow = vec2<f32>(0.0);
    var weights: array<f32, NEIGHBOURS>;
    // Of all twelve.
    var moments: Moments;
    var diffuse_curve: CurvedSums;
    var specular_curve: CurvedSums;
    var end = 4u;
    for (var i = 0u; i < end; i++) {
        let offset = neighbour_offset(i, is_axial);
        let place = vec2<i32>(pixel) + offset * i32(parameters.reach);
        let is_inside = all(place >= vec2<i32>(0)) && all(place < vec2<i32>(size));
        let neighbour = select(pixel, vec2<u32>(place), is_inside);
        let known = textureLoad(gathered, neighbour, DIFFUSE_LOBE);
        let state = decode_state(known.w);
        let other = facing_at(neighbour);
        let is_known = is_gathered(state) || state.kind == INTERPOLATED;
        let is_same = is_inside && is_known && is_one_surface(own, other);
        let at = vec2<f32>(offset);
        let weight = select(select(0.0, FAINT, takes_any && is_inside && is_known), 1.0, is_same) / dot(at, at);
        weights[i] = weight;
        near += u32(is_same && i < 4u);
        add_place(&moments, weight, at);
        add_curved(&diffuse_curve, known.rgb, weight, at);
        light_squares.x += weight * dot(known.rgb, known.rgb);
        add(&normal_plane, other.normal, weight, at);
        add(&square_plane, vec3<f32>(at * at, 0.0), weight, at);
        if (SPECULAR) {
            let specular_light = textureLoad(gathered, neighbour, SPECULAR_LOBE).rgb;
            add_curved(&specular_curve, specular_light, weight, at);
            light_squares.y += weight * dot(specular_light, specular_light);
        }
        if (NOISY) {
            let known_samples = known_sampling(neighbour);
            let sampled_there = select(vec4<f32>(0.0), vec4<f32>(known_samples.variances, known_samples.packets, 1.0), is_inside && is_known);
            sampled_anyhow += sampled_there;
            sampled += select(vec4<f32>(0.0), sampled_there, is_same);
            if (PHASORS) {
                let phasors_there = select(vec2<f32>(0.0), known_samples.phasor_variances, is_inside && is_known);
                phasor_variances_anyhow += phasors_there;
                phasor_variances += select(vec2<f32>(0.0), phasors_there, is_same);
            }
        }
        expected_error = max(expected_error, select(0.0, state.error, is_same));
        has_error = has_error || (is_same && state.kind != GATHERED_UNPREDICTED);
        end = select(end, NEIGHBOURS, i == 3u && near < 4u);
    }
    let of_plane = moments;
    let diffuse_plane = diffuse_curve.plane;
    let specular_plane = specular_curve.plane;
    for (var i = end; i < NEIGHBOURS; i++) {
        let offset = neighbour_offset(i, is_axial);
        let place = vec2<i32>(pixel) + offset * i32(parameters.reach);
        let is_inside = all(place >= vec2<i32>(0)) && all(place < vec2<i32>(size));
        let neighbour = select(pixel, vec2<u32>(place), is_inside);
        let known = textureLoad(gathered, neighbour, DIFFUSE_LOBE);
        let state = decode_state(known.w);
        let is_known = is_gathered(state) || state.kind == INTERPOLATED;
        let is_same = is_inside && is_known && is_one_surface(own, facing_at(neighbour));
        let at = vec2<f32>(offset);
        weights[i] = select(select(0.0, FAINT, takes_any && is_inside && is_known), 1.0, is_same) / dot(at, at);
        add_place(&moments, weights[i], at);
        add_curved(&diffuse_curve, known.rgb, weights[i], at);
        if (SPECULAR) {
            add_curved(&specular_curve, textureLoad(gathered, neighbour, SPECULAR_LOBE).rgb, weights[i], at);
        }
    }
    let curve = fit_curved(moments);
    let scale = 1.0 / max(of_plane.weight, LEAST_WEIGHT);
    let mean = scale * of_plane.place;
    let spread = scale * of_plane.squares - vec3<f32>(mean.x * mean.x, mean.x * mean.y, mean.y * mean.y);
    let determinant = spread.x * spread.z - spread.y * spread.y;
    // The plane's value at the pixel is Σ weightᵢ·(1 + pull·(atᵢ − mean))·valueᵢ/Σ weightᵢ.
    let full_pull = -vec2<f32>(spread.z * mean.x - spread.y * mean.y, spread.x * mean.y - spread.y * mean.x) / determinant;
    // Noise variance of the prediction over that of a neighbour, as if all weights were equal. More than 1 is extrapolation.
    let leverage = 1.0 - dot(full_pull, mean);
    let has_plane = determinant > 1e-3 && leverage <= MAX_LEVERAGE;
    let pull = select(vec2<f32>(0.0), full_pull, has_plane);
    let shares = scale * vec3<f32>(1.0 - dot(pull, mean), pull);
    let diffuse = max(select(value_of(diffuse_plane, shares), value_of_curve(diffuse_curve, curve), curve.is_there), vec3<f32>(0.0));
    var specular = vec3<f32>(0.0);
    if (SPECULAR) {
        specular = max(select(value_of(specular_plane, shares), value_of_curve(specular_curve, curve), curve.is_there), vec3<f32>(0.0));
        textureStore(gathered, pixel, SPECULAR_LOBE, vec4<f32>(specular, 0.0));
    }
    if (PHASORS) {
        // The same prediction, as the weight of each neighbour in its value.
        let last = select(end, NEIGHBOURS, curve.is_there);
        let weights_of = select(vec4<f32>(shares, 0.0), curve.shares, curve.is_there);
        for (var lobe = 0u; lobe < lobe_count(); lobe++) {
            let light = select(diffuse, specular, lobe == SPECULAR_LOBE);
            for (var layer = 0u; layer < phasor_layer_count(); layer++) {
                var phasors = vec4<f32>(0.0);
                for (var i = 0u; i < last; i++) {
                    let offset = neighbour_offset(i, is_axial);
                    let place = vec2<u32>(clamp(vec2<i32>(pixel) + offset * i32(parameters.reach), vec2<i32>(0), vec2<i32>(size) - 1));
                    let at = vec2<f32>(offset);
                    let share = weights[i] * dot(weights_of, vec4<f32>(1.0, at, dot(at, at)));
                    phasors += share * textureLoad(gathered, place, phasor_layer(layer, lobe));
                }
                textureStore(gathered, pixel, phasor_layer(layer, lobe), limit_phasors(phasors, light[band_of(layer)]));
            }
        }
    }
    // The spacing has shrunk by √2 since the neighbours' errors were measured, and these errors are of second order: a factor of 0.5.
    // Neighbours that are mostly on one side make the error larger.
    expected_error *= select(1.0, 0.5 * max(leverage, 1.0), has_plane);
    // Light from the side changes as much as the normal does, and facets have their own normals.
    let turned = length(value_of(normal_plane, shares) - own.normal);
    let radiance = length(reflect(pixel, diffuse, specular)) * 0.57735027;
    let relative_to = max(parameters.own_share * radiance, parameters.least_radiance);
    let slope_determinant = select(0.0, determinant, has_plane);
    var scatter = vec2<f32>(scale * light_squares.x - explained(diffuse_plane, scale, mean, spread, slope_determinant), 0.0);
    if (SPECULAR) {
        scatter.y = scale * light_squares.y - explained(specular_plane, scale, mean, spread, slope_determinant);
    }
    let scattered = SCATTER * sqrt(reflect_squares(pixel, max(scatter, vec2<f32>(0.0))) / 3.0);
    expected_error = max(expected_error, max(TURNING * turned * radiance, scattered) / relative_to);
    var is_known = has_plane && has_error && expected_error <= parameters.tolerance;
    if (takes_any) {
        is_known = of_plane.weight > 0.0;
        // Neighbours on a line say nothing of the light across it, such as on a face that is a few pixels wide.
        let untested = UNTESTED * max(radiance / relative_to, 1.0);
        expected_error = max(expected_error, select(untested, 0.0, has_error && has_plane));
    }
    // No gather, and no prediction: only if nothing around has light.
    var is_given_up = takes_any && !is_known;
    if (NOISY) {
        let own_packets = textureLoad(samples, pixel, SAMPLING).x;
        // A gathered pixel stays gathered.
        is_known &= own_packets == 0.0;
        is_given_up &= own_packets == 0.0;
        if (PHASORS) {
            phasor_variances = select(phasor_variances_anyhow / max(sampled_anyhow.w, 1.0), phasor_variances / max(sampled.w, 1.0), sampled.w > 0.0);
            textureStore(samples, pixel, phasor_variances_layer(), vec4<f32>(phasor_variances, 0.0, 0.0));
        }
        sampled = select(sampled_anyhow, sampled, sampled.w > 0.0);
        textureStore(samples, pixel, SAMPLING, vec4<f32>(own_packets, sampled.xyz / max(sampled.w, 1.0)));
    }
    // The bend of the light along an axis shows only if neighbours are on both sides: not in a strip two pixels wide.
    let bends = abs(value_of(square_plane, shares).xy);
    let is_telling = has_plane && min(bends.x, bends.y) >= LEAST_BEND;
    let to_gather = PixelState(select(UNKNOWN, select(PREDICTED_ONE_WAY, PREDICTED, is_telling), has_plane), 0.0);
    let state = encode_state(to_gather);
    let interpolated = encode_state(PixelState(INTERPOLATED, expected_error));
    textureStore(gathered, pixel, DIFFUSE_LOBE, vec4<f32>(diffuse, select(state, interpolated, is_known)));
    candidates[item] = select(pixel.x + (pixel.y << 16u), NO_PIXEL, is_known || is_given_up);
}
