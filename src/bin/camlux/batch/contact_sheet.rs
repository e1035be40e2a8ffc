//! A contact sheet: many frames side by side in one picture.

use std::path::Path;

use camlux::output::{self, FileFormat, Layer, LayeredImage, OutputFile};
use image::{RgbImage, imageops};

use super::frames::Frames;
use crate::output::{png, require_extension};
use crate::reduced::Reduced;
use crate::{Failure, tell, warn};

const MOST_FRAMES: usize = 64;
/// Maximum width of a frame on the sheet.
const WIDEST_PX: usize = 160;
const GAP_PX: usize = 2;

/// The file under construction.
pub struct ContactSheet(OutputFile);

impl ContactSheet {
    /// # Errors
    /// If the file cannot be written, or if the job's frames have no radiance layer to show.
    pub fn create(path: &Path, frames: &Frames) -> Result<Self, Failure> {
        require_extension("--contact-sheet", path, "png")?;
        let mut scenes = frames.job.scenes.iter();
        if scenes.any(|scene| !Layer::Radiance.is_among(scene.layers.as_deref())) {
            let problem = "it shows the layer radiance; add it to \"layers\" of the job";
            return Err(format!("--contact-sheet: {problem}").into());
        }
        if frames.job.format != FileFormat::Exr {
            let problem = "it shows OpenEXR files; leave out format = \"npz\" of the job";
            return Err(format!("--contact-sheet: {problem}").into());
        }
        Ok(ContactSheet(OutputFile::create(path)?))
    }

    /// Shows finished frames, picked evenly from these. All have the same exposure.
    pub fn write(self, frames: &Frames, indices: &[u64], folder: &Path) -> Result<(), Failure> {
        let path = |&index: &u64| frames.plan(index).path_of(Layer::Radiance, folder);
        let paths = indices.iter().map(path);
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
        let sheet = arrange(&shown);
        let size_px = [sheet.width() as usize, sheet.height() as usize];
        let bytes = png(size_px, sheet.as_raw())?;
        let path = self.0.path().to_owned();
        self.0.commit_with(&bytes)?;
        tell(&format!("wrote {} ({count} frames)", path.display()));
        Ok(())
    }
}

/// A grid with the same number of rows and columns, filled row by row from the top.
fn arrange(shown: &[Reduced]) -> RgbImage {
    let values: Vec<[f32; 3]> = shown.iter().flat_map(|s| s.rgb.iter().copied()).collect();
    let white = output::white_radiance(values.as_flattened());
    let columns = (shown.len() as f64).sqrt().ceil() as usize;
    let cell = [0, 1].map(|axis| shown.iter().map(|s| s.size_px[axis]).max().unwrap_or(0) + GAP_PX);
    let (width, height) = (columns * cell[0], shown.len().div_ceil(columns) * cell[1]);
    let mut sheet = RgbImage::new((width - GAP_PX) as u32, (height - GAP_PX) as u32);
    for (number, frame) in shown.iter().enumerate() {
        let values = frame.rgb.as_flattened().iter();
        let bytes = values
            .map(|value| output::srgb_byte(value / white))
            .collect();
        let [width, height] = frame.size_px.map(|px| px as u32);
        let picture = RgbImage::from_raw(width, height, bytes).unwrap_or_default();
        let [left, top] = [number % columns * cell[0], number / columns * cell[1]];
        imageops::replace(&mut sheet, &picture, left as i64, top as i64);
    }
    sheet
}
