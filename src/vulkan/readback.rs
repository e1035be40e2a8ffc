//! Copies images from the device to the host.

use super::{Buffer, BufferUse, CommandPool, Device, Image, ImageShape};
use crate::Result;

/// Reads back images of one shape. They share one buffer, one after the other, because touching fresh memory takes longer than copying.
pub(crate) struct Readback {
    commands: CommandPool,
    buffer: Buffer,
}

impl Readback {
    pub fn new(device: &Device, shape: ImageShape) -> Result<Self> {
        let bytes = shape.pixel_count() * size_of::<[f32; 4]>() as u64;
        let buffer = Buffer::new(device, "readback", bytes, BufferUse::Readback)?;
        let commands = CommandPool::new(device);
        Ok(Readback { commands, buffer })
    }

    /// The pixels of an image, row by row from the top, layer by layer.
    pub fn pixels(&mut self, image: &Image) -> Result<&[[f32; 4]]> {
        let mut recorder = self.commands.begin()?;
        recorder.barrier();
        recorder.copy_from_image(image, &self.buffer);
        recorder.submit()?;
        self.buffer.mapped(image.shape.pixel_count() as usize)
    }
}
