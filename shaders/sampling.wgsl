// How a pixel was sampled.

#import refinement
#import reflect

// Σ of what the samples contribute, and of their squared differences.
var sums_diffuse: texture_storage_2d<rgba32float, read_write>;
#if PHONG
var sums_specular: texture_storage_2d<rgba32float, read_write>;
#endif
// Packets of samples; and as the pixels around have it, the variance of one sample, diffuse and specular, and their packets.
var sampling: texture_storage_2d<rgba32float, read_write>;

struct Sampling {
    packets: f32,
    // Of one sample, diffuse and specular.
    variances: vec2<f32>,
}

// The pixel's own, or what is known from those around.
fn known_sampling(pixel: vec2<u32>) -> Sampling {
    let around = textureLoad(sampling, pixel);
    var squares = vec2<f32>(textureLoad(sums_diffuse, pixel).w, 0.0);
#if PHONG
    squares.y = textureLoad(sums_specular, pixel).w;
#endif
    let is_own = around.x > 0.0;
    return Sampling(select(around.w, around.x, is_own), select(around.yz, squares / (PACKET_SAMPLES * max(around.x, 1.0)), is_own));
}
