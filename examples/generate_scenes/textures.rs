//! Two diffuse textures that repeat without a seam, a leaf, and the image of a projector. Integers only, so that every machine makes the
//! same pixels.

use image::{GrayImage, Luma, Rgb, RgbImage, Rgba, RgbaImage};

/// Edge of both textures.
const SIZE_PX: u32 = 256;

/// Brightest sRGB value: a reflectance of 0.86, because no surface reflects all light.
const BRIGHTEST: i32 = 238;

/// Floor tiles, four by four, alternating light and dark, with a grout line between them.
pub fn tiles() -> RgbImage {
    const TILE_PX: u32 = SIZE_PX / 4;
    const GROUT_PX: u32 = 3;
    RgbImage::from_fn(SIZE_PX, SIZE_PX, |x, y| {
        let (column, row) = (x / TILE_PX, y / TILE_PX);
        if x % TILE_PX < GROUT_PX || y % TILE_PX < GROUT_PX {
            return shade([120, 116, 110], grain(x, y, 8));
        }
        let tile = if (column + row) % 2 == 0 {
            [214, 206, 190]
        } else {
            [96, 104, 112]
        };
        shade(tile, grain(column, row, 24) + grain(x, y, 10))
    })
}

/// Bricks in running bond, eight courses of four, with mortar between them.
pub fn bricks() -> RgbImage {
    const LENGTH_PX: u32 = SIZE_PX / 4;
    const HEIGHT_PX: u32 = SIZE_PX / 8;
    const MORTAR_PX: u32 = 4;
    RgbImage::from_fn(SIZE_PX, SIZE_PX, |x, y| {
        let row = y / HEIGHT_PX;
        let shifted = (x + row % 2 * LENGTH_PX / 2) % SIZE_PX;
        if shifted % LENGTH_PX < MORTAR_PX || y % HEIGHT_PX < MORTAR_PX {
            return shade([176, 168, 156], grain(x, y, 14));
        }
        shade(
            [168, 92, 68],
            grain(shifted / LENGTH_PX, row, 44) + grain(x, y, 16),
        )
    })
}

/// Height of the bricks over the mortar, with rounded edges.
pub fn brick_heights() -> GrayImage {
    const LENGTH_PX: u32 = SIZE_PX / 4;
    const HEIGHT_PX: u32 = SIZE_PX / 8;
    const MORTAR_PX: u32 = 4;
    const EDGE_PX: u32 = 6;
    GrayImage::from_fn(SIZE_PX, SIZE_PX, |x, y| {
        let row = y / HEIGHT_PX;
        let shifted = (x + row % 2 * LENGTH_PX / 2) % SIZE_PX;
        let inside = |place: u32, length: u32| {
            let from_mortar = (place % length).saturating_sub(MORTAR_PX);
            from_mortar.min(length - 1 - place % length).min(EDGE_PX)
        };
        let edge = inside(shifted, LENGTH_PX).min(inside(y, HEIGHT_PX));
        Luma([(edge * 200 / EDGE_PX + (24 + grain(x, y, 10)) as u32) as u8])
    })
}

/// A leaf of five lobes with its veins; alpha is set where the leaf is. It fades out over a rim of a few pixels.
pub fn leaf() -> RgbaImage {
    const EDGE_PX: i32 = 128;
    // The end of the stem, the middle of the lobes, and their tips.
    const STEM: [i32; 2] = [64, 124];
    const HEART: [i32; 2] = [64, 84];
    const TIPS: [[i32; 2]; 5] = [[64, 6], [16, 38], [112, 38], [26, 100], [102, 100]];
    RgbaImage::from_fn(EDGE_PX as u32, EDGE_PX as u32, |x, y| {
        let at = [x as i32, y as i32];
        let lobes = TIPS.map(|tip| within(at, HEART, tip, 18));
        let lobe = lobes.into_iter().max().unwrap_or(0);
        let veins = TIPS.map(|tip| within(at, HEART, tip, 2));
        let vein = veins.into_iter().chain([within(at, HEART, STEM, 2)]).max();
        let is_vein = vein.is_some_and(|inside| inside > 0);
        let stem = within(at, STEM, HEART, 3);
        let alpha = (lobe.max(stem) * 60).clamp(0, 255) as u8;
        let srgb = if is_vein {
            [146, 176, 88]
        } else {
            [78, 128, 52]
        };
        let Rgb([r, g, b]) = shade(srgb, grain(x, y, 18));
        Rgba([r, g, b, alpha])
    })
}

/// Distance of a point inside a wedge. The wedge extends a number of pixels to either side at `from` and ends in a point at `to`. Below 0
/// outside.
fn within(at: [i32; 2], from: [i32; 2], to: [i32; 2], width: i32) -> i32 {
    let [along, offset] = [
        [to[0] - from[0], to[1] - from[1]],
        [at[0] - from[0], at[1] - from[1]],
    ];
    let square = along[0] * along[0] + along[1] * along[1];
    let place = along[0] * offset[0] + along[1] * offset[1];
    // Behind `from` it ends like a roof.
    let rest = width * (square - place.max(-place / 2)) / square;
    let length = (square as u32).isqrt() as i32;
    rest - (along[0] * offset[1] - along[1] * offset[0]).abs() / length
}

/// Stripes of a structured-light projector: a Gray code. Its bits are stacked from the coarsest to the finest.
pub fn stripes() -> GrayImage {
    const BITS: u32 = 5;
    const COLUMNS: u32 = 1 << BITS;
    GrayImage::from_fn(COLUMNS, 4 * BITS, |x, y| {
        let code = x ^ x >> 1;
        let bit = BITS - 1 - y / 4;
        Luma([if code >> bit & 1 == 1 { 255 } else { 0 }])
    })
}

/// An sRGB colour made lighter or darker.
fn shade(srgb: [i32; 3], change: i32) -> Rgb<u8> {
    Rgb(srgb.map(|value| (value + change).clamp(0, BRIGHTEST) as u8))
}

/// A number from −range/2 to range/2 that depends only on the position. Hash: Mueller's integer mixer.
fn grain(x: u32, y: u32, range: i32) -> i32 {
    let mut hash = x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b) ^ range as u32;
    for _ in 0..2 {
        hash = (hash ^ (hash >> 16)).wrapping_mul(0x45d9_f3b5);
    }
    hash ^= hash >> 16;
    (hash % (range as u32 + 1)) as i32 - range / 2
}
