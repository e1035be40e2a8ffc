//! Small pictures for the page: indirect light in the truth's exposure, and its error on one scale.

use camlux::metrics::Pixels;
use camlux::output;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::Failure;
use crate::error_map::{ErrorMap, diverging};

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
            white: output::white_radiance(truth),
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
        let image = Reduced::new(self.resolution_px.map(|px| px as usize), indirect);
        let values = image.rgb.as_flattened().iter();
        let exposed: Vec<u8> = values
            .map(|value| output::srgb_byte(value / self.white))
            .collect();
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

/// An RGB image, small enough for the page, row by row from the top.
struct Reduced {
    size_px: [usize; 2],
    rgb: Vec<[f32; 3]>,
}

impl Reduced {
    /// The means over the smallest squares that make the image narrow enough; at the right and the bottom a square may be cut.
    fn new([width, height]: [usize; 2], values: &[f32]) -> Reduced {
        let (pixels, _) = values.as_chunks::<3>();
        let edge = width.div_ceil(WIDEST_PX).max(1);
        let size_px = [width.div_ceil(edge), height.div_ceil(edge)];
        let mean = |left: usize, top: usize| {
            let columns = left..(left + edge).min(width);
            let rows = top..(top + edge).min(height);
            let count = (rows.len() * columns.len()) as f64;
            let mut sum = [0.0_f64; 3];
            for row in rows {
                for pixel in &pixels[row * width + columns.start..row * width + columns.end] {
                    for (sum, &value) in sum.iter_mut().zip(pixel) {
                        *sum += f64::from(value);
                    }
                }
            }
            sum.map(|sum| (sum / count) as f32)
        };
        let corners = (0..size_px[1]).flat_map(|y| (0..size_px[0]).map(move |x| (x, y)));
        Reduced {
            rgb: corners.map(|(x, y)| mean(x * edge, y * edge)).collect(),
            size_px,
        }
    }
}

fn png(size_px: [usize; 2], rgb: &[u8]) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive);
    let [width, height] = size_px.map(|px| px as u32);
    encoder.write_image(rgb, width, height, ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_keep_the_mean() {
        // 482 x 3 pixels in squares of 3: 161 x 1, the last column 2 wide.
        let values: Vec<f32> = (0..482 * 3).flat_map(|i| [(i % 482) as f32; 3]).collect();
        let small = Reduced::new([482, 3], &values);
        assert_eq!(small.size_px, [161, 1]);
        assert_eq!(small.rgb[0], [1.0; 3]);
        assert_eq!(small.rgb[160], [480.5; 3]);
    }
}
