// Energy on the pixel in the exposure: Q_C = E_C · SensorPixelArea · SignalDutyCycle · ExposureTime. E_C is numerically the radiance
// L*_{P→C}, as in the model; or, behind an aperture, L · (π/4)·(D/f)² · cos⁴θ.

struct SensorParameters {
    // C, and the unit vector of the axis; used with an aperture.
    camera_position: vec3<f32>,
    // For light along the axis.
    joule_per_radiance: f32,
    forward: vec3<f32>,
}

var direct_radiance: texture_2d<f32>;
var indirect_radiance: texture_2d<f32>;
var emission: texture_2d<f32>;
var position_instance: texture_2d<f32>;
// Filled by the pixel_filter pass.
var footprint: texture_2d<f32>;
var energy: texture_storage_2d<rgba32float, write>;
var<immediate> parameters: SensorParameters;

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    let size = textureDimensions(direct_radiance);
    if (pixel.x >= size.x || pixel.y >= size.y) {
        return;
    }
    var radiance = textureLoad(direct_radiance, pixel, 0).rgb;
    if (INDIRECT) {
        radiance += textureLoad(indirect_radiance, pixel, 0).rgb;
    }
    if (EMISSIVE) {
        radiance += textureLoad(emission, pixel, 0).rgb;
    }
    if (SAMPLED) {
        let squared_cosine = textureLoad(footprint, pixel, 0).w;
        radiance *= squared_cosine * squared_cosine;
    }
    if (APERTURE) {
        let offset = textureLoad(position_instance, pixel, 0).xyz - parameters.camera_position;
        let depth = dot(offset, parameters.forward);
        let squared_cosine = depth * depth / max(dot(offset, offset), 1e-37);
        radiance *= squared_cosine * squared_cosine;
    }
    textureStore(energy, pixel, vec4<f32>(radiance * parameters.joule_per_radiance, 0.0));
}
