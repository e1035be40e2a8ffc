// The candidates that show a surface, those with a specular lobe apart.

#import pixel_lists
#import pixel_state

// Pixels as column + 65536 · row, or NO_PIXEL.
var<storage, read> candidates: array<u32>;
// The same, matte ones first, then glossy ones.
var<storage, read_write> receivers: array<u32>;

fn list_of(item: u32) -> u32 {
    let packed = candidates[item];
    if (packed == NO_PIXEL) {
        return NOTHING;
    }
    return list_of_pixel(vec2<u32>(packed & 0xffffu, packed >> 16u));
}

#if WRITE
fn place(item: u32, list: u32, index: u32) {
    receivers[select(0u, lengths.matte, list == GLOSSY) + index] = candidates[item];
}
#endif
