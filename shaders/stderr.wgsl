// Standard error of the indirect radiance, per band, from the error that the resolve pass expects and how right that was on a sample of
// pixels.

struct StderrParameters {
    // Actual over expected error: of gathered pixels, and of interpolated ones.
    gathered_factor: f32,
    interpolated_factor: f32,
}

var indirect_radiance: texture_storage_2d<rgba32float, read>;
var stderr_radiance: texture_storage_2d<rgba32float, write>;
var<immediate> parameters: StderrParameters;

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if (any(pixel >= textureDimensions(indirect_radiance))) {
        return;
    }
    let radiance_error = textureLoad(indirect_radiance, pixel);
    let error = abs(radiance_error.w) * select(parameters.gathered_factor, parameters.interpolated_factor, radiance_error.w < 0.0);
    let own = length(radiance_error.rgb);
    // A band's error is proportional to its light.
    let shares = select(vec3<f32>(0.57735027), radiance_error.rgb / max(own, 1e-30), own > 0.0);
    textureStore(stderr_radiance, pixel, vec4<f32>(error * shares, 0.0));
}
