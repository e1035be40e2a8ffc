//! VPL pass: turns the texels of an RSM that carry flux into virtual point lights, in a compact list.

use super::{Context, compact::Compactor, light::DeviceLight, rsm::Rsm};
use crate::{
    Result,
    plan::Plan,
    vulkan::{
        Allocate, Device, ImageShape, Recorder, Resource,
        shaders::{Brdf, Key, ListLengths, constants::VPLS_PER_ROW},
    },
};

/// VPLs of all lights, one light after the other, with one layer per member.
pub(crate) struct VplLists<A: Allocate = Device> {
    pub matte: A::Image,
    /// Only if some material is specular.
    pub glossy: Option<A::Image>,
    compactor: Compactor<A>,
    /// Distance from one light's place in the lists to that of the next.
    pub room_per_light: u32,
}

impl<A: Allocate> VplLists<A> {
    /// Room for a matte and a glossy VPL for each texel of the RSM of each light; `None` if no sum over VPLs is taken.
    pub fn for_plan(allocate: &A, plan: &Plan) -> Result<Option<VplLists<A>>> {
        let Some(rsm_size) = plan.rsm_size() else {
            return Ok(None);
        };
        let texel_count = plan.max_faces() * rsm_size * rsm_size;
        let light_count = plan.lights.len() as u32;
        let brdf = plan.brdf();
        let module = Key::VplCount { brdf }.module();
        let columns = VPLS_PER_ROW;
        let rows_per_light = texel_count.div_ceil(columns);
        let list = |what, layers| {
            let shape = ImageShape::plain([columns, light_count * rows_per_light]);
            allocate.image(what, shape.with_layers(module.constant(layers)?))
        };
        Ok(Some(VplLists {
            matte: list("VPLs", "VPL_LAYERS")?,
            glossy: plan
                .is_specular
                .then(|| list("glossy VPLs", vpl_layers(plan)))
                .transpose()?,
            room_per_light: rows_per_light * columns,
            compactor: Compactor::new(allocate, texel_count)?,
        }))
    }
}

/// The constant of shaders that counts the layers of VPLs that may have a lobe.
pub(super) fn vpl_layers(plan: &Plan) -> &'static str {
    match plan.brdf() {
        Brdf::Lambert => "VPL_LAYERS",
        Brdf::Specular => "PHONG_VPL_LAYERS",
        Brdf::SpecularMicrofacet => "MICROFACET_VPL_LAYERS",
    }
}

impl VplLists {
    /// Clears the lists to zero. Shaders also read beyond the end of a list, and must find numbers there.
    pub fn clear(&self, recorder: &mut Recorder) {
        for list in [Some(&self.matte), self.glossy.as_ref()]
            .into_iter()
            .flatten()
        {
            recorder.clear_image(list);
        }
    }

    /// Sets the number of texels of the next light.
    pub fn set_texel_count(&mut self, texel_count: u32) -> Result<()> {
        self.compactor.set_item_count(texel_count)
    }

    /// The numbers of matte and glossy VPLs; valid after the submission.
    pub fn lengths(&self) -> Result<ListLengths> {
        self.compactor.read_lengths()
    }
}

/// Lists the VPLs of an RSM, in the light's place in the lists of all lights.
pub(crate) fn extract(
    context: &Context,
    light: &DeviceLight,
    rsm: &Rsm,
    vpls: &VplLists,
) -> Result<()> {
    let mut resources = rsm.resources();
    resources.extend([
        ("emission", Resource::Buffer(&light.emission)),
        ("light", Resource::Buffer(&light.uniform)),
        ("matte_vpls", Resource::Image(&vpls.matte)),
    ]);
    if let Some(glossy) = &vpls.glossy {
        resources.push(("glossy_vpls", Resource::Image(glossy)));
    }
    let brdf = context.plan.brdf();
    let Some(sum) = context.plan.indirect.and_then(|plan| plan.sum()) else {
        return Ok(());
    };
    vpls.compactor.record(
        context,
        [
            Key::VplCount { brdf },
            Key::VplWrite {
                brdf,
                sum: sum.into(),
            },
        ],
        &resources,
        0,
    )
}
