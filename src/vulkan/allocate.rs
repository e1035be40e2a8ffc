//! One declaration of images and buffers for two purposes: a [`Device`] allocates them, and [`Requirements`] add up what they
//! take and hold it against a device's limits, before any is allocated.

use std::cell::Cell;

use super::{Buffer, BufferUse, Device, DeviceInfo, Image, ImageShape};
use crate::{Error, Result};

/// Drivers lay images out in squares of so many pixels along an edge.
const IMAGE_TILE_PX: u64 = 4;
/// Views, uniforms, lengths of lists and other things of a few hundred bytes, each rounded up to a page.
const SMALL_BUFFERS_BYTES: u64 = 256 << 10;

/// Takes declarations of images and buffers.
pub(crate) trait Allocate {
    type Image;
    type Buffer;

    fn image(&self, name: &str, shape: ImageShape) -> Result<Self::Image>;

    fn buffer(&self, name: &str, bytes: u64, usage: BufferUse) -> Result<Self::Buffer>;
}

impl Allocate for Device {
    type Image = Image;
    type Buffer = Buffer;

    fn image(&self, name: &str, shape: ImageShape) -> Result<Image> {
        Image::new(self, name, shape)
    }

    fn buffer(&self, name: &str, bytes: u64, usage: BufferUse) -> Result<Buffer> {
        Buffer::new(self, name, bytes, usage)
    }
}

/// What the size of an image or a buffer grows with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GrowsWith {
    Resolution,
    /// `rsm_size` and the number of lights.
    Rsm,
    /// Triangles and textures.
    Scene,
}

impl GrowsWith {
    const ALL: [GrowsWith; 3] = [GrowsWith::Resolution, GrowsWith::Rsm, GrowsWith::Scene];

    fn hint(self) -> &'static str {
        match self {
            GrowsWith::Resolution => "render a smaller image, or choose another device",
            GrowsWith::Rsm => "set a smaller rsm_size, use fewer lights, or choose another device",
            GrowsWith::Scene => {
                "simplify the meshes or scale the textures down, or choose another device"
            }
        }
    }
}

/// What a frame takes of a device.
pub(crate) struct Requirements<'d> {
    /// `None`: without limits.
    device: Option<&'d DeviceInfo>,
    /// In the order of [`GrowsWith::ALL`].
    bytes: [Cell<u64>; 3],
}

impl<'d> Requirements<'d> {
    pub fn new(device: Option<&'d DeviceInfo>) -> Self {
        Requirements {
            device,
            bytes: Default::default(),
        }
    }

    /// Takes declarations of what grows with something.
    pub fn of(&self, grows_with: GrowsWith) -> Declarations<'_, 'd> {
        Declarations {
            requirements: self,
            grows_with,
            hint: grows_with.hint().into(),
        }
    }

    /// What is declared by one or the other, of which one alone is held at a time.
    pub fn either(
        &self,
        one: impl FnOnce(&Self) -> Result<()>,
        other: impl FnOnce(&Self) -> Result<()>,
    ) -> Result<()> {
        let [first, second] = [
            Requirements::new(self.device),
            Requirements::new(self.device),
        ];
        one(&first)?;
        other(&second)?;
        let larger = if first.total() >= second.total() {
            first
        } else {
            second
        };
        for (bytes, more) in self.bytes.iter().zip(&larger.bytes) {
            bytes.set(bytes.get().saturating_add(more.get()));
        }
        Ok(())
    }

    /// Bytes of all that was declared, and of small things.
    pub fn total(&self) -> u64 {
        let declared = self.bytes.iter().map(Cell::get);
        declared.fold(SMALL_BUFFERS_BYTES, u64::saturating_add)
    }

    /// Refuses a total over the device's memory, which also holds `host_bytes`.
    pub fn check_memory(&self, host_bytes: u64) -> Result<()> {
        let most = GrowsWith::ALL.into_iter().zip(&self.bytes);
        let most = most.max_by_key(|(_, bytes)| bytes.get());
        let hint = most.map_or("choose another device", |(grows_with, _)| grows_with.hint());
        let total = self.total().saturating_add(host_bytes);
        self.check("the memory of the frame (bytes)", total, hint, |device| {
            device.limits.memory_bytes
        })
    }

    /// Refuses what is over a limit.
    pub fn check(
        &self,
        what: &str,
        requested: u64,
        hint: &str,
        limit: impl FnOnce(&DeviceInfo) -> u64,
    ) -> Result<()> {
        let Some(device) = self.device else {
            return Ok(());
        };
        let limit = limit(device);
        if requested <= limit {
            return Ok(());
        }
        Err(Error::DeviceLimit {
            what: what.into(),
            requested,
            limit,
            device: device.name.clone(),
            hint: hint.into(),
        })
    }
}

/// Takes declarations, with what to do where one of them is over a limit.
pub(crate) struct Declarations<'r, 'd> {
    requirements: &'r Requirements<'d>,
    grows_with: GrowsWith,
    hint: String,
}

impl Declarations<'_, '_> {
    pub fn with_hint(self, hint: impl Into<String>) -> Self {
        Declarations {
            hint: hint.into(),
            ..self
        }
    }

    /// Refuses what is over a limit.
    pub fn check(&self, what: &str, requested: u64, limit: fn(&DeviceInfo) -> u64) -> Result<()> {
        self.requirements.check(what, requested, &self.hint, limit)
    }

    fn add(&self, bytes: u64) {
        let sum = &self.requirements.bytes[self.grows_with as usize];
        sum.set(sum.get().saturating_add(bytes));
    }
}

impl Allocate for Declarations<'_, '_> {
    type Image = ();
    type Buffer = ();

    fn image(&self, name: &str, shape: ImageShape) -> Result<()> {
        for (axis, size_px) in ["width", "height"].into_iter().zip(shape.size_px) {
            self.check(&format!("{name}, {axis} (px)"), size_px.into(), |device| {
                device.limits.max_image_px.into()
            })?;
        }
        let pixel_bytes = if shape.is_depth { 4 } else { 16 };
        let [width, height] = shape
            .size_px
            .map(|px| u64::from(px).next_multiple_of(IMAGE_TILE_PX));
        let bytes = (u64::from(shape.layer_count()) * pixel_bytes)
            .saturating_mul(width)
            .saturating_mul(height);
        self.check(&format!("{name} (bytes)"), bytes, |device| {
            device.limits.max_allocation_bytes
        })?;
        self.add(bytes);
        Ok(())
    }

    fn buffer(&self, name: &str, bytes: u64, usage: BufferUse) -> Result<()> {
        self.check(
            &format!("{name} (bytes)"),
            bytes,
            match usage {
                BufferUse::Device | BufferUse::Upload => |device| {
                    let limits = &device.limits;
                    let storage = limits.max_storage_buffer_bytes;
                    storage.min(limits.max_allocation_bytes)
                },
                BufferUse::Staging | BufferUse::Readback => |device| {
                    let limits = &device.limits;
                    limits.max_buffer_bytes.min(limits.max_allocation_bytes)
                },
            },
        )?;
        self.add(bytes);
        Ok(())
    }
}
