//! The images of a Gray code, which tell the columns of a projector apart.

use image::{GrayImage, Luma};

/// Width and height.
const SIZE_PX: [u32; 2] = [256, 192];

/// All columns lit.
pub fn white() -> GrayImage {
    GrayImage::from_pixel(SIZE_PX[0], SIZE_PX[1], Luma([255]))
}

/// A bit of each column's code, the highest first, or its inverse.
pub fn bit(bit: u32, is_inverse: bool) -> GrayImage {
    GrayImage::from_fn(SIZE_PX[0], SIZE_PX[1], |x, _| {
        let is_lit = (x ^ x >> 1) >> (7 - bit) & 1 == 1;
        Luma([if is_lit != is_inverse { 255 } else { 0 }])
    })
}
