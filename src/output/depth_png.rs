//! Depth as a grey PNG of 16 bits, in millimetres, as depth cameras and their data sets store it.

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::{Frame, Layer, OutputFile};
use crate::error::Result;

/// Writes the layer `depth` in whole millimetres, rounded; 0 where there is no surface. What is farther than 65 535 mm is 65 535. Returns the bytes
/// of the file, and a warning if values do not fit.
///
/// # Errors
/// [`Error::Output`](crate::Error::Output) when the frame lacks the layer, and when the file cannot be written.
pub fn write_depth_png(output: OutputFile, frame: &Frame) -> Result<(Vec<u8>, Option<String>)> {
    frame.check_for_output(output.path())?;
    let depths_m = frame.values(Layer::Depth).ok_or_else(|| {
        let hint = "a PNG of the depth needs it; add it to the layers";
        output.refused("the frame has no layer depth", hint)
    })?;
    let mut outside = 0;
    let in_millimetres = |&depth_m: &f32| {
        if depth_m == f32::INFINITY {
            return 0;
        }
        let depth_mm = (1e3 * f64::from(depth_m)).round();
        outside += usize::from(!(1.0..=65_535.0).contains(&depth_mm));
        // A surface is never 0: that would be none.
        depth_mm.clamp(1.0, 65_535.0) as u16
    };
    let pixels: Vec<u16> = depths_m.iter().map(in_millimetres).collect();
    let mut bytes = Vec::new();
    let [width, height] = frame.resolution_px;
    PngEncoder::new(&mut bytes)
        .write_image(
            bytemuck::cast_slice(&pixels),
            width,
            height,
            ExtendedColorType::L16,
        )
        .map_err(|error| output.failed(&error))?;
    output.commit_with(&bytes)?;
    let warning = (outside > 0).then(|| {
        format!(
            "{outside} pixels have a depth that 16 bits of millimetres cannot hold: the PNG of the depth has 1 below 1 mm and 65535 above 65535 mm; the layer depth is right"
        )
    });
    Ok((bytes, warning))
}
