// Energy on the pixel in the exposure: Q_C = E_C · SensorPixelArea · SignalDutyCycle · ExposureTime. E_C is numerically the radiance
// L*_{P→C}, as in the model; or, behind an aperture, L · (π/4)·(D/f)² · cos⁴θ, or a measured vignetting in place of cos⁴θ.

struct SensorParameters {
    // C, and the unit vector of the axis; used with an aperture whose falloff is cos⁴.
    camera_position: vec3<f32>,
    // For light along the axis.
    joule_per_radiance: f32,
    forward: vec3<f32>,
    // 1 / half the image's diagonal; these three are used with a measured vignetting.
    per_half_diagonal: f32,
    // Of r², r⁴ and r⁶.
    vignetting: vec3<f32>,
    principal_point: vec2<f32>,
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
    if (VIGNETTED) {
        let offset = (vec2<f32>(pixel) + 0.5 - parameters.principal_point) * parameters.per_half_diagonal;
        let square = dot(offset, offset);
        let k = parameters.vignetting;
        radiance *= 1.0 + square * (k.x + square * (k.y + square * k.z));
    }
    textureStore(energy, pixel, vec4<f32>(radiance * parameters.joule_per_radiance, 0.0));
}
