//! A picture with text.

use std::convert::Infallible;

use embedded_graphics::Drawable;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::ascii::{FONT_7X13, FONT_7X13_BOLD};
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::text::{Alignment, Text};
use image::imageops::replace;
use image::{Rgb, RgbImage};

const INK: Rgb888 = Rgb888::new(34, 34, 34);
pub const BOLD: MonoTextStyle<Rgb888> = MonoTextStyle::new(&FONT_7X13_BOLD, INK);
pub const PLAIN: MonoTextStyle<Rgb888> = MonoTextStyle::new(&FONT_7X13, INK);

pub struct Canvas(pub RgbImage);

impl Canvas {
    /// A canvas of white paper.
    pub fn new(width: u32, height: u32) -> Canvas {
        Canvas(RgbImage::from_pixel(width, height, Rgb([255; 3])))
    }

    pub fn show(&mut self, picture: &RgbImage, left: u32, top: u32) {
        replace(&mut self.0, picture, left.into(), top.into());
    }

    /// Text centred on a column.
    pub fn write(&mut self, text: &str, middle: i32, baseline: i32, style: MonoTextStyle<Rgb888>) {
        let at = Point::new(middle, baseline);
        let Ok(_) = Text::with_alignment(text, at, style, Alignment::Center).draw(self);
    }

    /// A tick below a colour bar, and its label.
    pub fn tick(&mut self, x: u32, top: u32, label: &str) {
        self.show(&RgbImage::from_pixel(1, 4, Rgb([34; 3])), x, top);
        self.write(label, x as i32, top as i32 + 14, PLAIN);
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
