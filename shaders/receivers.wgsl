// The pixels that show a surface, those with a specular term apart from those without: the gather spends no pair on the
// background and no lobe on a matte surface.

@group(0) @binding(2) var position_mesh: texture_2d<f32>;
@group(0) @binding(3) var ks_shininess: texture_2d<f32>;
// Pixels as column + 65536 · row, matte ones first, then glossy ones.
@group(0) @binding(4) var<storage, read_write> receivers: array<u32>;

fn pixel_of(item: u32) -> vec2<u32> {
    let width = textureDimensions(position_mesh).x;
    return vec2<u32>(item % width, item / width);
}

fn list_of(item: u32) -> u32 {
    let pixel = pixel_of(item);
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

#if WRITE
fn place(item: u32, list: u32, index: u32) {
    let pixel = pixel_of(item);
    receivers[select(0u, lengths.matte, list == GLOSSY) + index] = pixel.x + (pixel.y << 16u);
}
#endif
