//! Receivers pass: lists the pixels to gather that show a surface. Pixels with a specular lobe are listed separately.

use super::{Context, compact::Compactor, gbuffer::GBuffer};
use crate::{
    Result,
    vulkan::{
        Allocate, Buffer, BufferUse, Device, Resource,
        shaders::{Key, ListLengths},
    },
};

/// Lists of pixels, each as column + 65536 · row.
pub(crate) struct Receivers<A: Allocate = Device> {
    /// Pixels that the predict pass or the host proposes.
    pub candidates: A::Buffer,
    /// The candidates that show a surface: matte ones, then glossy ones.
    pub pixels: A::Buffer,
    compactor: Compactor<A>,
}

impl<A: Allocate> Receivers<A> {
    /// Allocates room for `capacity` receivers and a list of `candidate_capacity` candidates.
    pub fn new(allocate: &A, capacity: u32, candidate_capacity: u32) -> Result<Receivers<A>> {
        let buffer = |name, count| allocate.buffer(name, 4 * u64::from(count), BufferUse::Device);
        Ok(Receivers {
            candidates: buffer("candidates", candidate_capacity)?,
            pixels: buffer("list of pixels", capacity)?,
            compactor: Compactor::new(allocate, capacity)?,
        })
    }
}

impl Receivers {
    /// Creates a list with candidates that the host chose.
    pub fn with_candidates(device: &Device, pixels: &[u32]) -> Result<Receivers> {
        Ok(Receivers {
            candidates: Buffer::upload(device, "candidates", pixels)?,
            ..Receivers::new(device, pixels.len() as u32, 0)?
        })
    }

    /// Sets the number of candidates from here on.
    pub fn set_candidate_count(&mut self, count: u32) -> Result<()> {
        self.compactor.set_item_count(count)
    }

    pub fn candidate_count(&self) -> u32 {
        self.compactor.item_count
    }

    /// The number of receivers, on the device.
    pub fn lengths(&self) -> &Buffer {
        &self.compactor.lengths
    }

    /// The ranges of the matte and the glossy receivers; valid after the submission.
    pub fn ranges(&self) -> Result<[ReceiverRange; 2]> {
        let ListLengths { matte, glossy } = self.compactor.read_lengths()?;
        let range = |is_glossy, first, count| ReceiverRange {
            is_glossy,
            first,
            count,
        };
        Ok([range(false, 0, matte), range(true, matte, glossy)])
    }
}

/// Consecutive receivers of the list: either all have a specular lobe, or none has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ReceiverRange {
    pub is_glossy: bool,
    pub first: u32,
    pub count: u32,
}

impl ReceiverRange {
    /// The same receivers in ranges of at most `max_count`.
    pub fn split(self, max_count: u32) -> impl Iterator<Item = ReceiverRange> + Clone {
        let starts = (0..self.count).step_by(max_count as usize);
        starts.map(move |start| ReceiverRange {
            first: self.first + start,
            count: max_count.min(self.count - start),
            ..self
        })
    }
}

/// Receivers to gather at: a range of a list of a G-buffer's pixels.
#[derive(Clone, Copy)]
pub(crate) struct ListedReceivers<'r> {
    pub gbuffer: &'r GBuffer,
    pub list: &'r Receivers,
    pub range: ReceiverRange,
}

/// Lists the receivers among the candidates. These are every `grid_stride`-th pixel of each row and column, or those of the list
/// if there is no `grid_stride`.
pub(crate) fn list(
    context: &Context,
    gbuffer: &GBuffer,
    receivers: &Receivers,
    grid_stride: Option<u32>,
) -> Result<()> {
    let brdf = context.plan.brdf();
    let mut resources = gbuffer.resources();
    resources.extend([
        ("candidates", Resource::Buffer(&receivers.candidates)),
        ("receivers", Resource::Buffer(&receivers.pixels)),
    ]);
    receivers.compactor.record(
        context,
        [Key::ReceiversCount { brdf }, Key::ReceiversWrite { brdf }],
        &resources,
        grid_stride.unwrap_or(0),
    )
}
