//! Small pictures for the page: indirect light in the truth's exposure, and its error on one scale.

use camlux::metrics::Pixels;
use camlux::output::{srgb_byte, white_radiance};

use crate::Failure;
use crate::error_map::{ErrorMap, diverging};
use crate::output::png;
use crate::reduced::Reduced;

/// Widest picture. Larger images are averaged over squares of pixels.
const WIDEST_PX: usize = 240;
/// Error, over the truth's mean, at which the colours end: fixed, so that pictures of all settings, scenes and reports can
/// be compared.
pub const ERROR_RANGE: f64 = 1.0;
/// The bar that shows the colours.
const COLOR_BAR_PX: [usize; 2] = [200, 14];

/// PNG files of one entry.
pub struct Pictures {
    pub indirect: Vec<u8>,
    /// `None` for the truth itself, and where it is black.
    pub error: Option<Vec<u8>>,
    pub size_px: [usize; 2],
}

/// What the colours of the errors mean, from too dark to too bright.
pub struct ColorBar {
    pub png: Vec<u8>,
    pub size_px: [usize; 2],
}

/// What all pictures of a scene are shown by: the truth's indirect light.
pub struct Gallery {
    resolution_px: [u32; 2],
    truth: Vec<f32>,
    /// Pixels that show a surface.
    valid: Vec<bool>,
    /// Pixels on edges, which have no error.
    edges: Vec<bool>,
    /// Radiance of full brightness, W/sr/m².
    white: f32,
}

impl Gallery {
    pub fn new(resolution_px: [u32; 2], truth: &[f32], valid: &[bool], edges: &[bool]) -> Gallery {
        Gallery {
            resolution_px,
            truth: truth.to_vec(),
            valid: valid.to_vec(),
            edges: edges.to_vec(),
            white: white_radiance(truth),
        }
    }

    /// # Errors
    /// Where a PNG cannot be encoded.
    pub fn of_truth(&self) -> Result<Pictures, Failure> {
        self.pictures(&self.truth, None)
    }

    /// Pictures of an image of the gallery's size; without a map where the truth is black.
    ///
    /// # Errors
    /// Where a PNG cannot be encoded.
    pub fn of_image(&self, indirect: &[f32]) -> Result<Pictures, Failure> {
        let map = ErrorMap::new(
            self.resolution_px,
            &Pixels {
                image: indirect,
                reference: &self.truth,
                image_standard_error: None,
                reference_standard_error: None,
                valid: &self.valid,
                edges: Some(&self.edges),
                channels: 3,
            },
        );
        self.pictures(indirect, map)
    }

    fn pictures(&self, indirect: &[f32], map: Option<ErrorMap>) -> Result<Pictures, Failure> {
        let image = Reduced::new(self.resolution_px, indirect, WIDEST_PX);
        let values = image.rgb.as_flattened().iter();
        let exposed: Vec<u8> = values.map(|value| srgb_byte(value / self.white)).collect();
        let error = map.map(|map| png(image.size_px, &map.rgb(ERROR_RANGE, WIDEST_PX)));
        Ok(Pictures {
            indirect: png(image.size_px, &exposed)?,
            error: error.transpose()?,
            size_px: image.size_px,
        })
    }
}

/// # Errors
/// Where the PNG cannot be encoded.
pub fn color_bar() -> Result<ColorBar, Failure> {
    let [width, height] = COLOR_BAR_PX;
    let share = |x: usize| 2.0 * (x as f64 + 0.5) / width as f64 - 1.0;
    let row: Vec<u8> = (0..width).flat_map(|x| diverging(share(x))).collect();
    Ok(ColorBar {
        png: png(COLOR_BAR_PX, &row.repeat(height))?,
        size_px: COLOR_BAR_PX,
    })
}
