// Light of the bounce that a pixel reflects.
//
// Most images are storage images, because lavapipe reads a texel of these in a third of the time that one of a sampled image takes. The
// others are sampled images, because some devices allow only eight storage images per kernel.

#import brdf
#import refinement

var position_instance: texture_storage_2d<rgba32float, read>;
var kd_material: texture_2d<f32>;
var lobe_parameters: texture_storage_2d<rgba32float, read>;
// As the range_weights pass stores them; only if the target is an error of range.
var range_weights: texture_2d<f32>;

// Of what a pixel shows; 0 without materials that have a lobe.
fn lobe_at(pixel: vec2<u32>) -> LobeParameters {
    var lobe: LobeParameters;
    if (SPECULAR) {
        lobe = textureLoad(lobe_parameters, pixel);
    }
    return lobe;
}

// Sum of k_d and k_s times what each lobe reflects for 1.
fn reflect(pixel: vec2<u32>, diffuse: vec3<f32>, specular: vec3<f32>) -> vec3<f32> {
    var radiance = textureLoad(kd_material, pixel, 0).rgb * diffuse;
    if (SPECULAR) {
        radiance += reflected_share(textureLoad(lobe_parameters, pixel)) * specular;
    }
    return radiance;
}

// Converts sums of squared differences, diffuse and specular, to squares of reflected light, as if the bands were alike. If no material is
// specular, the second sum was never written and may be NaN.
fn reflect_squares(pixel: vec2<u32>, squares: vec2<f32>) -> f32 {
    let diffuse = reflect(pixel, vec3<f32>(0.57735027), vec3<f32>(0.0));
    var reflected = dot(diffuse, diffuse) * squares.x;
    if (SPECULAR) {
        let specular = reflect(pixel, vec3<f32>(0.0), vec3<f32>(0.57735027));
        reflected += dot(specular, specular) * squares.y;
    }
    return reflected;
}

// Factors, diffuse and specular, from what the lobes reflect of a band for 1 to what pixels see of it.
fn seen_shares(pixel: vec2<u32>, band: u32) -> vec2<f32> {
    var shares = vec2<f32>(textureLoad(kd_material, pixel, 0).rgb[band], 0.0);
    if (SPECULAR) {
        shares.y = reflected_share(textureLoad(lobe_parameters, pixel))[band];
    }
    return modulation.band_weights[band] * shares;
}

// Like reflect_squares, with the squares of the bands that pixels see.
fn reflect_phasor_squares(pixel: vec2<u32>, squares: vec2<f32>) -> f32 {
    var shares = vec2<f32>(0.0);
    for (var i = 0u; i < modulation.band_count; i++) {
        shares += seen_shares(pixel, modulation.bands[i]);
    }
    var reflected = shares.x * shares.x * squares.x;
    if (SPECULAR) {
        reflected += shares.y * shares.y * squares.y;
    }
    return reflected / f32(modulation.band_count);
}

// Factors from squared errors of Z, each frequency, to those of light.
fn error_scales_at(pixel: vec2<u32>) -> vec4<f32> {
    if (RANGE) {
        return textureLoad(range_weights, pixel, 0);
    } else {
        return modulation.error_scales;
    }
}

// The largest of the squared errors of Z, two frequencies, as an error of light.
fn worst_error_squared(pixel: vec2<u32>, pair: u32, difference: vec4<f32>) -> f32 {
    let of_pixel = error_scales_at(pixel);
    let scales = select(of_pixel.xy, of_pixel.zw, pair == 1u);
    let scaled = scales * squared_magnitudes(difference);
    return max(scaled.x, scaled.y);
}

fn worst_of(scaled: vec4<f32>) -> f32 {
    return max(max(scaled.x, scaled.y), max(scaled.z, scaled.w));
}
