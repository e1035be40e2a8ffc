//! PNG output: a preview of the radiance, not a measurement.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use super::atomic::OutputFile;
use super::{Frame, Layer};
use crate::error::Result;

/// What a preview shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PngView {
    /// The radiance alone.
    Radiance,
    /// Direct, indirect and total radiance side by side.
    SideBySide,
}

impl PngView {
    /// Side by side if the frame has direct and indirect light, otherwise the radiance alone.
    pub fn for_frame(frame: &Frame) -> Self {
        match (frame.values(Layer::Direct), frame.values(Layer::Indirect)) {
            (Some(_), Some(_)) => PngView::SideBySide,
            _ => PngView::Radiance,
        }
    }

    /// The layers, from left to right.
    pub fn panels(self) -> &'static [Layer] {
        match self {
            PngView::Radiance => &[Layer::Radiance],
            PngView::SideBySide => &[Layer::Direct, Layer::Indirect, Layer::Radiance],
        }
    }
}

/// The exposure of a preview.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PngPreview {
    /// The radiance shown at full brightness, W/sr/m², the same in every panel.
    pub white_radiance: f32,
}

/// Writes an 8-bit sRGB preview and gives the file its name.
///
/// All panels have one exposure, so that you can compare them. Full brightness is the 99th percentile of the total radiance, taken over
/// the brightest band of the pixels that receive light and show no surface that emits. Brighter values are clipped.
///
/// # Errors
/// [`Error::Output`](crate::Error::Output) when the frame lacks a layer of the view or its layers do not fit its resolution, when the
/// panels are too wide for the format, and when the file cannot be written. The final name then has no file, or still the previous one.
pub fn write_png(output: OutputFile, frame: &Frame, view: PngView) -> Result<PngPreview> {
    frame.check_for_output(output.path())?;
    let values = |layer: Layer| {
        frame.values(layer).ok_or_else(|| {
            let problem = format!("the frame has no layer {}", layer.name());
            output.refused(problem, "a preview shows radiance, and direct and indirect light if there is a bounce; add these layers")
        })
    };
    let panels = view.panels().iter().map(|&layer| values(layer));
    let panels = panels.collect::<Result<Vec<&[f32]>>>()?;
    let mut reflected = values(Layer::Radiance)?.to_vec();
    for (radiance, &emission) in reflected
        .iter_mut()
        .zip(frame.values(Layer::Emission).unwrap_or_default())
    {
        if emission > 0.0 {
            *radiance = 0.0;
        }
    }
    let white_radiance = white_radiance(&reflected);
    let [width_px, height_px] = frame.resolution_px;
    let image_width_px = width_px.saturating_mul(panels.len() as u32);
    if image_width_px > i32::MAX as u32 {
        let problem = format!("{} panels of {width_px} pixels are too wide", panels.len());
        return Err(output.refused(problem, "render a smaller image"));
    }

    let mut srgb = Vec::with_capacity(image_width_px as usize * height_px as usize * 3);
    let row_values = width_px as usize * 3;
    for row in 0..height_px as usize {
        for panel in &panels {
            let radiance = panel[row * row_values..][..row_values].iter();
            srgb.extend(radiance.map(|&value| srgb_byte(value / white_radiance)));
        }
    }
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Up)
        .write_image(&srgb, image_width_px, height_px, ExtendedColorType::Rgb8)
        .map_err(|error| output.failed(&error))?;
    output.commit_with(&bytes)?;
    Ok(PngPreview { white_radiance })
}

/// The radiance shown at full brightness, in the unit of the values: the 99th percentile of the brightest band over the pixels with light;
/// 1 if no pixel has light.
pub fn white_radiance(rgb: &[f32]) -> f32 {
    let mut brightest: Vec<f32> = rgb
        .chunks_exact(3)
        .map(|bands| bands.iter().copied().fold(0.0, f32::max))
        .filter(|value| *value > 0.0 && value.is_finite())
        .collect();
    if brightest.is_empty() {
        return 1.0;
    }
    let rank = (brightest.len() - 1) * 99 / 100;
    let (_, percentile, _) = brightest.select_nth_unstable_by(rank, f32::total_cmp);
    *percentile
}

/// sRGB transfer function (IEC 61966-2-1) of a share of full brightness, clipped and rounded to 8 bits. NaN becomes 0.
pub fn srgb_byte(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0).round() as u8
}
