// Averages samples over each pixel. Each dispatch adds one sample per pixel: its depth, or its share of the bounce.
//
// Light varies little within a pixel. So a sample reflects, by its own BRDF, the light that was gathered at the pixels around it whose
// centres show the same surface. If none does, the sample itself is gathered.

struct PixelFilterParameters {
    // C, for depths that of the plane where parallel rays start; and the unit vector of the axis.
    camera_position: vec3<f32>,
    // Weight of a sample in its pixel.
    share: f32,
    forward: vec3<f32>,
    first_receiver: u32,
    // Distance from C to the local origin, in turns of each frequency.
    camera_turns: vec4<f32>,
    // Whole pixels from a pixel to the one that contains its sample, and from that one's centre to the sample.
    step_px: vec2<f32>,
    offset_px: vec2<f32>,
    receiver_count: u32,
}

var<immediate> parameters: PixelFilterParameters;

#if DEPTHS
var position_instance: texture_2d<f32>;
// Of the samples that show a surface: sum of their depths, least depth, number of samples; and cos²θ of the last one, where θ is its angle
// to the axis.
var footprint: texture_storage_2d<rgba32float, read_write>;

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if (any(pixel >= textureDimensions(position_instance))) {
        return;
    }
    let seen = textureLoad(position_instance, pixel, 0);
    if (seen.w == 0.0) {
        return;
    }
    let offset = seen.xyz - parameters.camera_position;
    let depth = dot(offset, parameters.forward);
    let before = textureLoad(footprint, pixel);
    let nearest = select(min(before.y, depth), depth, before.z == 0.0);
    let squared_cosine = depth * depth / max(dot(offset, offset), 1e-37);
    textureStore(footprint, pixel, vec4<f32>(before.x + depth, nearest, before.z + 1.0, squared_cosine));
}
#else
#import one_surface
#import phasor
#import refinement

var indirect_radiance: texture_storage_2d<rgba32float, read_write>;
var indirect_phasors: texture_storage_2d_array<rgba32float, read_write>;

// Adds a sample. `diffuse` and `specular` are what the lobes reflect for k_d = k_s = 1.
fn add_sample(pixel: vec2<u32>, diffuse: vec3<f32>, specular: vec3<f32>) {
    let reflected = reflect(pixel, diffuse, specular);
    let sum = textureLoad(indirect_radiance, pixel) + parameters.share * vec4<f32>(reflected, 0.0);
    textureStore(indirect_radiance, pixel, sum);
}

// Adds Z of a pair of frequencies, which does not include the path to C.
fn add_phasors_of_sample(pixel: vec2<u32>, pair: u32, phasors: vec4<f32>) {
    let position = textureLoad(position_instance, pixel).xyz;
    let way = phasors_of(turns_between(parameters.camera_position, parameters.camera_turns, position));
    let re = select(way.re.xy, way.re.zw, pair == 1u);
    let im = select(way.im.xy, way.im.zw, pair == 1u);
    // Multiplies each of the two frequencies by its own path.
    let turned = vec4<f32>(phasors.xz * re - phasors.yw * im, phasors.xz * im + phasors.yw * re).xzyw;
    textureStore(indirect_phasors, pixel, pair, textureLoad(indirect_phasors, pixel, pair) + parameters.share * turned);
}

#if INTERPOLATE
// What the pixels' centres show, and the light gathered there.
var centre_position_instance: texture_2d<f32>;
var centre_normal_geometric: texture_2d<f32>;
var centre_lobe_parameters: texture_2d<f32>;
var gathered: texture_2d_array<f32>;
// Pixels whose sample is to be gathered, as column + 65536 · row; or NO_PIXEL.
var<storage, read_write> candidates: array<u32>;

// A pixel and its eight neighbours.
const PLACES: u32 = 9u;
// Limits for a sample that is not gathered: its distance to the nearest pixel; the difference between its normal and that of the
// interpolated surface; the relative difference between the light of the nearest pixel and the mean around it. (Measured: without them the
// bounce of the knot at 96² pixels with 64 samples is off by 4 %, with them by 1.5 %.)
const MAX_WAY: f32 = 0.75;
const MAX_TURN: f32 = 0.05;
const MAX_BEND: f32 = 0.1;
// Least determinant of the places' second moments for a plane.
const LEAST_SPREAD: f32 = 0.04;

// From the centre of the middle pixel.
fn place_of(index: u32) -> vec2<f32> {
    return vec2<f32>(f32(index % 3u), f32(index / 3u)) - 1.0;
}

// Weight of a place in the parabolic surface through all places, at the sample.
fn parabolic_share(index: u32) -> f32 {
    let place = place_of(index);
    let at = parameters.offset_px;
    let shares = select(0.5 * at * (at + place), 1.0 - at * at, place == vec2<f32>(0.0));
    return shares.x * shares.y;
}

fn centre_facing_at(pixel: vec2<u32>) -> Facing {
    var facing: Facing;
    facing.position = textureLoad(centre_position_instance, pixel, 0).xyz;
    facing.normal = textureLoad(centre_normal_geometric, pixel, 0).xyz;
    if (SPECULAR) {
        facing.lobe = textureLoad(centre_lobe_parameters, pixel, 0);
    }
    return facing;
}

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    let size = textureDimensions(kd_material);
    if (any(pixel >= size)) {
        return;
    }
    let item = pixel.y * size.x + pixel.x;
    candidates[item] = NO_PIXEL;
    if (textureLoad(position_instance, pixel).w == 0.0) {
        return;
    }
    let own = facing_at(pixel);
    let home = vec2<i32>(pixel) + vec2<i32>(parameters.step_px);
    // Finds the nearest pixel, and a plane over the image through it and its neighbours that show the surface. If all show it, a surface of
    // second order replaces the plane.
    var shares: array<f32, PLACES>;
    var total = 0.0;
    var mean = vec2<f32>(0.0);
    var squares = vec3<f32>(0.0);
    var nearest = 0u;
    var nearest_squared = 3e38;
    for (var i = 0u; i < PLACES; i++) {
        let place = place_of(i);
        let other_pixel = vec2<u32>(clamp(home + vec2<i32>(place), vec2<i32>(0), vec2<i32>(size) - 1));
        let other = centre_facing_at(other_pixel);
        let is_known = decode_state(textureLoad(gathered, other_pixel, DIFFUSE_LOBE, 0).w).kind != UNKNOWN;
        let weight = select(0.0, 1.0, is_known && is_one_surface(own, other));
        let apart = other.position - own.position;
        let is_nearest = weight > 0.0 && dot(apart, apart) < nearest_squared;
        nearest = select(nearest, i, is_nearest);
        nearest_squared = select(nearest_squared, dot(apart, apart), is_nearest);
        shares[i] = weight;
        total += weight;
        mean += weight * place;
        squares += weight * vec3<f32>(place.x * place.x, place.x * place.y, place.y * place.y);
    }
    mean /= max(total, 1.0);
    let spread = squares / max(total, 1.0) - vec3<f32>(mean.x * mean.x, mean.x * mean.y, mean.y * mean.y);
    let determinant = spread.x * spread.z - spread.y * spread.y;
    // From the nearest pixel to the sample, along the plane.
    let way = parameters.offset_px - place_of(nearest);
    let pull = vec2<f32>(spread.z * way.x - spread.y * way.y, spread.x * way.y - spread.y * way.x) / max(determinant, LEAST_SPREAD);
    var diffuse = vec3<f32>(0.0);
    var specular = vec3<f32>(0.0);
    var normal = vec3<f32>(0.0);
    // Light of the nearest pixel, and mean light of all pixels that show the surface.
    var own_light = vec3<f32>(0.0);
    var mean_light = vec3<f32>(0.0);
    for (var i = 0u; i < PLACES; i++) {
        let other_pixel = vec2<u32>(clamp(home + vec2<i32>(place_of(i)), vec2<i32>(0), vec2<i32>(size) - 1));
        let along = select(0.0, dot(pull, place_of(i) - mean) / max(total, 1.0), determinant >= LEAST_SPREAD);
        let light = textureLoad(gathered, other_pixel, DIFFUSE_LOBE, 0).rgb;
        own_light = select(own_light, light, i == nearest);
        mean_light += shares[i] / max(total, 1.0) * light;
        let on_plane = shares[i] * along + select(0.0, 1.0, i == nearest);
        shares[i] = select(on_plane, parabolic_share(i), total == f32(PLACES));
        normal += shares[i] * textureLoad(centre_normal_geometric, other_pixel, 0).xyz;
        diffuse += shares[i] * light;
        if (SPECULAR) {
            specular += shares[i] * textureLoad(gathered, other_pixel, SPECULAR_LOBE, 0).rgb;
        }
    }
    let is_even = length(mean_light - own_light) <= MAX_BEND * length(own_light);
    let is_near = length(way) <= MAX_WAY && length(normal - own.normal) <= MAX_TURN;
    if (total == 0.0 || !is_near || !is_even) {
        candidates[item] = pixel.x + (pixel.y << 16u);
        return;
    }
    diffuse = max(diffuse, vec3<f32>(0.0));
    specular = max(specular, vec3<f32>(0.0));
    add_sample(pixel, diffuse, specular);
    if (PHASORS) {
        for (var pair = 0u; pair < modulation.pair_count; pair++) {
            var phasors = vec4<f32>(0.0);
            for (var index = pair * modulation.band_count; index < (pair + 1u) * modulation.band_count; index++) {
                let seen = seen_shares(pixel, band_of(index));
                for (var lobe = 0u; lobe < lobe_count(); lobe++) {
                    var of_lobe = vec4<f32>(0.0);
                    for (var i = 0u; i < PLACES; i++) {
                        let other_pixel = vec2<u32>(clamp(home + vec2<i32>(place_of(i)), vec2<i32>(0), vec2<i32>(size) - 1));
                        of_lobe += shares[i] * textureLoad(gathered, other_pixel, phasor_layer(index, lobe), 0);
                    }
                    let light = select(diffuse, specular, lobe == SPECULAR_LOBE);
                    phasors += seen[lobe] * limit_phasors(of_lobe, light[band_of(index)]);
                }
            }
            add_phasors_of_sample(pixel, pair, phasors);
        }
    }
}
#else
var<storage, read> receivers: array<u32>;
// In the refinement's layout. Noisy gathers: the sums over samples.
var<storage, read> results: array<vec4<f32>>;
// Noisy gathers: in the layout of the sample_counts pass.
var<storage, read> sample_ranges: array<u32>;

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.receiver_count) {
        return;
    }
    let packed = receivers[parameters.first_receiver + id.x];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    let first = RESULT_VECTORS * id.x;
    var scale = 1.0;
    if (NOISY) {
        let range = sample_ranges[parameters.first_receiver + id.x];
        scale = 1.0 / (PACKET_SAMPLES * f32((range >> 16u) - (range & 0xffffu)));
    }
    var specular = vec3<f32>(0.0);
    if (SPECULAR) {
        specular = scale * results[first + 1u].rgb;
    }
    add_sample(pixel, scale * results[first].rgb, specular);
    if (PHASORS) {
        for (var pair = 0u; pair < modulation.pair_count; pair++) {
            var phasors = vec4<f32>(0.0);
            for (var index = pair * modulation.band_count; index < (pair + 1u) * modulation.band_count; index++) {
                let seen = seen_shares(pixel, band_of(index));
                for (var lobe = 0u; lobe < lobe_count(); lobe++) {
                    phasors += seen[lobe] * scale * results[first + phasor_result(pair, band_of(index), lobe)];
                }
            }
            add_phasors_of_sample(pixel, pair, phasors);
        }
    }
}
#endif
#endif
