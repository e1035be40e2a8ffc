// What a pixel reflects of its bounce.
//
// Most images are storage images: lavapipe reads these in a third of the time that a texel of a sampled one takes it. But some devices
// have eight a kernel.

#import brdf

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
