//! Small pictures for the page: indirect light in the truth's exposure, and its error on one scale.

use camlux::output;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::Failure;

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
    /// `None` for the truth itself.
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
    image_px: [usize; 2],
    truth: Reduced,
    /// Radiance of full brightness, W/sr/m².
    white: f32,
    /// Mean of the truth, over all bands of the pixels with a surface, W/sr/m².
    mean: f64,
}

impl Gallery {
    /// For images of `image_px` pixels; `truth` and `valid` are the truth's indirect light and its pixels with a surface.
    pub fn new(image_px: [usize; 2], truth: &[f32], valid: &[bool]) -> Gallery {
        let (pixels, _) = truth.as_chunks::<3>();
        let seen = pixels.iter().zip(valid).filter(|(_, is_seen)| **is_seen);
        let sum: f64 = seen
            .clone()
            .flat_map(|(pixel, _)| pixel)
            .map(|&value| f64::from(value))
            .sum();
        Gallery {
            image_px,
            truth: Reduced::new(image_px, truth),
            white: output::white_radiance(truth),
            mean: sum / (3 * seen.count().max(1)) as f64,
        }
    }

    /// # Errors
    /// Where a PNG cannot be encoded.
    pub fn of_truth(&self) -> Result<Pictures, Failure> {
        Ok(Pictures {
            indirect: self.exposed(&self.truth)?,
            error: None,
            size_px: self.truth.size_px,
        })
    }

    /// Pictures of an image of the gallery's size.
    ///
    /// # Errors
    /// Where a PNG cannot be encoded.
    pub fn of_image(&self, indirect: &[f32]) -> Result<Pictures, Failure> {
        let image = Reduced::new(self.image_px, indirect);
        let pairs = image.rgb.iter().zip(&self.truth.rgb);
        let colors: Vec<u8> = pairs
            .flat_map(|(x, t)| {
                let difference: f32 = (0..3).map(|band| x[band] - t[band]).sum();
                diverging(f64::from(difference) / 3.0 / self.mean / ERROR_RANGE)
            })
            .collect();
        Ok(Pictures {
            indirect: self.exposed(&image)?,
            error: Some(png(image.size_px, &colors)?),
            size_px: image.size_px,
        })
    }

    fn exposed(&self, image: &Reduced) -> Result<Vec<u8>, Failure> {
        let values = image.rgb.as_flattened().iter();
        let bytes: Vec<u8> = values
            .map(|value| output::srgb_byte(value / self.white))
            .collect();
        png(image.size_px, &bytes)
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

/// From blue at −1 over white at 0 to red at 1, and no further: red and blue of ColorBrewer's RdBu (Brewer 2003), which the
/// colour-blind can tell apart.
fn diverging(share: f64) -> [u8; 3] {
    let end = if share < 0.0 {
        [33.0, 102.0, 172.0]
    } else {
        [178.0, 24.0, 43.0]
    };
    let strength = share.abs().min(1.0);
    end.map(|end: f64| (255.0 + strength * (end - 255.0)).round() as u8)
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
    fn errors_are_white_at_zero_and_end_at_one() {
        assert_eq!(diverging(0.0), [255; 3]);
        assert_eq!(diverging(-1.0), diverging(-7.0));
        assert_ne!(diverging(-1.0), diverging(1.0));
    }

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
