// Indirect radiance of every pixel from what was gathered or interpolated there, and its expected error.

#import refinement
#import reflect
#import sampling

struct ResolveParameters {
    // Noise of gathers, as in variance_of_mean.
    evenness: f32,
    variance_rate: f32,
    // Noise of a gather over the radiance of its pixel, measured by a pilot.
    relative_noise: f32,
    // The radiance that errors of predictions are relative to, as in the predict pass.
    least_radiance: f32,
    own_share: f32,
}

#if PHASORS
// Devices may allow only four storage images per kernel.
var gathered: texture_2d_array<f32>;

fn gathered_at(pixel: vec2<u32>, layer: u32) -> vec4<f32> {
    return textureLoad(gathered, pixel, layer, 0);
}
#else
var gathered: texture_storage_2d_array<rgba32float, read>;

fn gathered_at(pixel: vec2<u32>, layer: u32) -> vec4<f32> {
    return textureLoad(gathered, pixel, layer);
}
#endif
// The radiance; and its expected error up to a factor, all bands together: negative for an interpolated pixel.
var indirect_radiance: texture_storage_2d<rgba32float, write>;
// Z without the path to C.
var indirect_phasors: texture_storage_2d_array<rgba32float, write>;
var<immediate> parameters: ResolveParameters;

// Least error of a pixel, over the expected noise of an equally bright pixel: samples may have missed light.
const LEAST_NOISE: f32 = 0.1;

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if (any(pixel >= textureDimensions(gathered))) {
        return;
    }
    let diffuse = gathered_at(pixel, DIFFUSE_LOBE);
    let state = decode_state(diffuse.w);
    // The background has no data.
    if (state.kind == UNKNOWN) {
        return;
    }
    var specular = vec3<f32>(0.0);
    if (SPECULAR) {
        specular = gathered_at(pixel, SPECULAR_LOBE).rgb;
    }
    let radiance = reflect(pixel, diffuse.rgb, specular);
    var error = 0.0;
    if (NOISY) {
        let own = length(radiance);
        let least = parameters.relative_noise * max(own, parameters.least_radiance);
        let of_prediction = state.error * 1.7320508 * max(parameters.own_share * own * 0.57735027, parameters.least_radiance);
        // Variances from the pixel's gather, or from those around it if these are larger: few samples estimate their own variance badly.
        let known = known_sampling(pixel);
        let variances = max(known.variances, textureLoad(samples, pixel, SAMPLING).yz);
        let variance = variance_of_mean(reflect_squares(pixel, variances), known.packets, parameters.evenness, parameters.variance_rate);
        // What smoothing leaves of it.
        let model = model_at(pixel);
        let of_model = reflect_squares(pixel, model.errors) + model.leverage * variance;
        let smoothed = select(variance, variance * of_model / max(variance + of_model, 1e-37), model.is_known);
        if (state.kind == INTERPOLATED) {
            error = -max(sqrt(variance + of_prediction * of_prediction), LEAST_NOISE * least);
        } else {
            error = max(sqrt(smoothed), LEAST_NOISE * least);
        }
    }
    textureStore(indirect_radiance, pixel, vec4<f32>(radiance, error));
    if (PHASORS) {
        for (var pair = 0u; pair < modulation.pair_count; pair++) {
            var phasors = vec4<f32>(0.0);
            for (var i = pair * modulation.band_count; i < (pair + 1u) * modulation.band_count; i++) {
                let shares = seen_shares(pixel, band_of(i));
                for (var lobe = 0u; lobe < lobe_count(); lobe++) {
                    phasors += shares[lobe] * gathered_at(pixel, phasor_layer(i, lobe));
                }
            }
            textureStore(indirect_phasors, pixel, pair, phasors);
        }
    }
}
