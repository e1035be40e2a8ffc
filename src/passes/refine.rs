//! Refine pass: the candidates that show a surface become receivers of the bounce, those with a specular lobe apart.

use super::{
    Context,
    compact::{Compactor, Run},
    gbuffer::GBuffer,
};
use crate::{
    Result,
    vulkan::{Buffer, BufferUse, Device, Recorder, Resource},
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
