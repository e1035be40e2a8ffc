// What a pixel reflects of its bounce.
//
// Most images are storage images: lavapipe reads these in a third of the time that a texel of a sampled one takes it. But some devices
// have eight a kernel.

#import brdf
#if PHASORS
#import refinement
#endif

var position_mesh: texture_storage_2d<rgba32float, read>;
var kd_material: texture_2d<f32>;
#if PHONG
var ks_shininess: texture_storage_2d<rgba32float, read>;
#endif

// k_d and k_s times what each lobe reflects for 1.
fn reflect(pixel: vec2<u32>, diffuse: vec3<f32>, specular: vec3<f32>) -> vec3<f32> {
    var radiance = textureLoad(kd_material, pixel, 0).rgb * diffuse;
#if PHONG
    radiance += reflected_share(textureLoad(ks_shininess, pixel)) * specular;
#endif
    return radiance;
}

// Sums of squared differences, diffuse and specular, as squares of what is reflected, as if their bands were alike. Where no material is
// specular the second of them was never written: it may be NaN.
fn reflect_squares(pixel: vec2<u32>, squares: vec2<f32>) -> f32 {
    let diffuse = reflect(pixel, vec3<f32>(0.57735027), vec3<f32>(0.0));
    var reflected = dot(diffuse, diffuse) * squares.x;
#if PHONG
    let specular = reflect(pixel, vec3<f32>(0.0), vec3<f32>(0.57735027));
    reflected += dot(specular, specular) * squares.y;
#endif
    return reflected;
}

#if PHASORS
// What pixels see of a band that the lobes reflect for 1: diffuse, specular.
fn seen_shares(pixel: vec2<u32>, band: u32) -> vec2<f32> {
    var shares = vec2<f32>(textureLoad(kd_material, pixel, 0).rgb[band], 0.0);
#if PHONG
    shares.y = reflected_share(textureLoad(ks_shininess, pixel))[band];
#endif
    return modulation.band_weights[band] * shares;
}

// As reflect_squares has it, from those of the bands that pixels see.
fn reflect_phasor_squares(pixel: vec2<u32>, squares: vec2<f32>) -> f32 {
    var shares = vec2<f32>(0.0);
    for (var i = 0u; i < modulation.band_count; i++) {
        shares += seen_shares(pixel, modulation.bands[i]);
    }
    var reflected = shares.x * shares.x * squares.x;
#if PHONG
    reflected += shares.y * shares.y * squares.y;
#endif
    return reflected / f32(modulation.band_count);
}

// The worst of the squared errors of Z, two frequencies, as one of light.
fn worst_error_squared(pair: u32, difference: vec4<f32>) -> f32 {
    let scales = select(modulation.error_scales.xy, modulation.error_scales.zw, pair == 1u);
    return max(scales.x * dot(difference.xy, difference.xy), scales.y * dot(difference.zw, difference.zw));
}

fn worst_of(scaled: vec4<f32>) -> f32 {
    return max(max(scaled.x, scaled.y), max(scaled.z, scaled.w));
}
#endif
