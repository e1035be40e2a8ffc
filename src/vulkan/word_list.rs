//! A list of words, of any length, that shaders read as an image: word i is at column i mod 4096 and row i / 4096 of layers of 4096 rows.

use super::{Allocate, Buffer, BufferUse, CommandPool, Image, ImageShape, PixelKind, Resource};
use crate::Result;

/// Columns of the image, and most rows of a layer. Every device supports this size.
const EDGE: u64 = 4096;

pub(crate) struct WordList(Image);

impl WordList {
    /// Copies a list of `count` words to the device, layer by layer.
    pub fn new(
        commands: &CommandPool,
        what: &str,
        mut words: impl Iterator<Item = u32>,
        count: u64,
    ) -> Result<WordList> {
        let device = commands.device();
        let shape = shape_of(count);
        let image = Image::new(device, what, shape)?;
        let layer_words = shape.pixel_count() as usize / shape.layer_count() as usize;
        for layer in 0..shape.layer_count() {
            let mut of_layer: Vec<u32> = words.by_ref().take(layer_words).collect();
            of_layer.resize(layer_words, 0);
            let staging = Buffer::filled(device, what, &of_layer, BufferUse::Staging)?;
            let mut recorder = commands.begin()?;
            recorder.copy_to_layer(&staging, &image, layer);
            recorder.submit()?;
        }
        Ok(WordList(image))
    }

    /// Declares the memory of a list of `words` words.
    pub fn declare(allocate: &impl Allocate, what: &str, words: u64) -> Result<()> {
        let shape = shape_of(words);
        allocate.image(what, shape)?;
        let staging = shape.pixel_count() / u64::from(shape.layer_count()) * shape.pixel.bytes();
        allocate.buffer(what, staging, BufferUse::Staging)?;
        Ok(())
    }

    pub fn resource(&self) -> Resource<'_> {
        Resource::Image(&self.0)
    }
}

fn shape_of(words: u64) -> ImageShape {
    let rows = words.div_ceil(EDGE).max(1);
    ImageShape {
        size_px: [EDGE as u32, rows.min(EDGE) as u32],
        layers: Some(u32::try_from(rows.div_ceil(EDGE)).unwrap_or(u32::MAX)),
        pixel: PixelKind::Word,
    }
}
