//! The preview of a time-of-flight frame: one row for each frequency with its range, amplitude and multipath error.

use camlux::model::unambiguous_range_m;
use camlux::output::{Frame, Layer, OutputFile, TofQuantity};
use camlux::scene::TimeOfFlight;
use image::{Rgb, RgbImage};

use crate::Failure;
use crate::canvas::{BOLD, Canvas};
use crate::error_map::{diverging, round_range};
use crate::numbers::number;
use crate::output::png;

const MARGIN_PX: u32 = 12;
const HEADING_PX: u32 = 20;
const LEGEND_PX: u32 = 40;
const BAR_HEIGHT_PX: u32 = 12;
/// The columns, from left to right.
const SHOWN: [TofQuantity; 3] = [
    TofQuantity::Range,
    TofQuantity::Amplitude,
    TofQuantity::MultipathError,
];
/// Minimum width, so that headings fit. No picture is enlarged beyond it.
const LEAST_PX: u32 = 240;
const BACKGROUND: [u8; 3] = [128; 3];

/// The contents of one panel.
struct Panel<'f> {
    heading: String,
    values: &'f [f32],
    unit: &'static str,
    /// Values at which the colour scale begins and ends.
    ends: [f64; 2],
    color: fn(f64) -> [u8; 3],
}

/// Writes the preview of a time-of-flight frame and gives the file its final name. Returns a description of what it shows.
pub fn write_png(file: OutputFile, frame: &Frame, tof: &TimeOfFlight) -> Result<String, Failure> {
    let rows: Vec<Vec<Panel>> = tof
        .frequencies_hz
        .iter()
        .enumerate()
        .map(|(frequency, &hz)| panels(frame, frequency as u8, hz))
        .collect();
    let picture = picture(&rows, frame.resolution_px);
    let size_px = [picture.width(), picture.height()].map(|px| px as usize);
    file.commit_with(&png(size_px, &picture)?)?;
    Ok(match frame.description.indirect {
        Some(_) => "range | amplitude | multipath error, one row per frequency".into(),
        None => "range | amplitude, one row per frequency".into(),
    })
}

/// The layers that a preview shows, if the frame has them.
pub fn layers(tof: &TimeOfFlight) -> impl Iterator<Item = Layer> {
    let frequencies = 0..tof.frequencies_hz.len() as u8;
    frequencies.flat_map(|frequency| SHOWN.map(|shown| Layer::Tof(frequency, shown)))
}

/// Without a bounce there is no multipath error.
fn panels(frame: &Frame, frequency: u8, frequency_hz: f64) -> Vec<Panel<'_>> {
    let most = |values: &[f32]| round_range(values.iter().map(|value| f64::from(value.abs())));
    let panel = |quantity, what, color, ends: &dyn Fn(f64) -> [f64; 2]| {
        let layer = Layer::Tof(frequency, quantity);
        let values = frame.values(layer)?;
        Some(Panel {
            heading: format!("{what}, {} MHz", number(1e-6 * frequency_hz)),
            values,
            unit: layer.unit_by(frame.description.tof.as_ref()),
            ends: ends(most(values)),
            color,
        })
    };
    let unambiguous_m = unambiguous_range_m(frequency_hz);
    let [range, amplitude, multipath_error] = SHOWN;
    let panels = [
        panel(range, "range", perceptual, &|most| {
            [0.0, most.min(unambiguous_m)]
        }),
        panel(amplitude, "amplitude", grey, &|most| [0.0, most]),
        panel(multipath_error, "multipath error", diverging, &|most| {
            [-most, most]
        }),
    ];
    panels.into_iter().flatten().collect()
}

fn picture(rows: &[Vec<Panel>], [width, height]: [u32; 2]) -> RgbImage {
    let scale = (LEAST_PX / width.max(height).max(1)).max(1);
    let [shown_width, shown_height] = [width * scale, height * scale];
    let panel_width = shown_width.max(LEAST_PX);
    let row_height = HEADING_PX + shown_height + LEGEND_PX;
    let columns = rows.first().map_or(0, Vec::len) as u32;
    let mut canvas = Canvas::new(
        columns * (panel_width + MARGIN_PX) + MARGIN_PX,
        rows.len() as u32 * row_height + MARGIN_PX,
    );
    for (row, panels) in rows.iter().enumerate() {
        for (column, panel) in panels.iter().enumerate() {
            let left = MARGIN_PX + column as u32 * (panel_width + MARGIN_PX);
            let top = row as u32 * row_height;
            let middle = (left + panel_width / 2) as i32;
            canvas.write(&panel.heading, middle, top as i32 + 15, BOLD);
            let [low, high] = panel.ends;
            let pixels = RgbImage::from_fn(shown_width, shown_height, |x, y| {
                let pixel = y as usize / scale as usize * width as usize + (x / scale) as usize;
                let share = (f64::from(panel.values[pixel]) - low) / (high - low);
                Rgb(if share.is_nan() {
                    BACKGROUND
                } else {
                    shade(panel, share)
                })
            });
            let inside = (panel_width - shown_width) / 2;
            canvas.show(&pixels, left + inside, top + HEADING_PX);
            let bar_width = panel_width - 64;
            let bar_left = left + 32;
            let bar_top = top + HEADING_PX + shown_height + 6;
            let bar = RgbImage::from_fn(bar_width, BAR_HEIGHT_PX, |x, _| {
                Rgb(shade(panel, (f64::from(x) + 0.5) / f64::from(bar_width)))
            });
            canvas.show(&bar, bar_left, bar_top);
            for share in [0.0, 0.5, 1.0] {
                let x = bar_left + (share * f64::from(bar_width - 1)).round() as u32;
                let label = format!("{} {}", number(low + share * (high - low)), panel.unit);
                canvas.tick(x, bar_top + BAR_HEIGHT_PX, &label);
            }
        }
    }
    canvas.0
}

/// Position of a value on the panel's colour scale, 0 to 1.
fn shade(panel: &Panel, share: f64) -> [u8; 3] {
    let is_signed = panel.ends[0] < 0.0;
    (panel.color)(if is_signed { 2.0 * share - 1.0 } else { share })
}

fn grey(share: f64) -> [u8; 3] {
    [camlux::output::srgb_byte(share as f32); 3]
}

/// From dark blue over green to yellow; brightness rises with the value. "viridis" of matplotlib (van der Walt and Smith 2015, CC0).
fn perceptual(share: f64) -> [u8; 3] {
    const STOPS: [[u8; 3]; 9] = [
        [68, 1, 84],
        [71, 44, 122],
        [59, 81, 139],
        [44, 113, 142],
        [33, 144, 141],
        [39, 173, 129],
        [92, 200, 99],
        [170, 220, 50],
        [253, 231, 37],
    ];
    crate::error_map::between(&STOPS, share)
}
