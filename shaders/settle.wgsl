// The gathered bounce of a list of receivers goes to their pixels, with what it says of the prediction's error.

struct SettleParameters {
    first_receiver: u32,
    receiver_count: u32,
    // Over the image's, 1/(W/sr/m²).
    inverse_radiance: f32,
}

#if PHONG
@group(0) @binding(3) var specular_bounce: texture_storage_2d<rgba32float, read_write>;
#endif
@group(0) @binding(4) var diffuse_bounce: texture_storage_2d<rgba32float, read_write>;
@group(0) @binding(5) var<storage, read> receivers: array<u32>;
// Two a receiver: diffuse, specular.
@group(0) @binding(6) var<storage, read> bounced: array<vec4<f32>>;
var<immediate> parameters: SettleParameters;

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.receiver_count) {
        return;
    }
    let packed = receivers[parameters.first_receiver + id.x];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    let predicted = textureLoad(diffuse_bounce, pixel);
    let diffuse = bounced[2u * id.x].rgb;
    var specular = vec3<f32>(0.0);
    var specular_error = vec3<f32>(0.0);
#if PHONG
    specular = bounced[2u * id.x + 1u].rgb;
    specular_error = specular - textureLoad(specular_bounce, pixel).rgb;
    textureStore(specular_bounce, pixel, vec4<f32>(specular, 0.0));
#endif
    let error = length(reflect(pixel, diffuse - predicted.rgb, specular_error)) * 0.57735027 * parameters.inverse_radiance;
    let state = select(UNJUDGED, 1.0 + error, predicted.w == WITH_PREDICTION);
    textureStore(diffuse_bounce, pixel, vec4<f32>(diffuse, state));
}
