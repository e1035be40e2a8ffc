//! Lists that shaders read as images: texel i lies at (i mod 1024, i / 1024).

use super::{Buffer, Device, Image, ImageShape, Recorder, Resource};
use crate::Result;

/// Texels of a row of an image that holds a list, as the shaders have it.
pub(crate) const ROW_TEXELS: u64 = 1024;

/// A list of texels in an image, row by row.
pub(crate) struct TexelList {
    image: Image,
    texels: Buffer,
}

impl TexelList {
    pub fn new(device: &Device, what: &str, mut texels: Vec<[f32; 4]>) -> Result<TexelList> {
        texels.resize(
            texels.len().max(1).next_multiple_of(ROW_TEXELS as usize),
            [0.0; 4],
        );
        let size_px = [ROW_TEXELS as u32, (texels.len() as u64 / ROW_TEXELS) as u32];
        Ok(TexelList {
            image: Image::new(device, what, ImageShape::plain(size_px))?,
            texels: Buffer::upload(device, what, &texels)?,
        })
    }

    /// Fills the image; once, before anything reads it.
    pub fn record_copy<'r>(&'r self, recorder: &mut Recorder<'r>) {
        recorder.copy_to_image(&self.texels, &self.image);
    }

    pub fn resource(&self) -> Resource<'_> {
        Resource::Image(&self.image)
    }
}
