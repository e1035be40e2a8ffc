//! Refine pass: the candidates that show a surface become receivers of the bounce, those with a specular lobe apart.

use super::{Context, compact::Compactor, gbuffer::GBuffer};
use crate::{
    Result,
    vulkan::{Buffer, BufferUse, Device, Recorder, Resource, shaders::ListLengths},
};

/// Pixels as column + 65536 · row.
pub(crate) struct Refinement {
    pub candidates: Buffer,
    /// Those of the candidates that show a surface: matte ones, then glossy ones.
    pub receivers: Buffer,
    compactor: Compactor,
}

impl Refinement {
    /// Room for so many candidates.
    pub fn new(device: &Device, capacity: u32) -> Result<Refinement> {
        let bytes = 4 * u64::from(capacity);
        Ok(Refinement {
            candidates: Buffer::new(device, "candidates", bytes, BufferUse::Device)?,
            receivers: Buffer::new(device, "list of pixels", bytes, BufferUse::Device)?,
            compactor: Compactor::new(device, capacity)?,
        })
    }

    /// With candidates of the host's choice.
    pub fn with_candidates(device: &Device, pixels: &[u32]) -> Result<Refinement> {
        Ok(Refinement {
            candidates: Buffer::upload(device, "candidates", pixels)?,
            ..Refinement::new(device, pixels.len() as u32)?
        })
    }

    /// How many candidates there are from here on.
    pub fn set_candidate_count(&mut self, count: u32) -> Result<()> {
        self.compactor.set_item_count(count)
    }

    /// The matte receivers and the glossy ones, after the submission.
    pub fn runs(&self) -> Result<[Run; 2]> {
        Ok(Run::of_list(self.compactor.lengths()?))
    }
}

/// Receivers next to each other in the list that all have a specular lobe, or all have none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    pub is_glossy: bool,
    pub first: u32,
    pub count: u32,
}

impl Run {
    /// The two runs of a list of pixels: matte ones, then glossy ones.
    pub fn of_list(lengths: ListLengths) -> [Run; 2] {
        let ListLengths { matte, glossy } = lengths;
        let run = |is_glossy, first, count| Run {
            is_glossy,
            first,
            count,
        };
        [run(false, 0, matte), run(true, matte, glossy)]
    }

    /// The same receivers in runs of at most `max_count`.
    pub fn split(self, max_count: u32) -> impl Iterator<Item = Run> {
        let starts = (0..self.count).step_by(max_count as usize);
        starts.map(move |start| Run {
            first: self.first + start,
            count: max_count.min(self.count - start),
            ..self
        })
    }
}

/// Lists the receivers.
pub(crate) fn list<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    refinement: &'r Refinement,
) -> Result<()> {
    let brdf = [context.plan.brdf_word()];
    let mut resources = gbuffer.resources();
    resources.extend([
        ("candidates", Resource::Buffer(&refinement.candidates)),
        ("receivers", Resource::Buffer(&refinement.receivers)),
    ]);
    refinement
        .compactor
        .record(recorder, context, "refine", &brdf, &brdf, &resources)
}
