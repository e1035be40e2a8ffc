// Lists of texels in images: src/vulkan/texel_list.rs.

// Texels per row of the images, as a shift.
const ROW_SHIFT: u32 = 10u;
const ROW_MASK: u32 = 1023u;

// Place in its image of a list's texel.
fn list_place(index: u32) -> vec2<u32> {
    return vec2<u32>(index & ROW_MASK, index >> ROW_SHIFT);
}
