// How a pixel was sampled.

#import refinement
#import reflect

var samples: texture_storage_2d_array<rgba32float, read_write>;

// Layers of it. Packets of samples; and as the pixels around have it, the variance of one sample, diffuse and specular, and their packets.
const SAMPLED: u32 = 0u;
// Σ of what the samples contribute, and of their squared differences.
const SUMS_DIFFUSE: u32 = 1u;
const SUMS_SPECULAR: u32 = 2u;

struct Sampling {
    packets: f32,
    // Of one sample, diffuse and specular.
    variances: vec2<f32>,
}

// The pixel's own, or what is known from those around.
fn known_sampling(pixel: vec2<u32>) -> Sampling {
    let around = textureLoad(samples, pixel, SAMPLED);
    var squares = vec2<f32>(textureLoad(samples, pixel, SUMS_DIFFUSE).w, 0.0);
#if PHONG
    squares.y = textureLoad(samples, pixel, SUMS_SPECULAR).w;
#endif
    let is_own = around.x > 0.0;
    return Sampling(select(around.w, around.x, is_own), select(around.yz, squares / (PACKET_SAMPLES * max(around.x, 1.0)), is_own));
}
