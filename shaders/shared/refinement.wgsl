// What is known of a pixel between the passes of the refinement.

#import modulation

// Layers of the image `gathered`: light that the diffuse lobe reflects for k_d = 1, W/sr/m², and the pixel's state; then light of the
// specular lobe.
const DIFFUSE_LOBE: u32 = 0u;
const SPECULAR_LOBE: u32 = 1u;

// Results of a gather per receiver. For each lobe: light; with phasors, the squared differences of each frequency's Z; and Z of each pair
// of frequencies, per band.
const PHASOR_SQUARES: u32 = 2u;
const RESULT_VECTORS: u32 = select(2u, 16u, PHASORS);

// Index into a receiver's results.
fn phasor_result(pair: u32, band: u32, lobe: u32) -> u32 {
    return PHASOR_SQUARES + 2u * (1u + 3u * pair + band) + lobe;
}

// After the layers of light, `gathered` has layers of Z for each pair of frequencies and each band that pixels see. They are for k_d and
// k_s = 1, by lobe, as those of light.
fn lobe_count() -> u32 {
    return select(1u, 2u, SPECULAR);
}

// Per lobe: two pairs, three bands.
const MAX_PHASOR_LAYERS: u32 = 6u;

fn phasor_layer_count() -> u32 {
    return modulation.pair_count * modulation.band_count;
}

fn phasor_layer(index: u32, lobe: u32) -> u32 {
    return lobe_count() * (1u + index) + lobe;
}

// Limits Z of two frequencies to the light that it belongs to.
fn limit_phasors(phasors: vec4<f32>, light: f32) -> vec4<f32> {
    let magnitudes = sqrt(squared_magnitudes(phasors));
    return phasors * min(vec2<f32>(1.0), light / max(magnitudes, vec2<f32>(1e-37))).xxyy;
}

fn pair_of(index: u32) -> u32 {
    return index / modulation.band_count;
}

fn band_of(index: u32) -> u32 {
    return modulation.bands[index % modulation.band_count];
}

// An empty entry in a list of pixels. Pixels are column + 65536 · row.
const NO_PIXEL: u32 = 0xffffffffu;

// Kinds of pixels. Images start cleared to 0, the first kind.
const UNKNOWN: u32 = 0u;
// To be gathered: the images hold the prediction from its neighbours.
const PREDICTED: u32 = 1u;
// Gathered after a prediction: `error` is that of the prediction.
const GATHERED_PREDICTED: u32 = 2u;
// Gathered without a prediction to compare with.
const GATHERED_UNPREDICTED: u32 = 3u;
// `error` is the expected error.
const INTERPOLATED: u32 = 4u;
// Like PREDICTED, but from neighbours along one axis only: the error says nothing about the other axis.
const PREDICTED_ONE_WAY: u32 = 5u;

struct PixelState {
    kind: u32,
    // Over the radiance that errors are relative to, at least 0.
    error: f32,
}

// The kind is in the lowest bits of 1 + error, which is a normal number for any error.
fn encode_state(state: PixelState) -> f32 {
    return bitcast<f32>((bitcast<u32>(1.0 + state.error) & ~7u) | state.kind);
}

fn decode_state(encoded: f32) -> PixelState {
    let bits = bitcast<u32>(encoded);
    return PixelState(bits & 7u, max(bitcast<f32>(bits & ~7u) - 1.0, 0.0));
}

// Variance of a gather, over the square of the light, above which samples seldom find the light. A pixel whose samples found none is then
// not certainly dark.
const RARE: f32 = 0.1;
// Samples come in packets of rays.
const PACKET_SAMPLES: f32 = 64.0;

// Variance of the mean of `packets` packets of samples. `evenness` is the variance of one packet over that of the same number of random
// samples. More samples are more evenly distributed, so the variance falls with a `rate` of more than 1.
fn variance_of_mean(variance_of_sample: f32, packets: f32, evenness: f32, rate: f32) -> f32 {
    return evenness * variance_of_sample / PACKET_SAMPLES * pow(max(packets, 1.0), -rate);
}

fn is_gathered(state: PixelState) -> bool {
    return state.kind == GATHERED_PREDICTED || state.kind == GATHERED_UNPREDICTED;
}

// The share of a deviation from the expected value that is more than noise. `signal` is the square of the deviation less the variance of
// the noise.
fn wiener_gain(signal: f32, variance: f32) -> f32 {
    return select(1.0, signal / (signal + variance), signal + variance > 0.0);
}
