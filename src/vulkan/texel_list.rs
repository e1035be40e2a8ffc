//! Lists that shaders read as images: texel i is at (i mod 1024, i / 1024).

use std::sync::Arc;

use super::{Allocate, BufferUse, CommandPool, Image, ImageShape, Resource};
use crate::Result;

/// Texels of a row of an image that holds a list. The shaders use the same number.
const ROW_TEXELS: u64 = 1024;

/// A list of texels in an image, row by row.
pub(crate) struct TexelList(Arc<Image>);

impl TexelList {
    /// The list, which the next command buffer fills.
    pub fn new(commands: &CommandPool, what: &str, mut texels: Vec<[f32; 4]>) -> Result<TexelList> {
        let rows = texels.len().max(1).div_ceil(ROW_TEXELS as usize);
        texels.resize(rows * ROW_TEXELS as usize, [0.0; 4]);
        TexelList::with_size(commands, what, &texels, [ROW_TEXELS as u32, rows as u32])
    }

    /// The same with rows of the caller's choice.
    pub fn with_size(
        commands: &CommandPool,
        what: &str,
        texels: &[[f32; 4]],
        size_px: [u32; 2],
    ) -> Result<TexelList> {
        let image = Image::new(commands.device(), what, ImageShape::plain(size_px))?;
        let image = Arc::new(image);
        commands.upload_image(what, texels, &image)?;
        Ok(TexelList(image))
    }

    /// Declares the memory of a list of up to `texels` texels.
    pub fn declare(allocate: &impl Allocate, what: &str, texels: u64) -> Result<()> {
        let rows = texels.max(1).div_ceil(ROW_TEXELS);
        let size_px = [ROW_TEXELS, rows].map(|px| u32::try_from(px).unwrap_or(u32::MAX));
        allocate.image(what, ImageShape::plain(size_px))?;
        let bytes = rows * ROW_TEXELS * size_of::<[f32; 4]>() as u64;
        allocate.buffer(what, bytes, BufferUse::Staging)?;
        Ok(())
    }

    pub fn resource(&self) -> Resource<'_> {
        Resource::Image(&self.0)
    }
}
