//! Small pictures for the page: indirect light in the truth's exposure, and its error on one scale.

use camlux::output::{error_color, srgb_bytes, white_radiance};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::Failure;

/// Widest picture. Larger images are averaged over squares of pixels.
const WIDEST_PX: usize = 240;
/// Error, over the truth's mean, at which the colours end: fixed, so that pictures of all settings, scenes and reports can
/// be compared.
pub const ERROR_RANGE: f64 = 0.5;
/// Pixels of the bar that shows the colours.
const COLOR_BAR_PX: [usize; 2] = [200, 14];

/// PNG files of one entry.
pub struct Pictures {
    pub indirect: Vec<u8>,
    /// `None` for the truth itself.
    pub error: Option<Vec<u8>>,
    pub size_px: [usize; 2],
}

/// What the colours of the errors mean.
pub struct ColorBar {
    pub png: Vec<u8>,
    pub size_px: [usize; 2],
}

/// The truth's indirect light, reduced to the pictures' size, and what all pictures are shown by.
pub struct Gallery {
    size_px: [usize; 2],
    truth: Reduced,
    white: f32,
    /// Mean over all bands of the pixels with a surface.
    mean: f64,
}
