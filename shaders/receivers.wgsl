// The pixels that show a surface, those with a specular term apart from those without: the gather spends no pair on the
// background and no lobe on a matte surface.

#import pixel_lists

// Pixels as column + 65536 · row, matte ones first, then glossy ones.
var<storage, read_write> receivers: array<u32>;

fn pixel_of(item: u32) -> vec2<u32> {
    let width = textureDimensions(position_mesh).x;
    return vec2<u32>(item % width, item / width);
}

fn list_of(item: u32) -> u32 {
    return list_of_pixel(pixel_of(item));
}

#if WRITE
fn place(item: u32, list: u32, index: u32) {
    let pixel = pixel_of(item);
    receivers[select(0u, lengths.matte, list == GLOSSY) + index] = pixel.x + (pixel.y << 16u);
}
#endif
