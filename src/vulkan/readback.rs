//! Copies images from the device to the host.

use std::{
    ops::Range,
    time::{Duration, Instant},
};

use super::{Buffer, BufferUse, CommandPool, Device, Image, Recorder};
use crate::{Error, Result};

/// Copies of images on the host. They share one buffer, which later copies reuse: touching fresh memory takes longer than copying.
pub(crate) struct Readback {
    commands: CommandPool,
    buffer: Option<Buffer>,
    /// The images, each with its texels in the buffer.
    copied: Vec<(u64, Range<usize>)>,
    waiting: Duration,
}

impl Readback {
    pub fn new(device: &Device) -> Self {
        Readback {
            commands: CommandPool::new(device),
            buffer: None,
            copied: Vec::new(),
            waiting: Duration::ZERO,
        }
    }

    /// Bytes of the copies of these images.
    pub fn bytes(images: &[&Image]) -> u64 {
        let texels = images.iter().map(|image| image.shape.pixel_count());
        texels.sum::<u64>() * size_of::<[f32; 4]>() as u64
    }

    /// Copies images, all in one submission. Earlier copies are gone.
    pub fn copy(&mut self, images: &[&Image]) -> Result<()> {
        self.copied.clear();
        if images.is_empty() {
            return Ok(());
        }
        let mut recorder = self.commands.begin()?;
        self.record(&mut recorder, images)?;
        let start = Instant::now();
        recorder.submit()?;
        self.waiting += start.elapsed();
        Ok(())
    }

    /// How long copies have been waited for since the last call.
    pub fn take_waiting(&mut self) -> Duration {
        std::mem::take(&mut self.waiting)
    }

    /// Records the copies for another submission. Until it is complete, the host must not read them.
    pub fn record(&mut self, recorder: &mut Recorder, images: &[&Image]) -> Result<()> {
        self.copied.clear();
        let bytes = Readback::bytes(images);
        if self
            .buffer
            .as_ref()
            .is_none_or(|buffer| buffer.bytes < bytes)
        {
            self.buffer = None;
            let device = self.commands.device();
            self.buffer = Some(Buffer::new(device, "readback", bytes, BufferUse::Readback)?);
        }
        let Some(buffer) = &self.buffer else {
            return Err(Error::internal("no buffer to read back to"));
        };
        recorder.barrier();
        let mut first = 0;
        for image in images {
            let end = first + image.shape.pixel_count() as usize;
            recorder.copy_from_image(image, buffer, (first * size_of::<[f32; 4]>()) as u64);
            self.copied.push((image.id(), first..end));
            first = end;
        }
        Ok(())
    }

    /// The texels of an image that was copied, row by row from the top, layer by layer.
    pub fn copied(&self, image: &Image) -> Result<&[[f32; 4]]> {
        let found = self.copied.iter().find(|(id, _)| *id == image.id());
        let (Some((_, texels)), Some(buffer)) = (found, &self.buffer) else {
            return Err(Error::internal("an image was not read back"));
        };
        Ok(&buffer.mapped(texels.end)?[texels.clone()])
    }

    /// The same, of an image that is copied now if it was not before.
    pub fn pixels(&mut self, image: &Image) -> Result<&[[f32; 4]]> {
        self.copy_missing(&[image])?;
        self.copied(image)
    }

    /// Copies images, all at once, unless all of them are there.
    pub fn copy_missing(&mut self, images: &[&Image]) -> Result<()> {
        let is_there = |image: &&Image| self.copied.iter().any(|(id, _)| *id == image.id());
        if images.iter().all(is_there) {
            return Ok(());
        }
        self.copy(images)
    }
}
