//! Receivers pass: the pixels that show a surface, those with a specular lobe apart.

use super::{
    Context,
    compact::{Compactor, Run},
    gbuffer::GBuffer,
};
use crate::{
    Result,
    plan::Plan,
    vulkan::{Buffer, BufferUse, Device, Recorder, Resource},
};

/// Pixels as column + 65536 · row: matte ones, then glossy ones.
pub(crate) struct Receivers {
    pub pixels: Buffer,
    compactor: Compactor,
}

impl Receivers {
    pub fn new(device: &Device, plan: &Plan) -> Result<Receivers> {
        let [width, height] = plan.resolution_px;
        let count = width * height;
        Ok(Receivers {
            pixels: Buffer::new(
                device,
                "list of pixels",
                4 * u64::from(count),
                BufferUse::Device,
            )?,
            compactor: Compactor::new(device, count)?,
        })
    }

    /// The matte pixels and the glossy ones, after the submission.
    pub fn runs(&self) -> Result<[Run; 2]> {
        Ok(Run::of_list(self.compactor.lengths()?))
    }
}

/// Lists the pixels of the G-buffer that show a surface.
pub(crate) fn list<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    gbuffer: &'r GBuffer,
    receivers: &'r Receivers,
) -> Result<()> {
    let brdf = [context.plan.brdf_word()];
    let mut resources = gbuffer.resources();
    resources.push(("receivers", Resource::Buffer(&receivers.pixels)));
    receivers
        .compactor
        .record(recorder, context, "receivers", &brdf, &brdf, &resources)
}
