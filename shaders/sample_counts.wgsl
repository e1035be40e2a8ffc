// Sets the number of samples of each receiver: more where samples scatter more. Of all ways to spend the same number of samples, this one
// has the least noise (after Neyman 1934), for a variance that falls with a power of their number.

#import sampling

struct SampleCountParameters {
    // 1: the ranges continue from the stored ones; 0: from the packets in the image.
    goes_on: u32,
    max_packets: u32,
    // Packets of a receiver are this times a power of its variance, over the square of the radiance that errors are relative to.
    packets_scale: f32,
    variance_power: f32,
    // For a receiver whose variance is not known.
    mean_variance: f32,
    // Over the square of a receiver's radiance: samples may have missed light.
    least_variance: f32,
    // Errors are relative to this, W/sr/m², or to own_share times the pixel's own radiance, if that is more.
    least_radiance: f32,
    own_share: f32,
}

var gathered: texture_storage_2d_array<rgba32float, read>;
// Matte ones first, then glossy ones; and the number of each.
var<storage, read> receivers: array<u32>;
var<storage, read> lengths: array<u32>;
// Packets that each receiver takes: first + 65536 · end, where end is one after the last.
var<storage, read_write> sample_ranges: array<u32>;
var<immediate> parameters: SampleCountParameters;

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.x;
    if (index >= lengths[0] + lengths[1]) {
        return;
    }
    let packed = receivers[index];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    var specular = vec3<f32>(0.0);
    if (PHONG) {
        specular = textureLoad(gathered, pixel, SPECULAR).rgb;
    }
    // All bands together.
    let radiance = length(reflect(pixel, textureLoad(gathered, pixel, DIFFUSE).rgb, specular));
    let counted = max(parameters.own_share * radiance, 1.7320508 * parameters.least_radiance);
    let around = textureLoad(samples, pixel, SAMPLING);
    // Not from the pixel's own samples: if they missed light, their number would stay low, and the pixel too dark.
    let known = reflect_variances(pixel, sampling_around(pixel));
    let variance = select(parameters.mean_variance, max(known, parameters.least_variance * radiance * radiance) / (counted * counted), known > 0.0);
    let packets = u32(ceil(min(parameters.packets_scale * pow(variance, parameters.variance_power), f32(parameters.max_packets))));
    let first = select(u32(around.x), sample_ranges[index] >> 16u, parameters.goes_on == 1u);
    sample_ranges[index] = first + (max(max(packets, 1u), first) << 16u);
}
