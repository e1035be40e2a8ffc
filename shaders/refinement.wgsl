// What is known of a pixel between the passes of the refinement.

// Layers of the image `gathered`: what the diffuse lobe reflects for k_d = 1, W/sr/m², and the pixel's state; and what the specular lobe does.
const DIFFUSE: u32 = 0u;
const SPECULAR: u32 = 1u;

// Where a list of pixels has none. Pixels are column + 65536 · row.
const NO_PIXEL: u32 = 0xffffffffu;

// Kinds of pixels. Images begin cleared, so 0 is the first.
const UNKNOWN: u32 = 0u;
// To be gathered: the images hold what its neighbours predict.
const PREDICTED: u32 = 1u;
// Gathered after it was predicted: `error` is that of the prediction.
const GATHERED: u32 = 2u;
// Gathered without a prediction to compare with.
const GATHERED_UNPREDICTED: u32 = 3u;
// `error` is the one expected.
const INTERPOLATED: u32 = 4u;
// As PREDICTED, but from neighbours along one axis only: its error tells nothing of the other.
const PREDICTED_ONE_WAY: u32 = 5u;

struct PixelState {
    kind: u32,
    // Over the radiance that errors count over, at least 0.
    error: f32,
}

// The kind lies in the lowest bits of 1 + error, which is a normal number whatever the error.
fn encode_state(state: PixelState) -> f32 {
    return bitcast<f32>((bitcast<u32>(1.0 + state.error) & ~7u) | state.kind);
}

fn decode_state(encoded: f32) -> PixelState {
    let bits = bitcast<u32>(encoded);
    return PixelState(bits & 7u, max(bitcast<f32>(bits & ~7u) - 1.0, 0.0));
}

// Variance of a gather over the square of the light, from where on samples find it seldom: then a pixel that has found none is not
// dark without doubt.
const RARE: f32 = 0.1;
// Samples come in packets of rays.
const PACKET_SAMPLES: f32 = 64.0;

// Variance of the mean of so many packets of samples. `evenness` is the variance of one packet over that of as many samples at random;
// samples fall more evenly the more there are, so the variance falls with a `rate` of more than 1.
fn variance_of_mean(variance_of_sample: f32, packets: f32, evenness: f32, rate: f32) -> f32 {
    return evenness * variance_of_sample / PACKET_SAMPLES * pow(max(packets, 1.0), -rate);
}

fn is_gathered(state: PixelState) -> bool {
    return state.kind == GATHERED || state.kind == GATHERED_UNPREDICTED;
}

// The share of a deviation from what is expected that is more than noise: `signal` is the square of the deviation less the
// variance of the noise.
fn wiener_gain(signal: f32, variance: f32) -> f32 {
    return select(1.0, signal / (signal + variance), signal + variance > 0.0);
}
