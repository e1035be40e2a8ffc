// Scatters the results of a gather to the pixels of its receivers, with what they say of the prediction's error.

#import refinement
#import reflect
#if NOISY
#import sampling
#endif

struct ScatterParameters {
    first_receiver: u32,
    receiver_count: u32,
    // Errors count over this, W/sr/m², or over own_share times the pixel's own radiance, if that is more.
    least_radiance: f32,
    own_share: f32,
    // 1: the receivers belong to the grid that is gathered whatever the light.
    is_grid: u32,
    // Of gathers, as variance_of_mean has it.
    evenness: f32,
    variance_rate: f32,
}

var gathered: texture_storage_2d_array<rgba32float, read_write>;
var<storage, read> receivers: array<u32>;
// Two a receiver: diffuse, specular. Of noisy gathers the sums over samples, and of their squared differences.
var<storage, read> results: array<vec4<f32>>;
#if NOISY
// As the sample_counts pass has it.
var<storage, read> sample_ranges: array<u32>;
#endif
var<immediate> parameters: ScatterParameters;

// What chance does to a prediction's error, over the variance of the gather: two standard deviations.
const NOISE_SQUARED: f32 = 4.0;

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.receiver_count) {
        return;
    }
    let packed = receivers[parameters.first_receiver + id.x];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    let predicted = textureLoad(gathered, pixel, DIFFUSE);
    let kind = decode_state(predicted.w).kind;
    let is_predicted = kind == PREDICTED || kind == PREDICTED_ONE_WAY;
    var diffuse = results[2u * id.x].rgb;
    var specular = vec3<f32>(0.0);
    var predicted_specular = vec3<f32>(0.0);
#if PHONG
    specular = results[2u * id.x + 1u].rgb;
    predicted_specular = textureLoad(gathered, pixel, SPECULAR).rgb;
#endif
#if NOISY
    // What was sampled before counts on.
    let sums = textureLoad(samples, pixel, SUMS_DIFFUSE) + results[2u * id.x];
    textureStore(samples, pixel, SUMS_DIFFUSE, sums);
    let packets = f32(sample_ranges[parameters.first_receiver + id.x] >> 16u);
    let sample_count = PACKET_SAMPLES * packets;
    diffuse = sums.rgb / sample_count;
#if PHONG
    let specular_sums = textureLoad(samples, pixel, SUMS_SPECULAR) + results[2u * id.x + 1u];
    textureStore(samples, pixel, SUMS_SPECULAR, specular_sums);
    specular = specular_sums.rgb / sample_count;
#endif
    textureStore(samples, pixel, SAMPLED, vec4<f32>(packets, textureLoad(samples, pixel, SAMPLED).yzw));
#endif
    let deviation = length(reflect(pixel, diffuse - predicted.rgb, specular - predicted_specular));
    var error = deviation;
#if NOISY
    let own_variance = variance_of_mean(reflect_squares(pixel, known_sampling(pixel).variances), packets, parameters.evenness, parameters.variance_rate);
    let variance_around = variance_of_mean(reflect_squares(pixel, textureLoad(samples, pixel, SAMPLED).yz), packets, parameters.evenness, parameters.variance_rate);
    let expected = reflect(pixel, predicted.rgb, predicted_specular);
    let is_doubtful = own_variance == 0.0 && variance_around > RARE * dot(expected, expected);
    let variance = select(own_variance, variance_around, is_doubtful);
    error = sqrt(max(deviation * deviation - NOISE_SQUARED * variance, 0.0));
    if (parameters.is_grid == 0u && is_predicted) {
        // The smooth pass does it for the grid.
        let gain = wiener_gain(max(deviation * deviation - variance, 0.0), variance);
        diffuse = mix(predicted.rgb, diffuse, gain);
        specular = mix(predicted_specular, specular, gain);
    }
#endif
#if PHONG
    textureStore(gathered, pixel, SPECULAR, vec4<f32>(specular, 0.0));
#endif
    var state = PixelState(GATHERED_UNPREDICTED, 0.0);
    if (kind == PREDICTED) {
        let radiance = length(reflect(pixel, diffuse, specular)) * 0.57735027;
        state = PixelState(GATHERED, error * 0.57735027 / max(parameters.own_share * radiance, parameters.least_radiance));
    }
    textureStore(gathered, pixel, DIFFUSE, vec4<f32>(diffuse, encode_state(state)));
}
