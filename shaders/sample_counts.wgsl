// Sets the number of samples of each receiver. Of all ways to spend the same number of samples, this one leaves the least error after
// smoothing, for a variance that falls with a power of their number. A pixel that its neighbours predict takes few; one without such
// neighbours takes more where samples scatter more (Neyman 1934).

#import sampling

struct SampleCountParameters {
    // 1: the ranges continue from the packets in the image; 0: they begin with the first packet.
    continues: u32,
    max_packets: u32,
    // 1: the receivers' light is smoothed.
    is_smoothed: u32,
    // A receiver without a model takes this many packets times its variance to the power of 1/(1 + variance_rate). The variance is over the
    // square of the radiance that errors are relative to.
    packets_scale: f32,
    // The variance of a gather falls with this power of its packets. With one packet, it is packet_variance times that of a sample.
    variance_rate: f32,
    packet_variance: f32,
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

// The packets for which the squared error after smoothing, plus their price, is least. In units of packet_variance.
fn packets_for_model(variance: f32, model_error: f32, leverage: f32) -> u32 {
    // With this price, the optimum without a model is that of packets_scale.
    let price = parameters.variance_rate * pow(parameters.packets_scale, -1.0 - parameters.variance_rate);
    var best = 1u;
    var least = 1e37;
    for (var packets = 1u; packets <= parameters.max_packets; packets += 1u + packets / 4u) {
        let own = variance * pow(f32(packets), -parameters.variance_rate);
        let of_model = model_error + leverage * own;
        let total = own * of_model / max(own + of_model, 1e-37) + price * f32(packets);
        best = select(best, packets, total < least);
        least = min(least, total);
    }
    return best;
}

@compute @workgroup_size(64)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.x;
    if (index >= lengths[0] + lengths[1]) {
        return;
    }
    let packed = receivers[index];
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    var specular = vec3<f32>(0.0);
    if (SPECULAR) {
        specular = textureLoad(gathered, pixel, SPECULAR_LOBE).rgb;
    }
    // All bands together.
    let radiance = length(reflect(pixel, textureLoad(gathered, pixel, DIFFUSE_LOBE).rgb, specular));
    let counted = max(parameters.own_share * radiance, 1.7320508 * parameters.least_radiance);
    let around = textureLoad(samples, pixel, SAMPLING);
    // Not from the pixel's own samples: if they missed light, their number would stay low, and the pixel too dark.
    let sampling = sampling_around(pixel);
    let known = reflect_variances(pixel, sampling);
    let variance = select(parameters.mean_variance, max(known, parameters.least_variance * radiance * radiance) / (counted * counted), known > 0.0);
    let unmodelled = parameters.packets_scale * pow(variance, 1.0 / (1.0 + parameters.variance_rate));
    var packets = u32(ceil(min(unmodelled, f32(parameters.max_packets))));
    let model = model_at(pixel);
    if (parameters.is_smoothed == 1u && model.is_known) {
        let unit = counted * counted * parameters.packet_variance;
        packets = packets_for_model(variance, reflect_model_errors(pixel, model, sampling) / unit, model.leverage);
    }
    let first = select(0u, u32(around.x), parameters.continues == 1u);
    sample_ranges[index] = first + (max(max(packets, 1u), first) << 16u);
}
