//! Diffuse textures from PNG and JPEG files.

use std::path::Path;

use super::Texture;
use crate::{Error, Result};

/// Loads an image as linear reflectance: 8 or 16 bit, grey or RGB; an alpha channel is ignored.
///
/// # Errors
/// At `named_at`: a file that is missing, or is no PNG or JPEG.
pub(super) fn load(file: &Path, named_at: &str) -> Result<Texture> {
    let unreadable = |problem: String| {
        Error::scene(
            named_at,
            format!("cannot read the texture {}: {problem}", file.display()),
            "give the path of a PNG or JPEG file, relative to the file that names it",
        )
    };
    let pixels = image::ImageReader::open(file)
        .and_then(image::ImageReader::with_guessed_format)
        .map_err(|error| unreadable(error.to_string()))?
        .decode()
        .map_err(|error| unreadable(error.to_string()))?
        // 8-bit values become v·257, so that v·257/65535 is v/255 exactly.
        .into_rgb16();
    let decode = srgb_decoding_table();
    Ok(Texture {
        name: file.display().to_string(),
        size_px: [pixels.width(), pixels.height()],
        linear_rgb: pixels
            .pixels()
            .map(|pixel| pixel.0.map(|value| decode[usize::from(value)]))
            .collect(),
    })
}

fn srgb_decoding_table() -> Vec<f32> {
    (0..=u16::MAX)
        .map(|value| linear_from_srgb(f64::from(value) / 65535.0) as f32)
        .collect()
}

/// The sRGB transfer function, IEC 61966-2-1: encoded value 0 to 1 to linear value 0 to 1.
pub(crate) fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}
