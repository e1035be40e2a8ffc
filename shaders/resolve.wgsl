// Indirect radiance of every pixel from what was gathered or interpolated there.

#import reflect

#if PHONG
var gathered_specular: texture_storage_2d<rgba32float, read>;
#endif
var gathered_diffuse: texture_storage_2d<rgba32float, read>;
var indirect_radiance: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn compute_main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if (any(pixel >= textureDimensions(position_mesh)) || textureLoad(position_mesh, pixel).w == 0.0) {
        return;
    }
    var specular = vec3<f32>(0.0);
#if PHONG
    specular = textureLoad(gathered_specular, pixel).rgb;
#endif
    let radiance = reflect(pixel, textureLoad(gathered_diffuse, pixel).rgb, specular);
    textureStore(indirect_radiance, pixel, vec4<f32>(radiance, 0.0));
}
