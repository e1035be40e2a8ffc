// Lowers the noise of the gathers on a grid: what a plane through the pixels around explains is kept, and of the rest as much as
// is more than noise (after Lee, "Digital image enhancement and noise filtering by use of local statistics", 1980). How much noise
// there is, the gathers say themselves.

#import refinement
#import one_surface
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

var gathered: texture_storage_2d_array<rgba32float, read_write>;
// Two a point of the grid: diffuse, specular.
var<storage, read_write> smoothed: array<vec4<f32>>;
var<immediate> parameters: SmoothParameters;

// Points of the grid to either side. (2 is worse for less noise: light bends more than a plane.)
const REACH: i32 = 1;
// Noise around a pixel over its own.
const MAX_OVER_OWN: f32 = 4.0;
// Fewer do not make a plane.
const LEAST_PIXELS: f32 = 6.0;

#if FIT
// Of what was gathered: diffuse, specular.
fn variances(pixel: vec2<u32>) -> vec2<f32> {
    let known = known_sampling(pixel);
    return vec2<f32>(variance_of_mean(known.variances.x, known.packets, parameters.evenness, parameters.variance_rate),
        variance_of_mean(known.variances.y, known.packets, parameters.evenness, parameters.variance_rate));
}

// The value on the plane through those around, moved towards the pixel's own by as much as they scatter for other reasons than noise.
// `squares` is Σ value², `variance` that of a value's noise; all bands together.
fn smooth_value(own: vec3<f32>, plane: Plane, fit: Fit, squares: f32, variance: f32) -> vec3<f32> {
    let mean = plane.sum / fit.count;
    let along_x = plane.sum_x / fit.count - fit.mean.x * mean;
    let along_y = plane.sum_y / fit.count - fit.mean.y * mean;
    let slope_x = (fit.spread.z * along_x - fit.spread.y * along_y) / fit.determinant;
    let slope_y = (fit.spread.x * along_y - fit.spread.y * along_x) / fit.determinant;
    let explained = dot(mean, mean) + dot(slope_x, along_x) + dot(slope_y, along_y);
    let scatter = max(squares - fit.count * explained, 0.0) / (fit.count - 3.0);
    let gain = wiener_gain(max(scatter - variance, 0.0), variance);
    let fitted = mean - fit.mean.x * slope_x - fit.mean.y * slope_y;
    return mix(fitted, own, gain);
}

// Places of the pixels around, in strides.
struct Fit {
    count: f32,
    mean: vec2<f32>,
    // Mean of x², x·y, y², less those of the mean.
    spread: vec3<f32>,
    determinant: f32,
}
#endif

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
    let pixel = parameters.stride * vec2<u32>(item % parameters.columns, item / parameters.columns);
    let own = textureLoad(gathered, pixel, DIFFUSE);
    if (!is_gathered(decode_state(own.w))) {
        return;
    }
#if FIT
    let size = textureDimensions(position_mesh);
    let facing = facing_at(pixel);
    var diffuse_plane: Plane;
    var diffuse_squares = 0.0;
    var sum_of_variances = vec2<f32>(0.0);
    var fit: Fit;
    var squares = vec3<f32>(0.0);
    var specular_squares = 0.0;
#if PHONG
    var specular_plane: Plane;
#endif
    for (var y = -REACH; y <= REACH; y++) {
        for (var x = -REACH; x <= REACH; x++) {
            let place = vec2<i32>(pixel) + i32(parameters.stride) * vec2<i32>(x, y);
            let is_inside = all(place >= vec2<i32>(0)) && all(place < vec2<i32>(size));
            let other_pixel = select(pixel, vec2<u32>(place), is_inside);
            let other = textureLoad(gathered, other_pixel, DIFFUSE);
            // A point is always of one surface with itself, whatever rounding says.
            let is_own = x == 0 && y == 0;
            let is_one = is_inside && is_gathered(decode_state(other.w)) && (is_own || is_one_surface(facing, facing_at(other_pixel)));
            let weight = select(0.0, 1.0, is_one);
            let at = vec2<f32>(f32(x), f32(y));
            fit.count += weight;
            fit.mean += weight * at;
            squares += weight * vec3<f32>(at.x * at.x, at.x * at.y, at.y * at.y);
            add(&diffuse_plane, other.rgb, weight, at);
            diffuse_squares += weight * dot(other.rgb, other.rgb);
            sum_of_variances += weight * variances(other_pixel);
#if PHONG
            let specular = textureLoad(gathered, other_pixel, SPECULAR).rgb;
            add(&specular_plane, specular, weight, at);
            specular_squares += weight * dot(specular, specular);
#endif
        }
    }
    fit.mean /= fit.count;
    fit.spread = squares / fit.count - vec3<f32>(fit.mean.x * fit.mean.x, fit.mean.x * fit.mean.y, fit.mean.y * fit.mean.y);
    fit.determinant = fit.spread.x * fit.spread.z - fit.spread.y * fit.spread.y;
    let own_variance = variances(pixel);
    let mean_variance = sum_of_variances / fit.count;
    // A pixel that is dark without doubt stays so beside bright ones. Where few samples find the light, one that has found none is not.
    let is_doubtful = own_variance == vec2<f32>(0.0)
        & mean_variance > RARE * vec2<f32>(diffuse_squares, specular_squares) / fit.count;
    let variance = select(min(mean_variance, MAX_OVER_OWN * own_variance), mean_variance, is_doubtful);
    let has_plane = fit.count >= LEAST_PIXELS && fit.determinant > 0.1;
    let diffuse = smooth_value(own.rgb, diffuse_plane, fit, diffuse_squares, variance.x);
    smoothed[2u * item] = vec4<f32>(max(select(own.rgb, diffuse, has_plane), vec3<f32>(0.0)), own.w);
#if PHONG
    let own_specular = textureLoad(gathered, pixel, SPECULAR).rgb;
    let specular = smooth_value(own_specular, specular_plane, fit, specular_squares, variance.y);
    smoothed[2u * item + 1u] = vec4<f32>(max(select(own_specular, specular, has_plane), vec3<f32>(0.0)), 0.0);
#endif
#else
    textureStore(gathered, pixel, DIFFUSE, smoothed[2u * item]);
#if PHONG
    textureStore(gathered, pixel, SPECULAR, smoothed[2u * item + 1u]);
#endif
#endif
}
