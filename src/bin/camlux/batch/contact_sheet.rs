//! A picture of many frames side by side: a look at a data set.

use std::path::Path;

use camlux::output::{self, Layer, LayeredImage, OutputFile};

use super::frames::Frames;
use crate::output::{png, require_extension};
use crate::reduced::Reduced;
use crate::{Failure, tell, warn};

const MOST_FRAMES: usize = 64;
/// Widest frame on the sheet.
const WIDEST_PX: usize = 160;
const GAP_PX: usize = 2;

/// The file under construction.
pub struct ContactSheet(OutputFile);

impl ContactSheet {
    /// # Errors
    /// Where the file cannot be written, and where the job's frames have no radiance to show.
    pub fn create(path: &Path, frames: &Frames) -> Result<Self, Failure> {
        require_extension("--contact-sheet", path, "png")?;
        let layers = frames.job.exr.layers.as_ref();
        if layers.is_some_and(|layers| !layers.contains(&Layer::Radiance)) {
            let problem = "it shows the layer radiance; add it to \"layers\" of the job";
            return Err(format!("--contact-sheet: {problem}").into());
        }
        Ok(ContactSheet(OutputFile::create(path)?))
    }

    /// Shows frames that are there, evenly picked from these. The exposure is the same for all.
    pub fn write(self, frames: &Frames, indices: &[u64], folder: &Path) -> Result<(), Failure> {
        let paths = indices.iter().map(|&index| frames.plan(index).path(folder));
        let there: Vec<_> = paths.filter(|path| path.exists()).collect();
        let count = there.len().min(MOST_FRAMES);
        let mut shown = Vec::with_capacity(count);
        for number in 0..count {
            let image = LayeredImage::read(&there[number * there.len() / count])?;
            let radiance = image.values(Layer::Radiance).unwrap_or_default();
            shown.push(Reduced::new(image.resolution_px(), radiance, WIDEST_PX));
        }
        if shown.is_empty() {
            warn("there is no frame for the contact sheet");
            return Ok(());
        }
        let (size_px, rgb) = arrange(&shown);
        let bytes = png(size_px, &rgb)?;
        let path = self.0.path().to_owned();
        self.0.commit_with(&bytes)?;
        tell(&format!("wrote {} ({count} frames)", path.display()));
        Ok(())
    }
}

/// Rows and columns of the same number, row by row from the top.
fn arrange(shown: &[Reduced]) -> ([usize; 2], Vec<u8>) {
    let values: Vec<[f32; 3]> = shown.iter().flat_map(|s| s.rgb.iter().copied()).collect();
    let white = output::white_radiance(values.as_flattened());
    let columns = (shown.len() as f64).sqrt().ceil() as usize;
    let cell = [0, 1].map(|axis| shown.iter().map(|s| s.size_px[axis]).max().unwrap_or(0) + GAP_PX);
    let size_px = [
        columns * cell[0] - GAP_PX,
        shown.len().div_ceil(columns) * cell[1] - GAP_PX,
    ];
    let mut rgb = vec![0; size_px[0] * size_px[1] * 3];
    for (number, frame) in shown.iter().enumerate() {
        let (left, top) = (number % columns * cell[0], number / columns * cell[1]);
        for (row, pixels) in frame.rgb.chunks_exact(frame.size_px[0]).enumerate() {
            let start = 3 * ((top + row) * size_px[0] + left);
            let values = pixels.as_flattened();
            for (byte, value) in rgb[start..start + values.len()].iter_mut().zip(values) {
                *byte = output::srgb_byte(value / white);
            }
        }
    }
    (size_px, rgb)
}
