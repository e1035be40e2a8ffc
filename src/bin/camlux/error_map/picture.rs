//! The picture of an error map: the map, a colour bar, and its labels.

use camlux::output::OutputFile;
use image::RgbImage;
use image::imageops::{FilterType, resize};

use super::{ErrorMap, color_bar};
use crate::Failure;
use crate::canvas::{BOLD, Canvas, PLAIN};
use crate::output::png;

/// Limits of a map's size: small maps are enlarged so that they can be seen, large ones are reduced.
const LEAST_PX: u32 = 480;
const MOST_PX: usize = 2048;
const MARGIN_PX: u32 = 16;
const LEGEND_PX: u32 = 88;
const BAR_HEIGHT_PX: u32 = 14;

/// Writes the map with its colour bar as a PNG and gives the file its final name.
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
    let mut canvas = Canvas::new(width, legend_top + LEGEND_PX);
    let map_picture = resize(&colors, map_width, map_height, FilterType::Nearest);
    canvas.show(&map_picture, left, MARGIN_PX);

    let middle = width as i32 / 2;
    let top = legend_top as i32;
    let heading = format!("{layer}: image - reference");
    canvas.write(&heading, middle, top + 10, BOLD);
    let mean = map.reference_mean;
    let mean = format!("relative to the mean of the reference, {mean:.3e} {unit}");
    canvas.write(mean.trim_end(), middle, top + 26, PLAIN);

    let bar = color_bar(LEAST_PX - 64, BAR_HEIGHT_PX);
    let bar_left = (width - bar.width()) / 2;
    canvas.show(&bar, bar_left, legend_top + 36);
    for share in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let along = (share + 1.0) / 2.0 * f64::from(bar.width() - 1);
        let x = bar_left + along.round() as u32;
        canvas.tick(x, legend_top + 36 + BAR_HEIGHT_PX, &tick(share * range));
    }
    let is_number = |error: &f64| !error.is_nan();
    let mut key = "blue: too dark, red: too bright".to_owned();
    if map.errors.iter().any(Option::is_none) {
        key.push_str(", grey: left out");
    }
    if !map.errors.iter().flatten().all(is_number) {
        key.push_str(", black: not a number");
    }
    canvas.write(&key, middle, top + 83, PLAIN);
    canvas.0
}

/// A share in per cent with a sign, with as few digits as it needs.
fn tick(share: f64) -> String {
    let percent = share * 100.0;
    match percent {
        0.0 => "0".into(),
        p if p.abs() < 1e-2 => format!("{p:+.1e} %"),
        // Ranges and their halves have three digits.
        p => format!("{:+} %", (p * 1e4).round() / 1e4),
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
