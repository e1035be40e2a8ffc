// Indirect radiance of every pixel from what was gathered or interpolated there, and how far it may be off.

#import refinement
#import reflect

struct ResolveParameters {
    // Variance of a gather over its sum of squared differences.
    variance_scale: f32,
    // Noise of a gather over the radiance of its pixel, as a pilot has it.
    relative_noise: f32,
    // What errors of predictions count over, as in the predict pass.
    least_radiance: f32,
    own_share: f32,
}

#if PHONG
var gathered_specular: texture_storage_2d<rgba32float, read>;
#endif
var gathered_diffuse: texture_storage_2d<rgba32float, read>;
#if NOISY
var squared_differences: texture_storage_2d<rgba32float, read>;
#endif
// The radiance; and what its error is expected to be but for a factor, all bands together: negative for an interpolated pixel.
var indirect_radiance: texture_storage_2d<rgba32float, write>;
var<immediate> parameters: ResolveParameters;

// Least error of a pixel, over the noise that is expected of one as bright: samples may have missed what they did not find.
const LEAST_NOISE: f32 = 0.1;

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if (any(pixel >= textureDimensions(position_mesh)) || textureLoad(position_mesh, pixel).w == 0.0) {
        return;
    }
    var specular = vec3<f32>(0.0);
#if PHONG
    specular = textureLoad(gathered_specular, pixel).rgb;
#endif
    let gathered = textureLoad(gathered_diffuse, pixel);
    let radiance = reflect(pixel, gathered.rgb, specular);
    var error = 0.0;
#if NOISY
    let state = decode_state(gathered.w);
    let own = length(radiance);
    let noise = parameters.relative_noise * own;
    let least = LEAST_NOISE * parameters.relative_noise * max(own, parameters.least_radiance);
    let of_prediction = state.error * 1.7320508 * max(parameters.own_share * own * 0.57735027, parameters.least_radiance);
    let own_variance = parameters.variance_scale * reflect_squares(pixel, textureLoad(squared_differences, pixel).xy);
    if (state.kind == INTERPOLATED) {
        error = -max(sqrt(noise * noise + of_prediction * of_prediction), least);
    } else {
        error = max(sqrt(own_variance), least);
    }
#endif
    textureStore(indirect_radiance, pixel, vec4<f32>(radiance, error));
}
