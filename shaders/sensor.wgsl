// Energy on the pixel in the exposure: Q_C = E_C · SensorPixelArea · SignalDutyCycle · ExposureTime, with E_C numerically
// the radiance L*_{P→C}, as the model has it.

struct SensorParameters {
    joule_per_irradiance: f32,
}

var direct_radiance: texture_2d<f32>;
var indirect_radiance: texture_2d<f32>;
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
#if INDIRECT
    radiance += textureLoad(indirect_radiance, pixel, 0).rgb;
#endif
    textureStore(energy, pixel, vec4<f32>(radiance * parameters.joule_per_irradiance, 0.0));
}
