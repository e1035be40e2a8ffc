// Which of the lists of compact.wgsl a pixel belongs to: those that show a surface, those with a specular lobe apart.

#import compact

var position_mesh: texture_2d<f32>;
var ks_shininess: texture_2d<f32>;

fn list_of_pixel(pixel: vec2<u32>) -> u32 {
    if (textureLoad(position_mesh, pixel, 0).w == 0.0) {
        return NOTHING;
    }
#if PHONG
    if (any(textureLoad(ks_shininess, pixel, 0).rgb > vec3<f32>(0.0))) {
        return GLOSSY;
    }
#endif
    return MATTE;
}
