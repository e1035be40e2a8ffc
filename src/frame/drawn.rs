//! A drawn frame: its images on the device, and how they become layers or go to a host.

use std::{fmt, sync::Arc};

use ash::vk;

use super::{
    BufferPool, FrameImages,
    readback::{image_of, read_layers},
};
use crate::{
    Device, LocalSpace, Result,
    geometry::Geometry,
    output::{Frame, FrameDescription, FrameStats, Layer},
    vulkan::{Readback, SharedMemory, Timeline, copy_to_shared},
};

/// What `draw` has made, with its statistics and description.
pub(crate) struct DrawnFrame {
    pub images: FrameImages,
    pub space: LocalSpace,
    /// Only for layers that name triangles.
    pub geometry: Option<Arc<Geometry>>,
    pub stats: FrameStats,
    pub description: FrameDescription,
}

impl DrawnFrame {
    /// Reads the layers, or those of a list, into buffers of a pool where they fit.
    pub fn read(
        &self,
        readback: &mut Readback,
        pool: BufferPool,
        wanted: Option<&[Layer]>,
    ) -> Result<Frame> {
        Ok(Frame {
            resolution_px: self.description.camera.resolution_px,
            layers: read_layers(readback, self, pool, wanted)?,
            stats: self.stats.clone(),
            description: self.description.clone(),
        })
    }
}

/// A frame whose images stay on the device, for a host that shares the device ([`Device::of_host`]). Clones share the images.
///
/// The images exist until the last clone is dropped. Drop it only after the device has finished the host's work on them.
/// Other frames do not touch them.
#[derive(Clone)]
pub struct DeviceFrame {
    shared: Arc<Shared>,
}

struct Shared {
    device: Device,
    drawn: DrawnFrame,
    timeline: Arc<Timeline>,
    ready_at: u64,
}

/// An image of a frame, on the device. Its layout is `GENERAL`. Its usage is `SAMPLED`, `STORAGE`, `TRANSFER_SRC` and
/// `TRANSFER_DST`. Its sharing mode is exclusive to the queue family that camlux submits to.
/// A host that changes the layout must change it back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceImage {
    pub image: vk::Image,
    /// `R32G32B32A32_SFLOAT`
    pub format: vk::Format,
    pub size_px: [u32; 2],
    pub queue_family: u32,
}

impl DeviceFrame {
    pub(crate) fn new(
        device: &Device,
        drawn: DrawnFrame,
        timeline: Arc<Timeline>,
        ready_at: u64,
    ) -> DeviceFrame {
        DeviceFrame {
            shared: Arc::new(Shared {
                device: device.clone(),
                drawn,
                timeline,
                ready_at,
            }),
        }
    }

    /// The image of a layer. Light, energy and albedo have R, G and B in the layer's unit. N has X, Y and Z.
    /// P has X, Y and Z in [`DeviceFrame::local_space`], and `id.instance` as the fourth value.
    /// `None` for layers that are made on the way to the host, and for those that the scene does not have.
    pub fn image(&self, layer: Layer) -> Option<DeviceImage> {
        let image = image_of(&self.shared.drawn.images, layer)?;
        let (raw, format) = image.handle();
        Some(DeviceImage {
            image: raw,
            format,
            size_px: image.shape.size_px,
            queue_family: self.shared.device.queue_family(),
        })
    }

    /// Copies the image of a layer, as from [`DeviceFrame::image`], to memory that others import. The image is stored row by row from
    /// the top, without gaps, 16 bytes a pixel. Returns after the copy is complete; `false` if no such image is on the device.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) if the image does not fit into the memory, if the offset is not a multiple of 16,
    /// or if the memory is of another device.
    pub fn copy_to(&self, layer: Layer, to: &SharedMemory, offset_bytes: u64) -> Result<bool> {
        let Some(image) = image_of(&self.shared.drawn.images, layer) else {
            return Ok(false);
        };
        copy_to_shared(&self.shared.device, image, to, offset_bytes)?;
        Ok(true)
    }

    /// The timeline semaphore that the host's work has to wait for, and its value.
    pub fn ready(&self) -> (vk::Semaphore, u64) {
        (self.shared.timeline.raw(), self.shared.ready_at)
    }

    /// The local space of the positions.
    pub fn local_space(&self) -> LocalSpace {
        self.shared.drawn.space
    }

    /// The cost of the frame, without the way to the host.
    pub fn stats(&self) -> &FrameStats {
        &self.shared.drawn.stats
    }

    /// The warnings of [`Frame::warnings`], except those that need the layers.
    pub fn warnings(&self) -> Vec<String> {
        let missed = self.stats().missed_target(self.description());
        missed.into_iter().collect()
    }

    /// How the frame was made.
    pub fn description(&self) -> &FrameDescription {
        &self.shared.drawn.description
    }

    /// Reads the layers. The host must not be writing to the images.
    ///
    /// # Errors
    /// As [`Renderer::render`](crate::Renderer::render).
    pub fn read(&self) -> Result<Frame> {
        let shared = &*self.shared;
        let mut readback = Readback::new(&shared.device);
        let pool = BufferPool::default();
        shared.drawn.read(&mut readback, pool, None)
    }
}

impl fmt::Debug for DeviceFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DeviceFrame")
            .field("ready_at", &self.shared.ready_at)
            .field("stats", self.stats())
            .finish_non_exhaustive()
    }
}
