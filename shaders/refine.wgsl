// The candidates that show a surface, those with a specular lobe apart.

@group(0) @binding(2) var position_mesh: texture_2d<f32>;
@group(0) @binding(3) var ks_shininess: texture_2d<f32>;
// Pixels as column + 65536 · row, or NO_PIXEL.
@group(0) @binding(4) var<storage, read> candidates: array<u32>;
// The same, matte ones first, then glossy ones.
@group(0) @binding(5) var<storage, read_write> receivers: array<u32>;


fn list_of(item: u32) -> u32 {
    let packed = candidates[item];
    if (packed == NO_PIXEL) {
        return NOTHING;
    }
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
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
    receivers[select(0u, lengths.matte, list == GLOSSY) + index] = candidates[item];
}
#endif
