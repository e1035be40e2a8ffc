// How many samples each receiver takes: more where they scatter more. Of all ways to spend as many samples the one with the least
// noise (after Neyman 1934), for a variance that falls with a power of their number.

#import sampling

struct SampleCountParameters {
    // 1: the ranges go on from those that are there; 0: from what the image has.
    goes_on: u32,
    max_packets: u32,
    // Packets of a receiver are this times a power of its variance, over the square of the radiance that errors count over.
    packets_scale: f32,
    variance_power: f32,
    // Of a receiver of which nothing is known.
    mean_variance: f32,
    // Over the square of a receiver's radiance: samples may have missed what they did not find.
    least_variance: f32,
    // Errors count over this, W/sr/m², or over own_share times the pixel's own radiance, if that is more.
    least_radiance: f32,
    own_share: f32,
}

var gathered: texture_storage_2d_array<rgba32float, read>;
// Matte ones first, then glossy ones, and how many there are of either.
var<storage, read> receivers: array<u32>;
var<storage, read> lengths: array<u32>;
// Of each receiver the packets to take: the first one, and 65536 times the one after the last.
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
#if PHONG
    specular = textureLoad(gathered, pixel, SPECULAR).rgb;
#endif
    // All bands together.
    let radiance = length(reflect(pixel, textureLoad(gathered, pixel, DIFFUSE).rgb, specular));
    let counted = max(parameters.own_share * radiance, 1.7320508 * parameters.least_radiance);
    let around = textureLoad(samples, pixel, SAMPLED);
    // Not by the pixel's own samples: where they have missed light, they would stay few, and the pixel too dark.
    let known = reflect_variances(pixel, sampling_around(pixel));
    let variance = select(parameters.mean_variance, max(known, parameters.least_variance * radiance * radiance) / (counted * counted), known > 0.0);
    let packets = u32(ceil(min(parameters.packets_scale * pow(variance, parameters.variance_power), f32(parameters.max_packets))));
    let first = select(u32(around.x), sample_ranges[index] >> 16u, parameters.goes_on == 1u);
    sample_ranges[index] = first + (max(max(packets, 1u), first) << 16u);
}
