// What is known of a pixel's bounce. 0: nothing. It is to be gathered: one of the two below. It was gathered: UNJUDGED, or 1 + the
// error of its prediction. It was interpolated: INTERPOLATED − the error expected. Errors are over the image's radiance.

const NO_PIXEL: u32 = 0xffffffffu;
// Gathered, but there was no prediction to be judged by it.
const UNJUDGED: f32 = 0.5;
const WITH_PREDICTION: f32 = -1.0;
const WITHOUT_PREDICTION: f32 = -2.0;
const INTERPOLATED: f32 = -3.0;
fn is_gathered(state: f32) -> bool {
    return state > 0.0;
}

// In a value that differs from what is expected of it: `signal` is the square of that, without the variance of noise.
fn trust_in(signal: f32, variance: f32) -> f32 {
    return select(1.0, signal / (signal + variance), signal + variance > 0.0);
}
