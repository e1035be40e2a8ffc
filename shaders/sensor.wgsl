// Energy on the pixel in the exposure: Q_C = E_C · SensorPixelArea · SignalDutyCycle · ExposureTime. E_C is numerically the radiance
// L*_{P→C}, as in the model; or, behind an aperture, L · (π/4)·(D/f)² · cos⁴θ, or a measured vignetting in place of cos⁴θ: a polynomial or a map.

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
    // Of the vignetting map.
    map_size: vec2<u32>,
}

var direct_radiance: texture_2d<f32>;
var indirect_radiance: texture_2d<f32>;
var emission: texture_2d<f32>;
var position_instance: texture_2d<f32>;
// Filled by the pixel_filter pass.
var footprint: texture_2d<f32>;
// Row by row from the top.
var<storage> vignetting_map: array<f32>;
var energy: texture_storage_2d<rgba32float, write>;
var<immediate> parameters: SensorParameters;

// The vignetting at a pixel's centre, between the four pixels of the map around it. Places are whole numbers of parts of the map's pixels: f32
// would round them to fractions of a large map's pixels.
fn mapped(pixel: vec2<u32>, resolution: vec2<u32>) -> f32 {
    let size = vec2<i32>(parameters.map_size);
    let parts = 2 * vec2<i32>(resolution);
    let place = (2 * vec2<i32>(pixel) + 1) * size - vec2<i32>(resolution);
    // The place is above -parts, and / rounds towards 0.
    let before = (place + parts) / parts - 1;
    let share = vec2<f32>(place - before * parts) / vec2<f32>(parts);
    let first = max(before, vec2<i32>(0));
    let second = min(before + 1, size - 1);
    let upper = mix(vignetting_map[first.y * size.x + first.x], vignetting_map[first.y * size.x + second.x], share.x);
    let lower = mix(vignetting_map[second.y * size.x + first.x], vignetting_map[second.y * size.x + second.x], share.x);
    return mix(upper, lower, share.y);
}

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
    if (MAPPED) {
        radiance *= mapped(pixel, size);
    }
    textureStore(energy, pixel, vec4<f32>(radiance * parameters.joule_per_radiance, 0.0));
}
