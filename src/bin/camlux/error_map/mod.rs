//! Error maps: signed errors as colours show where an image is too dark or too bright.

mod picture;

use camlux::metrics::{Comparison, Pixels};
use image::{Rgb, RgbImage};

use crate::reduced::Squares;

pub use picture::write_png;

/// Signed errors of an image, pixel by pixel.
pub struct ErrorMap {
    resolution_px: [u32; 2],
    reference_mean: f64,
    /// The mean of x − t over the bands, divided by the mean of t. NaN if the image or the reference is NaN; `None` if the pixel shows no
    /// surface, and on edges.
    errors: Vec<Option<f64>>,
}

impl ErrorMap {
    /// Builds the map from the pixels and their comparison. `None` if the reference has no light to be relative to.
    pub fn new(
        resolution_px: [u32; 2],
        pixels: &Pixels,
        comparison: &Comparison,
    ) -> Option<ErrorMap> {
        comparison.errors?;
        let error = |pixel: usize| {
            let is_edge = pixels.edges.is_some_and(|edges| edges[pixel]);
            (pixels.valid[pixel] && !is_edge).then(|| {
                let bands = pixel * pixels.channels..(pixel + 1) * pixels.channels;
                let differences = bands
                    .map(|band| f64::from(pixels.image[band]) - f64::from(pixels.reference[band]));
                let sum: f64 = differences.sum();
                sum / pixels.channels as f64 / comparison.reference_mean
            })
        };
        Some(ErrorMap {
            resolution_px,
            reference_mean: comparison.reference_mean,
            errors: (0..pixels.valid.len()).map(error).collect(),
        })
    }

    /// A colour range that holds 99 % of the pixels.
    pub fn range(&self) -> f64 {
        round_range(self.errors.iter().flatten().map(|error| error.abs()))
    }

    /// The map alone, with colours that end at ±`range`. It is at most `widest_px` wide: larger images are averaged over squares of pixels,
    /// counting only pixels that show a surface.
    pub fn rgb(&self, range: f64, widest_px: usize) -> RgbImage {
        let squares = Squares::new(self.resolution_px, widest_px);
        let [width, height] = squares.size_px.map(|px| px as u32);
        RgbImage::from_fn(width, height, |x, y| {
            let pixels = squares.pixels([x as usize, y as usize]);
            let errors: Vec<f64> = pixels.filter_map(|pixel| self.errors[pixel]).collect();
            if errors.is_empty() {
                return BACKGROUND;
            }
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            Rgb(diverging(mean / range))
        })
    }
}

/// A bound of 99 % of the magnitudes, rounded up to 1, 1.5, 2, 3 or 5 times a power of ten.
pub fn round_range(magnitudes: impl Iterator<Item = f64>) -> f64 {
    let mut magnitudes: Vec<f64> = magnitudes.filter(|m| m.is_finite()).collect();
    if magnitudes.is_empty() {
        return 1.0;
    }
    let rank = (magnitudes.len() * 99).div_ceil(100) - 1;
    let (_, percentile, _) = magnitudes.select_nth_unstable_by(rank, f64::total_cmp);
    // Errors below f32 precision cannot be seen; images may be equal.
    let percentile = percentile.max(1e-7);
    let power = 10_f64.powf(percentile.log10().floor());
    let steps = [1.0, 1.5, 2.0, 3.0, 5.0].map(|step| step * power);
    let fits = steps
        .into_iter()
        .find(|step| percentile <= step * 1.000_001);
    fits.unwrap_or(10.0 * power)
}

/// The colour scale, from too dark at the left to too bright.
pub fn color_bar(width: u32, height: u32) -> RgbImage {
    let share = |x: u32| 2.0 * (f64::from(x) + 0.5) / f64::from(width) - 1.0;
    RgbImage::from_fn(width, height, |x, _| Rgb(diverging(share(x))))
}

const BACKGROUND: Rgb<u8> = Rgb([128; 3]);

/// Colour of an error from −1 (blue) over 0 (almost white) to 1 (red); black for NaN. The palette is "RdBu" of ColorBrewer (Harrower and
/// Brewer 2003), which is suitable for colour-blind readers.
pub fn diverging(share: f64) -> [u8; 3] {
    const STOPS: [[u8; 3]; 11] = [
        [5, 48, 97],
        [33, 102, 172],
        [67, 147, 195],
        [146, 197, 222],
        [209, 229, 240],
        [247, 247, 247],
        [253, 219, 199],
        [244, 165, 130],
        [214, 96, 77],
        [178, 24, 43],
        [103, 0, 31],
    ];
    if share.is_nan() {
        return [0; 3];
    }
    between(&STOPS, (share + 1.0) / 2.0)
}

/// The colour at a fraction of the way along a palette.
pub fn between(stops: &[[u8; 3]], share: f64) -> [u8; 3] {
    let at = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let index = (at as usize).min(stops.len() - 2);
    let weight = at - index as f64;
    std::array::from_fn(|band| {
        let [low, high] = [stops[index][band], stops[index + 1][band]].map(f64::from);
        (low + weight * (high - low)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map of one row with one channel; background where the reference is negative.
    fn map(image: &[f32], reference: &[f32]) -> Option<ErrorMap> {
        let valid: Vec<bool> = reference.iter().map(|&t| t >= 0.0).collect();
        let pixels = Pixels {
            image,
            reference,
            image_standard_error: None,
            reference_standard_error: None,
            valid: &valid,
            edges: None,
            channels: 1,
        };
        let comparison = Comparison::new(&pixels).unwrap();
        ErrorMap::new([image.len() as u32, 1], &pixels, &comparison)
    }

    #[test]
    fn colours_tell_dark_from_bright() {
        // Mean 2; errors -0.5, 0, +0.5, none, NaN.
        let map = map(&[1.0, 2.0, 3.0, 9.0, f32::NAN], &[2.0, 2.0, 2.0, -1.0, 2.0]).unwrap();
        let colors = map.rgb(0.5, 100);
        let at = |x: u32| colors.get_pixel(x, 0).0;
        assert_eq!(at(0), [5, 48, 97]);
        assert_eq!(at(1), [247; 3]);
        assert_eq!(at(2), [103, 0, 31]);
        assert_eq!(at(3), BACKGROUND.0);
        assert_eq!(at(4), [0; 3]);
        assert_eq!(map.range(), 0.5);
        // Values outside the range get its end colour.
        assert_eq!(map.rgb(0.1, 100).get_pixel(0, 0).0, at(0));
    }

    #[test]
    fn a_wide_map_is_averaged_over_its_surfaces() {
        // Squares of 3: (0.3, -0.3, none), (none), (0.3).
        let map = map(
            &[13.0, 7.0, 0.0, 0.0, 0.0, 0.0, 13.0],
            &[10.0, 10.0, -1.0, -1.0, -1.0, -1.0, 10.0],
        )
        .unwrap();
        let colors = map.rgb(0.3, 3);
        assert_eq!(colors.dimensions(), (3, 1));
        assert_eq!(colors.get_pixel(0, 0).0, [247; 3]);
        assert_eq!(*colors.get_pixel(1, 0), BACKGROUND);
        assert_eq!(colors.get_pixel(2, 0).0, [103, 0, 31]);
    }

    #[test]
    fn range_is_the_next_round_number() {
        for (error, range) in [
            (0.12, 0.15),
            (0.2, 0.2),
            (0.6, 1.0),
            (4.0, 5.0),
            (0.0, 1e-7),
        ] {
            let found = map(&[1.0 + error], &[1.0]).unwrap().range();
            assert!((found / range - 1.0).abs() < 1e-9, "{error}: {found}");
        }
        // One pixel of 200 does not count.
        let mut image = [1.1; 200];
        image[7] = 9.0;
        let found = map(&image, &[1.0; 200]).unwrap().range();
        assert!((found - 0.1).abs() < 1e-9, "{found}");
    }

    #[test]
    fn a_black_or_empty_reference_has_no_map() {
        assert!(map(&[1.0], &[0.0]).is_none());
        assert!(map(&[1.0], &[-1.0]).is_none());
        assert!(map(&[1.0], &[f32::NAN]).is_none());
    }
}
