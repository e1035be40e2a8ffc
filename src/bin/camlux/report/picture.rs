//! Small pictures for the page: indirect light at the exposure of the reference, and its error on one scale.

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use camlux::output::srgb_byte;
use serde::{Deserialize, Serialize};

use crate::Failure;
use crate::error_map::{self, ErrorMap};
use crate::output::png;
use crate::reduced::Reduced;

/// Maximum width. Larger images are averaged over squares of pixels.
const WIDEST_PX: usize = 400;
/// Error, relative to the mean of the reference, at which the colour scale ends. It is fixed, so that pictures of all settings, scenes and
/// reports can be compared.
pub const ERROR_RANGE: f64 = 1.0;

/// A PNG file.
#[derive(Serialize, Deserialize)]
pub struct Picture {
    pub png_base64: String,
    pub size_px: [usize; 2],
}

/// The pictures of one entry.
#[derive(Serialize, Deserialize)]
pub struct Pictures {
    pub indirect: Picture,
    /// `None` for the reference itself, and if it is black.
    pub error: Option<Picture>,
}

impl Picture {
    fn new(size_px: [usize; 2], rgb: &[u8]) -> Result<Picture, Failure> {
        Ok(Picture {
            png_base64: BASE64.encode(png(size_px, rgb)?),
            size_px,
        })
    }

    /// The legend of the error colours, from too dark to too bright.
    ///
    /// # Errors
    /// If the PNG cannot be encoded.
    pub fn of_colors() -> Result<Picture, Failure> {
        Picture::new([200, 14], &error_map::color_bar(200, 14))
    }
}

impl Pictures {
    /// Shows an image with `white` as the radiance of full brightness, in W/sr/m².
    ///
    /// # Errors
    /// If a PNG cannot be encoded.
    pub fn new(
        resolution_px: [u32; 2],
        indirect: &[f32],
        white: f32,
        map: Option<&ErrorMap>,
    ) -> Result<Pictures, Failure> {
        let Reduced { size_px, rgb } = Reduced::new(resolution_px, indirect, WIDEST_PX);
        let values = rgb.as_flattened().iter();
        let exposed: Vec<u8> = values.map(|value| srgb_byte(value / white)).collect();
        let error = map.map(|map| Picture::new(size_px, &map.rgb(ERROR_RANGE, WIDEST_PX)));
        Ok(Pictures {
            indirect: Picture::new(size_px, &exposed)?,
            error: error.transpose()?,
        })
    }
}
