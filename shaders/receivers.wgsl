// Lists the candidates that show a surface, those with a specular lobe separately. So the gather spends nothing on the background, and no
// lobe on a matte surface. Candidates are the points of a grid over the image, or those of a list.

#import brdf
#import compact
#import refinement

var position_instance: texture_2d<f32>;
var lobe_parameters: texture_2d<f32>;
// Pixels, or NO_PIXEL. Not read if the candidates are a grid.
var<storage, read> candidates: array<u32>;
// Matte ones first, then glossy ones.
var<storage, read_write> receivers: array<u32>;

fn candidate(item: u32) -> u32 {
    // Without branches: lavapipe compiles a kernel that branches at a push constant again for each value of the constant.
    let stride = compaction.grid_stride;
    let is_grid = stride > 0u;
    let columns = (textureDimensions(position_instance).x + stride - 1u) / max(stride, 1u);
    let point = stride * (item % max(columns, 1u) + ((item / max(columns, 1u)) << 16u));
    return select(candidates[select(item, 0u, is_grid)], point, is_grid);
}

fn list_of(item: u32) -> u32 {
    let packed = candidate(item);
    if (packed == NO_PIXEL) {
        return NOTHING;
    }
    let pixel = vec2<u32>(packed & 0xffffu, packed >> 16u);
    if (textureLoad(position_instance, pixel, 0).w == 0.0) {
        return NOTHING;
    }
    if (SPECULAR) {
        if (has_lobe(textureLoad(lobe_parameters, pixel, 0))) {
            return GLOSSY_LIST;
        }
    }
    return MATTE_LIST;
}

fn place(item: u32, list: u32, index: u32) {
    receivers[select(0u, lengths.matte, list == GLOSSY_LIST) + index] = candidate(item);
}
