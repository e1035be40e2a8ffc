// What a pixel reflects of its bounce.

@group(0) @binding(0) var position_mesh: texture_2d<f32>;
@group(0) @binding(1) var kd_material: texture_2d<f32>;
#if PHONG
@group(0) @binding(2) var ks_shininess: texture_2d<f32>;
#endif

const PI: f32 = 3.14159265358979;

// k_d/π · diffuse + k_s·(s+2)/(2π) · specular
fn reflect(pixel: vec2<u32>, diffuse: vec3<f32>, specular: vec3<f32>) -> vec3<f32> {
    var radiance = textureLoad(kd_material, pixel, 0).rgb / PI * diffuse;
#if PHONG
    let gloss = textureLoad(ks_shininess, pixel, 0);
    radiance += gloss.rgb * ((gloss.w + 2.0) / (2.0 * PI)) * specular;
#endif
    return radiance;
}
