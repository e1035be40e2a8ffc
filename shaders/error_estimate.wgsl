// How far the image is from two independent gathers t₁, t₂ of a pixel: (x − t₁)(x − t₂) is the square of its error but for noise
// that has no mean.

#import reflect
#import refinement

struct ErrorEstimateParameters {
    receiver_count: u32,
    // Where the results of the second gather begin.
    second_result: u32,
}

var indirect_radiance: texture_storage_2d<rgba32float, read>;
var<storage, read> receivers: array<u32>;
// Two a receiver: diffuse, specular. Of noisy gathers the sums over samples, and of their squared differences. Where gathers have no
// noise, the second may be the first.
var<storage, read> results: array<vec4<f32>>;
#if NOISY
// As the sample_counts pass has it, of both gathers.
var<storage, read> sample_ranges: array<u32>;
#endif
// Two a receiver: Σ over bands of (x − t₁)(x − t₂), t₁·t₂, (t₁ − t₂)²; the variance of a sample. And the pixel; the error that was
// expected, as the resolve pass has it; packets of samples of a gather.
var<storage, read_write> estimates: array<vec4<f32>>;
var<immediate> parameters: ErrorEstimateParameters;

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = parameters.receiver_count;
    if (id.x >= count) {
        return;
    }
    let packed = receivers[id.x];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    let first = 2u * id.x;
    let second = 2u * (id.x + parameters.second_result);
    var per_sample = 1.0;
    var packets = 0.0;
#if NOISY
    packets = f32(sample_ranges[id.x] >> 16u);
    per_sample = 1.0 / (PACKET_SAMPLES * packets);
#endif
    let first_radiance = per_sample * reflect(pixel, results[first].rgb, results[first + 1u].rgb);
    let second_radiance = per_sample * reflect(pixel, results[second].rgb, results[second + 1u].rgb);
    let difference = first_radiance - second_radiance;
    let image_error = textureLoad(indirect_radiance, pixel);
    let image = image_error.rgb;
    estimates[first] = vec4<f32>(dot(image - first_radiance, image - second_radiance), dot(first_radiance, second_radiance), dot(difference, difference),
        0.5 * per_sample * reflect_squares(pixel, vec2<f32>(results[first].w + results[second].w, results[first + 1u].w + results[second + 1u].w)));
    estimates[first + 1u] = vec4<f32>(vec2<f32>(pixel), image_error.w, packets);
}
