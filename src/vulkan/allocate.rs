//! One declaration of images and buffers for two purposes: a [`Device`] allocates them, or [`Requirements`] add up their sizes and check
//! them against a device's limits before anything is allocated.

use std::cell::Cell;

use super::{Buffer, BufferUse, Device, DeviceInfo, DeviceLimits, Image, ImageShape};
use crate::{Error, Result};

/// Drivers lay images out in blocks of this many columns, and of [`Quirks::image_block_rows`](super::Quirks) rows.
const IMAGE_BLOCK_COLUMNS: u64 = 4;
const LEAST_BLOCK_ROWS: u64 = 4;
/// Allowance for views, uniforms, lengths of lists and other small items of a few hundred bytes, each rounded up to a page.
const SMALL_BUFFERS_BYTES: u64 = 256 << 10;

/// Receives declarations of images and buffers.
pub(crate) trait Allocate {
    type Image;
    type Buffer;

    fn image(&self, name: &str, shape: ImageShape) -> Result<Self::Image>;

    fn buffer(&self, name: &str, bytes: u64, usage: BufferUse) -> Result<Self::Buffer>;

    /// Declares a buffer that is filled from a staging buffer.
    fn uploaded_buffer(&self, name: &str, bytes: u64) -> Result<()> {
        self.buffer(name, bytes, BufferUse::Device)?;
        self.buffer(name, bytes, BufferUse::Staging)?;
        Ok(())
    }

    /// An image, only if there is a shape.
    fn image_if(&self, name: &str, shape: Option<ImageShape>) -> Result<Option<Self::Image>> {
        shape.map(|shape| self.image(name, shape)).transpose()
    }
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

/// The setting or input that the size of an image or a buffer grows with.
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

/// The memory that a frame needs on a device.
pub(crate) struct Requirements<'d> {
    /// `None`: no limits are checked.
    device: Option<&'d DeviceInfo>,
    image_block_rows: u32,
    /// Bytes held throughout the frame, in the order of [`GrowsWith::ALL`].
    bytes: [Cell<u64>; 3],
    /// Staging buffers of the copies at the start; freed afterwards.
    staging: Staging,
    /// Bytes held after the staging buffers are freed, in the same order.
    later: [Cell<u64>; 3],
}

/// Bytes of staging buffers.
#[derive(Default)]
struct Staging {
    sum: Cell<u64>,
    largest: Cell<u64>,
}

impl<'d> Requirements<'d> {
    pub fn new(device: &'d DeviceInfo) -> Self {
        Requirements {
            device: Some(device),
            ..Requirements::without_limits(device.quirks.image_block_rows)
        }
    }

    pub fn without_limits(image_block_rows: u32) -> Self {
        Requirements {
            device: None,
            image_block_rows,
            bytes: Default::default(),
            staging: Staging::default(),
            later: Default::default(),
        }
    }

    /// The limits that are checked, if any are.
    pub fn limits(&self) -> Option<&DeviceLimits> {
        self.device.map(|device| &device.limits)
    }

    /// Receives declarations whose size grows with `grows_with`.
    pub fn of(&self, grows_with: GrowsWith) -> Declarations<'_> {
        Declarations {
            device: self.device,
            image_block_rows: self.image_block_rows,
            bytes: &self.bytes[grows_with as usize],
            staging: &self.staging,
            hint: grows_with.hint().into(),
        }
    }

    /// Declares two alternatives of which only one is held at a time, after the staging buffers are freed. The larger one counts.
    pub fn either_later(
        &self,
        one: impl FnOnce(&Self) -> Result<()>,
        other: impl FnOnce(&Self) -> Result<()>,
    ) -> Result<()> {
        let [first, second] = [(); 2].map(|()| Requirements {
            device: self.device,
            ..Requirements::without_limits(self.image_block_rows)
        });
        one(&first)?;
        other(&second)?;
        let larger = if first.total() >= second.total() {
            first
        } else {
            second
        };
        // The larger alternative may itself contain such a choice.
        let declared = larger.bytes.iter().zip(&larger.later);
        for (later, (bytes, latest)) in self.later.iter().zip(declared) {
            later.set(bytes.get().saturating_add(latest.get()));
        }
        // Later staging buffers exist one at a time, so only the largest counts.
        let staging = &self.later[GrowsWith::Rsm as usize];
        staging.set(staging.get().saturating_add(larger.staging.largest.get()));
        Ok(())
    }

    /// Bytes that are held throughout the frame and grow with this.
    pub fn bytes(&self, grows_with: GrowsWith) -> u64 {
        self.bytes[grows_with as usize].get()
    }

    /// Bytes of everything that was declared, plus the allowance for small buffers.
    pub fn total(&self) -> u64 {
        let sum = |cells: &[Cell<u64>]| cells.iter().map(Cell::get).fold(0, u64::saturating_add);
        let at_a_time = self.staging.sum.get().max(sum(&self.later));
        SMALL_BUFFERS_BYTES
            .saturating_add(sum(&self.bytes))
            .saturating_add(at_a_time)
    }

    /// Refuses a total above the device's memory. The total includes `host_bytes`.
    pub fn check_memory(&self, host_bytes: u64) -> Result<()> {
        let declared = self.bytes.iter().zip(&self.later);
        let declared = declared.map(|(bytes, later)| bytes.get().saturating_add(later.get()));
        let most = GrowsWith::ALL.into_iter().zip(declared);
        let most = most.max_by_key(|(_, bytes)| *bytes);
        let hint = most.map_or("choose another device", |(grows_with, _)| grows_with.hint());
        let total = self.total().saturating_add(host_bytes);
        let what = "the memory of the frame (bytes)";
        check(self.device, what, total, hint, |limits| limits.memory_bytes)
    }
}

/// Refuses a size above a limit.
fn check(
    device: Option<&DeviceInfo>,
    what: &str,
    requested: u64,
    hint: &str,
    limit: impl FnOnce(&DeviceLimits) -> u64,
) -> Result<()> {
    let Some(device) = device else {
        return Ok(());
    };
    let limit = limit(&device.limits);
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

/// Receives declarations that grow with the same thing. Its hint says what to do when one of them is above a limit.
pub(crate) struct Declarations<'r> {
    device: Option<&'r DeviceInfo>,
    image_block_rows: u32,
    /// Sum of the declared bytes.
    bytes: &'r Cell<u64>,
    staging: &'r Staging,
    hint: String,
}

impl Declarations<'_> {
    pub fn with_hint(self, hint: impl Into<String>) -> Self {
        let hint = hint.into();
        Declarations { hint, ..self }
    }

    /// Refuses a size above a limit.
    pub fn check(
        &self,
        what: &str,
        requested: u64,
        limit: impl FnOnce(&DeviceLimits) -> u64,
    ) -> Result<()> {
        check(self.device, what, requested, &self.hint, limit)
    }

    /// Refuses a size above the limit of one allocation, and adds it to the sum.
    fn add(
        &self,
        sum: &Cell<u64>,
        name: &str,
        bytes: u64,
        most: impl FnOnce(&DeviceLimits) -> u64,
    ) -> Result<()> {
        self.check(&format!("{name} (bytes)"), bytes, |limits| {
            most(limits).min(limits.max_allocation_bytes)
        })?;
        sum.set(sum.get().saturating_add(bytes));
        Ok(())
    }
}

impl Allocate for Declarations<'_> {
    type Image = ();
    type Buffer = ();

    fn image(&self, name: &str, shape: ImageShape) -> Result<()> {
        for (axis, size_px) in ["width", "height"].into_iter().zip(shape.size_px) {
            let what = format!("{name}, {axis} (px)");
            self.check(&what, size_px.into(), |limits| limits.max_image_px.into())?;
        }
        let [width, height] = shape.size_px.map(u64::from);
        let width = width.next_multiple_of(IMAGE_BLOCK_COLUMNS);
        let block_rows = height.next_power_of_two();
        let block_rows = block_rows.clamp(LEAST_BLOCK_ROWS, self.image_block_rows.into());
        let height = height.next_multiple_of(block_rows);
        let bytes = (u64::from(shape.layer_count()) * shape.pixel.bytes())
            .saturating_mul(width)
            .saturating_mul(height);
        self.add(self.bytes, name, bytes, |_| u64::MAX)
    }

    fn buffer(&self, name: &str, bytes: u64, usage: BufferUse) -> Result<()> {
        let sum = match usage {
            BufferUse::Staging => {
                let largest = &self.staging.largest;
                largest.set(largest.get().max(bytes));
                &self.staging.sum
            }
            _ => self.bytes,
        };
        self.add(sum, name, bytes, |limits| match usage {
            BufferUse::Device | BufferUse::Upload => limits.max_storage_buffer_bytes,
            BufferUse::Staging | BufferUse::Readback => limits.max_buffer_bytes,
        })
    }
}
