// What is known of a pixel's bounce: 0 nothing; negative: it is to be gathered; else its value, and 1 + the error expected of
// its neighbours' predictions, W/sr/m², or UNJUDGED.

const NO_PIXEL: u32 = 0xffffffffu;
// Gathered, but there was no prediction to be judged by it.
const UNJUDGED: f32 = 0.5;
const WITH_PREDICTION: f32 = -1.0;
const WITHOUT_PREDICTION: f32 = -2.0;
