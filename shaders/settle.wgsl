// The gathered bounce of a list of receivers goes to their pixels, with what it says of the prediction's error.

#import pixel_state
#import reflect

struct SettleParameters {
    first_receiver: u32,
    receiver_count: u32,
    // Over the image's, 1/(W/sr/m²).
    inverse_radiance: f32,
    // 1: of the lattice that is gathered whatever the light.
    is_lattice: u32,
    // Variance of a gather over the spread of its draws.
    variance_of_spread: f32,
}

#if PHONG
var specular_bounce: texture_storage_2d<rgba32float, read_write>;
#endif
var diffuse_bounce: texture_storage_2d<rgba32float, read_write>;
var<storage, read> receivers: array<u32>;
// Two a receiver: diffuse, specular; and the spread of their draws.
var<storage, read> bounced: array<vec4<f32>>;
#if NOISY
var bounce_spread: texture_storage_2d<rgba32float, write>;
#endif
var<immediate> parameters: SettleParameters;

// What chance does to a prediction's error, over the variance of the gather: two standard deviations.
const NOISE_SQUARED: f32 = 4.0;

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.receiver_count) {
        return;
    }
    let packed = receivers[parameters.first_receiver + id.x];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    let predicted = textureLoad(diffuse_bounce, pixel);
    var diffuse = bounced[2u * id.x].rgb;
    var specular = vec3<f32>(0.0);
    var predicted_specular = vec3<f32>(0.0);
#if PHONG
    specular = bounced[2u * id.x + 1u].rgb;
    predicted_specular = textureLoad(specular_bounce, pixel).rgb;
#endif
    let off = length(reflect(pixel, diffuse - predicted.rgb, specular - predicted_specular));
    var error = off;
#if NOISY
    let spread = vec2<f32>(bounced[2u * id.x].w, bounced[2u * id.x + 1u].w);
    textureStore(bounce_spread, pixel, vec4<f32>(spread, 0.0, 0.0));
    let variance = parameters.variance_of_spread * reflect_spread(pixel, spread);
    error = sqrt(max(off * off - NOISE_SQUARED * variance, 0.0));
    if (parameters.is_lattice == 0u && predicted.w == WITH_PREDICTION) {
        // As much of the difference as is more than noise; the smooth pass does it for the lattice.
        let trust = trust_in(max(off * off - variance, 0.0), variance);
        diffuse = mix(predicted.rgb, diffuse, trust);
        specular = mix(predicted_specular, specular, trust);
    }
#endif
#if PHONG
    textureStore(specular_bounce, pixel, vec4<f32>(specular, 0.0));
#endif
    let relative_error = error * 0.57735027 * parameters.inverse_radiance;
    let state = select(UNJUDGED, 1.0 + relative_error, predicted.w == WITH_PREDICTION);
    textureStore(diffuse_bounce, pixel, vec4<f32>(diffuse, state));
}
