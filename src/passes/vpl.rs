//! VPL pass: the texels of an RSM that carry flux become virtual point lights, in a compact list.

use super::{Context, compact::Compactor, light::DeviceLight, rsm::Rsm};
use crate::{
    Result,
    plan::Plan,
    vulkan::{
        Allocate, Device, ImageShape, Recorder, Resource,
        shaders::{ListLengths, Module},
    },
};

/// VPLs of all lights, one behind the other, a layer per member.
pub(crate) struct VplLists<A: Allocate = Device> {
    /// Where the lists are not kept apart: all of them.
    pub matte: A::Image,
    /// Of sums, and only where some material is specular.
    pub glossy: Option<A::Image>,
    compactor: Compactor<A>,
    /// From one light's place to the next one's, in the lists of all lights' VPLs and of the tiles of their RSMs.
    pub room_per_light: [u32; 2],
}

impl<A: Allocate> VplLists<A> {
    /// Room for a VPL of either kind for each texel of the RSM of each light; `None` without indirect light.
    pub fn for_plan(allocate: &A, plan: &Plan) -> Result<Option<VplLists<A>>> {
        let Some(indirect) = plan.indirect else {
            return Ok(None);
        };
        let texel_count = plan.max_faces() * indirect.rsm_size * indirect.rsm_size;
        let light_count = plan.lights.len() as u32;
        let module = Module::find("vpl", &["write", plan.brdf_word(), "final_gather"])?;
        let columns = module.constant("VPLS_PER_ROW")?;
        let rows_per_light = texel_count.div_ceil(columns);
        let list = |what, layers| {
            let shape = ImageShape {
                size_px: [columns, light_count * rows_per_light],
                layers: Some(module.constant(layers)?),
                is_depth: false,
            };
            allocate.image(what, shape)
        };
        // Final gathering keeps one list, in which every VPL has a lobe, and wants to know where the tiles lie in it.
        let is_final_gather = indirect.is_final_gather();
        let is_glossy_apart = plan.is_specular && !is_final_gather;
        let matte_layers = if plan.is_specular && is_final_gather {
            "GLOSSY_VPL_LAYERS"
        } else {
            "VPL_LAYERS"
        };
        let compactor = if is_final_gather {
            Compactor::with_run_places(allocate, texel_count)?
        } else {
            Compactor::new(allocate, texel_count)?
        };
        Ok(Some(VplLists {
            matte: list("VPLs", matte_layers)?,
            glossy: is_glossy_apart
                .then(|| list("glossy VPLs", "GLOSSY_VPL_LAYERS"))
                .transpose()?,
            room_per_light: [rows_per_light * columns, compactor.run_count()],
            compactor,
        }))
    }
}

impl VplLists {
    /// Zeros: what lies behind a list is read, too, and must be numbers.
    pub fn clear<'r>(&'r self, recorder: &mut Recorder<'r>) {
        for list in [Some(&self.matte), self.glossy.as_ref()]
            .into_iter()
            .flatten()
        {
            recorder.prepare_images(&[list]);
            recorder.clear_image(list);
        }
    }

    /// How many texels the light that comes next has.
    pub fn set_texel_count(&mut self, texel_count: u32) -> Result<()> {
        self.compactor.set_item_count(texel_count)
    }

    /// With final gathering: how many VPLs each tile of the RSM has; after the submission.
    pub fn tile_lengths(&self) -> Result<Vec<u32>> {
        let places = self.compactor.run_places()?.iter().map(|place| place.matte);
        let ends = places.clone().skip(1).chain([self.lengths()?.matte]);
        Ok(places.zip(ends).map(|(place, end)| end - place).collect())
    }

    /// How many VPLs there are of either kind, after the submission.
    pub fn lengths(&self) -> Result<ListLengths> {
        self.compactor.lengths()
    }
}

/// Lists the VPLs of an RSM, in the light's own place among those of all lights.
pub(crate) fn extract<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    light: &'r DeviceLight,
    rsm: &'r Rsm,
    vpls: &'r VplLists,
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
    let brdf = context.plan.brdf_word();
    let (list, record) = match context.plan.indirect.and_then(|plan| plan.sum()) {
        None => ("final_gather", "final_gather"),
        Some(sum) => ("apart", sum.word()),
    };
    vpls.compactor.record(
        recorder,
        context,
        "vpl",
        [&[brdf, list], &[brdf, record]],
        &resources,
        0,
    )
}
