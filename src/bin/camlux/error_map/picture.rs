//! The picture of an error map: the map, a bar of its colours, and what they mean.

use std::convert::Infallible;

use camlux::output::OutputFile;
use embedded_graphics::Drawable;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::ascii::{FONT_7X13, FONT_7X13_BOLD};
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::text::{Alignment, Text};
use image::imageops::{FilterType, replace, resize};
use image::{Rgb, RgbImage};

use super::{ErrorMap, color_bar};
use crate::Failure;
use crate::output::png;

const PAPER: Rgb<u8> = Rgb([255; 3]);
const INK: Rgb888 = Rgb888::new(34, 34, 34);

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
pub fn write_png(file: OutputFile, map: &ErrorMap, layer: &str, unit: &str) -> Result<(), Failure> {
    let picture = picture(map, layer, unit);
    let size_px = [picture.width(), picture.height()].map(|px| px as usize);
    Ok(file.commit_with(&png(size_px, &picture)?)?)
}

fn picture(map: &ErrorMap, layer: &str, unit: &str) -> RgbImage {
    let range = map.range();
    let colors = map.rgb(range, MOST_PX);
    let scale = (LEAST_PX / colors.width().max(colors.height())).max(1);
    let [map_width, map_height] = [colors.width(), colors.height()].map(|px| px * scale);
    let width = map_width.max(LEAST_PX) + 2 * MARGIN_PX;
    let legend_top = map_height + 2 * MARGIN_PX;
    let left = (width - map_width) / 2;
    let mut canvas = Canvas(RgbImage::from_pixel(width, legend_top + LEGEND_PX, PAPER));
    let map_picture = resize(&colors, map_width, map_height, FilterType::Nearest);
    canvas.show(&map_picture, left, MARGIN_PX);

    let middle = width as i32 / 2;
    let top = legend_top as i32;
    let bold = MonoTextStyle::new(&FONT_7X13_BOLD, INK);
    let plain = MonoTextStyle::new(&FONT_7X13, INK);
    let heading = format!("{layer}: image - reference");
    canvas.write(&heading, middle, top + 10, bold);
    let mean = map.reference_mean;
    let mean = format!("relative to the mean of the reference, {mean:.3e} {unit}");
    canvas.write(mean.trim_end(), middle, top + 26, plain);

    let bar = color_bar(LEAST_PX - 64, BAR_HEIGHT_PX);
    let bar_left = (width - bar.width()) / 2;
    canvas.show(&bar, bar_left, legend_top + 36);
    let mark = RgbImage::from_pixel(1, 4, Rgb([34; 3]));
    for share in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let along = (share + 1.0) / 2.0 * f64::from(bar.width() - 1);
        let x = bar_left + along.round() as u32;
        canvas.show(&mark, x, legend_top + 36 + BAR_HEIGHT_PX);
        canvas.write(&tick(share * range), x as i32, top + 66, plain);
    }
    let is_number = |error: &f64| !error.is_nan();
    let mut key = "blue: too dark, red: too bright".to_owned();
    if map.errors.iter().any(Option::is_none) {
        key.push_str(", grey: left out");
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
    fn show(&mut self, picture: &RgbImage, left: u32, top: u32) {
        replace(&mut self.0, picture, left.into(), top.into());
    }

    fn write(&mut self, text: &str, middle: i32, baseline: i32, style: MonoTextStyle<Rgb888>) {
        let at = Point::new(middle, baseline);
        let Ok(_) = Text::with_alignment(text, at, style, Alignment::Center).draw(self);
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

    #[test]
    fn ticks_are_short() {
        let ticks = [0.0, -0.15, 0.075, 2.0, 1e-5].map(tick);
        assert_eq!(ticks, ["0", "-15 %", "+7.5 %", "+200 %", "+1.0e-3 %"]);
    }
}
