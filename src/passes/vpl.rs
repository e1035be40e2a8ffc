//! VPL pass: the texels of an RSM that carry flux become virtual point lights, in a compact list.

use super::{compact::Compactor, rsm::Rsm};
use crate::{
    Result,
    plan::{IndirectPlan, Plan},
    scene::Estimator,
    vulkan::{
        Buffer, BufferUse, Device, Pipelines, Recorder, Resource,
        shaders::{GlossyVpl, ListLengths, Module, Vpl},
    },
};

/// The VPLs of one light; the room is reused by the next.
pub(crate) struct VplLists {
    pub matte: Buffer,
    /// Only where some material is specular.
    pub glossy: Option<Buffer>,
    compactor: Compactor,
}

impl VplLists {
    /// Room for `texel_count` VPLs of either kind, rounded up to whole tiles of the gather.
    pub fn new(device: &Device, plan: &Plan, texel_count: u32) -> Result<VplLists> {
        let tile = Module::find("gather", &["tile", "average", "lambert", "matte"])?
            .constant("TILE_VPLS")?;
        let room = u64::from(texel_count.next_multiple_of(tile));
        let list = |what, record: usize| {
            Buffer::new(device, what, room * record as u64, BufferUse::Device)
        };
        Ok(VplLists {
            matte: list("VPLs", size_of::<Vpl>())?,
            glossy: plan
                .is_specular
                .then(|| list("glossy VPLs", size_of::<GlossyVpl>()))
                .transpose()?,
            compactor: Compactor::new(device, texel_count)?,
        })
    }

    /// How many texels the light that comes next has.
    pub fn set_texel_count(&mut self, texel_count: u32) -> Result<()> {
        self.compactor.set_item_count(texel_count)
    }

    /// How many VPLs there are of either kind, after the submission.
    pub fn lengths(&self) -> Result<ListLengths> {
        self.compactor.lengths()
    }
}

/// The word of the shader permutations for an estimator.
pub(crate) fn estimator_word(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::RsmAverage => "average",
        Estimator::InstantRadiosity => "radiosity",
    }
}

/// Lists the VPLs of an RSM. What is left of the last tile is zero: a VPL without power.
#[allow(clippy::too_many_arguments, reason = "a pass is a function of its images")]
pub(crate) fn extract<'r>(
    recorder: &mut Recorder<'r>,
    pipelines: &Pipelines,
    plan: &Plan,
    indirect: &IndirectPlan,
    light: &'r Buffer,
    emission: &'r Buffer,
    rsm: &'r Rsm,
    vpls: &'r VplLists,
) -> Result<()> {
    recorder.barrier();
    recorder.clear_buffer(&vpls.matte);
    let mut resources = rsm.resources();
    resources.extend([
        ("emission", Resource::Buffer(emission)),
        ("light", Resource::Buffer(light)),
        ("vpls", Resource::Buffer(&vpls.matte)),
    ]);
    if let Some(glossy) = &vpls.glossy {
        recorder.clear_buffer(glossy);
        resources.push(("glossy_vpls", Resource::Buffer(glossy)));
    }
    let brdf = plan.brdf_word();
    vpls.compactor.record(
        recorder,
        pipelines,
        "vpl",
        &[brdf],
        &[brdf, estimator_word(indirect.estimator)],
        &resources,
    )
}
