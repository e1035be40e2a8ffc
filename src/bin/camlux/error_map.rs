//! Where an image is too dark and too bright: signed errors as colours.

use std::convert::Infallible;

use camlux::metrics::Pixels;
use camlux::output::OutputFile;
use embedded_graphics::Drawable;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::ascii::{FONT_7X13, FONT_7X13_BOLD};
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::text::{Alignment, Text};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, Rgb, RgbImage};

use crate::Failure;

/// Signed errors of an image, pixel by pixel.
pub struct ErrorMap {
    size_px: [usize; 2],
    /// The mean over the bands of x − t, over the mean of t over all valid pixels and bands; not a number where the image or
    /// the reference is none, `None` where no surface is seen.
    errors: Vec<Option<f64>>,
}

impl ErrorMap {
    /// For slices that fit together. `None` where the mean of the reference is not over 0.
    pub fn new(resolution_px: [u32; 2], pixels: &Pixels) -> Option<ErrorMap> {
        let channels = pixels.channels;
        let valid = || pixels.valid.iter().enumerate().filter(|(_, valid)| **valid);
        let values = valid()
            .flat_map(|(pixel, _)| &pixels.reference[pixel * channels..(pixel + 1) * channels])
            .filter(|value| value.is_finite());
        let (mut sum, mut count) = (0.0, 0_usize);
        for &value in values {
            sum += f64::from(value);
            count += 1;
        }
        let mean = sum / count as f64;
        if count == 0 || mean <= 0.0 {
            return None;
        }
        let mut errors = vec![None; pixels.valid.len()];
        for (pixel, _) in valid() {
            let bands = pixel * channels..(pixel + 1) * channels;
            let difference: f64 = bands
                .map(|index| f64::from(pixels.image[index]) - f64::from(pixels.reference[index]))
                .sum();
            errors[pixel] = Some(difference / channels as f64 / mean);
        }
        Some(ErrorMap {
            size_px: resolution_px.map(|px| px as usize),
            errors,
        })
    }

    /// A range of colours that 99 % of the pixels do not leave: the next of 1, 1.5, 2, 3 and 5 times a power of ten.
    pub fn range(&self) -> f64 {
        let mut magnitudes: Vec<f64> = self.errors.iter().flatten().map(|e| e.abs()).collect();
        magnitudes.retain(|magnitude| magnitude.is_finite());
        if magnitudes.is_empty() {
            return 1.0;
        }
        let rank = (magnitudes.len() * 99).div_ceil(100) - 1;
        let (_, percentile, _) = magnitudes.select_nth_unstable_by(rank, f64::total_cmp);
        // Below that of f32 there is nothing to see; images may be equal.
        let percentile = percentile.max(1e-7);
        let power = 10_f64.powf(percentile.log10().floor());
        let steps = [1.0, 1.5, 2.0, 3.0, 5.0].map(|step| step * power);
        let fits = steps
            .into_iter()
            .find(|step| percentile <= step * 1.000_001);
        fits.unwrap_or(10.0 * power)
    }

    /// The map alone, colours ending at ±`range`. It is not wider than `widest_px`: larger images are averaged over squares of
    /// pixels, their surfaces only.
    pub fn rgb(&self, range: f64, widest_px: usize) -> RgbImage {
        let [width, height] = self.size_px;
        let edge = width.div_ceil(widest_px.max(1)).max(1);
        let size = [width, height].map(|px| px.div_ceil(edge) as u32);
        RgbImage::from_fn(size[0], size[1], |x, y| {
            let [left, top] = [x, y].map(|px| px as usize * edge);
            let rows = top..(top + edge).min(height);
            let seen = rows.flat_map(|row| {
                let row = row * width;
                self.errors[row + left..row + (left + edge).min(width)]
                    .iter()
                    .flatten()
            });
            let (sum, count) = seen.fold((0.0, 0), |(sum, count), error| (sum + error, count + 1));
            if count == 0 {
                return BACKGROUND;
            }
            Rgb(diverging(sum / f64::from(count) / range))
        })
    }
}

const BACKGROUND: Rgb<u8> = Rgb([128; 3]);
const PAPER: Rgb<u8> = Rgb([255; 3]);
const INK: Rgb888 = Rgb888::new(34, 34, 34);

/// Colour of an error from −1 (blue) over 0 (almost white) to 1 (red); black for what is not a number. The palette is
/// "RdBu" of ColorBrewer (Harrower and Brewer 2003), made for the colour-blind, too.
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
    let at = (share.clamp(-1.0, 1.0) + 1.0) / 2.0 * (STOPS.len() - 1) as f64;
    let index = (at as usize).min(STOPS.len() - 2);
    let weight = at - index as f64;
    std::array::from_fn(|band| {
        let [low, high] = [STOPS[index][band], STOPS[index + 1][band]].map(f64::from);
        (low + weight * (high - low)).round() as u8
    })
}

/// What a map shows.
pub struct Title<'a> {
    pub layer: &'a str,
    pub reference_mean: f64,
    pub unit: &'a str,
}

/// A map is drawn no smaller, so that one of few pixels can be seen, and no larger.
const LEAST_PX: u32 = 480;
const MOST_PX: usize = 2048;
const MARGIN_PX: u32 = 16;
const LEGEND_PX: u32 = 88;
const BAR_HEIGHT_PX: u32 = 14;

/// Writes the map with a bar of its colours as a PNG and gives the file its name.
///
/// # Errors
/// When the file cannot be written.
pub fn write_png(mut file: OutputFile, map: &ErrorMap, title: &Title) -> Result<(), Failure> {
    let picture = picture(map, title);
    let (width, height) = picture.dimensions();
    PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Up)
        .write_image(&picture, width, height, ExtendedColorType::Rgb8)
        .map_err(|error| file.failed(&error))?;
    Ok(file.commit()?)
}

fn picture(map: &ErrorMap, title: &Title) -> RgbImage {
    let range = map.range();
    let colors = map.rgb(range, MOST_PX);
    let scale = (LEAST_PX / colors.width()).max(1);
    let [map_width, map_height] = [colors.width(), colors.height()].map(|px| px * scale);
    let width = map_width.max(LEAST_PX) + 2 * MARGIN_PX;
    let legend_top = map_height + 2 * MARGIN_PX;
    let left = (width - map_width) / 2;
    let mut canvas = Canvas(RgbImage::from_pixel(width, legend_top + LEGEND_PX, PAPER));
    for y in 0..map_height {
        for x in 0..map_width {
            let color = *colors.get_pixel(x / scale, y / scale);
            canvas.0.put_pixel(left + x, MARGIN_PX + y, color);
        }
    }

    let middle = width as i32 / 2;
    let top = legend_top as i32;
    let bold = MonoTextStyle::new(&FONT_7X13_BOLD, INK);
    let plain = MonoTextStyle::new(&FONT_7X13, INK);
    let Title {
        layer,
        reference_mean,
        unit,
    } = title;
    canvas.write(
        &format!("{layer}: image - reference"),
        middle,
        top + 10,
        bold,
    );
    let mean = format!("relative to the mean of the reference, {reference_mean:.3e} {unit}");
    canvas.write(mean.trim_end(), middle, top + 26, plain);

    let bar_width = LEAST_PX - 64;
    let bar_left = (width - bar_width) / 2;
    for x in 0..bar_width {
        let share = 2.0 * (f64::from(x) + 0.5) / f64::from(bar_width) - 1.0;
        for y in 0..BAR_HEIGHT_PX {
            canvas
                .0
                .put_pixel(bar_left + x, legend_top + 36 + y, Rgb(diverging(share)));
        }
    }
    for share in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let x = bar_left as i32 + ((share + 1.0) / 2.0 * f64::from(bar_width - 1)).round() as i32;
        for y in 0..4 {
            canvas
                .0
                .put_pixel(x as u32, legend_top + 36 + BAR_HEIGHT_PX + y, Rgb([34; 3]));
        }
        canvas.write(&tick(share * range), x, top + 66, plain);
    }
    let is_number = |error: &f64| !error.is_nan();
    let mut key = "blue: too dark, red: too bright".to_owned();
    if map.errors.iter().any(Option::is_none) {
        key.push_str(", grey: no surface");
    }
    if !map.errors.iter().flatten().all(is_number) {
        key.push_str(", black: not a number");
    }
    canvas.write(&key, middle, top + 83, plain);
    canvas.0
}

/// A share as percent with a sign, in as few digits as it has.
fn tick(share: f64) -> String {
    let percent = share * 100.0;
    match percent {
        0.0 => "0".into(),
        p if p.abs() < 1e-2 => format!("{p:+.1e} %"),
        // Ranges and their halves have three digits.
        p => format!("{:+} %", (p * 1e4).round() / 1e4),
    }
}

struct Canvas(RgbImage);

impl Canvas {
    fn write(&mut self, text: &str, middle: i32, baseline: i32, style: MonoTextStyle<Rgb888>) {
        let text =
            Text::with_alignment(text, Point::new(middle, baseline), style, Alignment::Center);
        let Ok(_) = text.draw(self);
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.0.width(), self.0.height())
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = embedded_graphics::Pixel<Rgb888>>>(
        &mut self,
        pixels: I,
    ) -> Result<(), Infallible> {
        for embedded_graphics::Pixel(at, color) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(at.x), u32::try_from(at.y)) else {
                continue;
            };
            if let Some(pixel) = self.0.get_pixel_mut_checked(x, y) {
                *pixel = Rgb([color.r(), color.g(), color.b()]);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map of one row of one channel; background where the reference is negative.
    fn map(image: &[f32], reference: &[f32]) -> Option<ErrorMap> {
        let valid: Vec<bool> = reference.iter().map(|&t| t >= 0.0).collect();
        let pixels = Pixels {
            image,
            reference,
            image_standard_error: None,
            reference_standard_error: None,
            valid: &valid,
            channels: 1,
        };
        ErrorMap::new([image.len() as u32, 1], &pixels)
    }

    #[test]
    fn colours_tell_dark_from_bright() {
        // Mean 2, errors -0.5, 0, +0.5, none, not a number.
        let map = map(&[1.0, 2.0, 3.0, 9.0, f32::NAN], &[2.0, 2.0, 2.0, -1.0, 2.0]).unwrap();
        let colors = map.rgb(0.5, 100);
        let at = |x: u32| colors.get_pixel(x, 0).0;
        assert_eq!(at(0), [5, 48, 97]);
        assert_eq!(at(1), [247; 3]);
        assert_eq!(at(2), [103, 0, 31]);
        assert_eq!(at(3), BACKGROUND.0);
        assert_eq!(at(4), [0; 3]);
        assert_eq!(map.range(), 0.5);
        // What leaves the range stays at its end.
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

    #[test]
    fn ticks_are_short() {
        let ticks = [0.0, -0.15, 0.075, 2.0, 1e-5].map(tick);
        assert_eq!(ticks, ["0", "-15 %", "+7.5 %", "+200 %", "+1.0e-3 %"]);
    }
}
