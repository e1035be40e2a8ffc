//! VPL pass: the texels of an RSM that carry flux become virtual point lights, in a compact list.

use super::{Context, compact::Compactor, light::DeviceLight, rsm::Rsm};
use crate::{
    Result,
    plan::{IndirectPlan, Plan},
    scene::Estimator,
    vulkan::{
        Device, Image, ImageShape, Recorder, Resource,
        shaders::{ListLengths, Module},
    },
};

/// VPLs, a layer per member: of one light, whose room the next one reuses, or of all lights, one behind the other.
pub(crate) struct VplLists {
    /// Where the lists are not kept apart: all of them.
    pub matte: Image,
    /// Only where some material is specular.
    pub glossy: Option<Image>,
    compactor: Compactor,
    /// From one light's place to the next one's, in the lists of all lights' VPLs and of the tiles of their RSMs.
    pub room_per_light: [u32; 2],
}

impl VplLists {
    /// Room for up to `texel_count` VPLs of either kind for each of `light_count` lights, rounded up to whole fetches of the gather.
    pub fn new(
        device: &Device,
        plan: &Plan,
        light_count: u32,
        texel_count: u32,
    ) -> Result<VplLists> {
        let module = Module::find("gather", &["tile", "average", "lambert", "glossy"])?;
        let fetch_vpls = module.constant("FETCH_VPLS")?;
        let columns = module.constant("VPLS_PER_ROW")?;
        let rows = light_count * texel_count.next_multiple_of(fetch_vpls).div_ceil(columns);
        let list = |what, layers| {
            let shape = ImageShape {
                size_px: [columns, rows],
                layers: Some(module.constant(layers)?),
                is_depth: false,
            };
            Image::new(device, what, shape)
        };
        Ok(VplLists {
            matte: list("VPLs", "VPL_LAYERS")?,
            glossy: plan
                .is_specular
                .then(|| list("glossy VPLs", "GLOSSY_VPL_LAYERS"))
                .transpose()?,
            compactor: Compactor::new(device, texel_count)?,
            room_per_light: match light_count {
                1 => [0; 2],
                _ => [rows / light_count * columns, 0],
            },
        })
    }

    /// Room for the VPLs of `light_count` lights with up to `texel_count` each, in one list: for rays from P to all of them.
    pub fn for_bounce(
        device: &Device,
        plan: &Plan,
        light_count: u32,
        texel_count: u32,
    ) -> Result<VplLists> {
        let module = Module::find("vpl", &["write", plan.brdf_word(), "bounce"])?;
        let columns = module.constant("VPLS_PER_ROW")?;
        let rows_per_light = texel_count.div_ceil(columns);
        let compactor = Compactor::with_run_places(device, texel_count)?;
        let layers = if plan.is_specular {
            "GLOSSY_VPL_LAYERS"
        } else {
            "VPL_LAYERS"
        };
        let shape = ImageShape {
            size_px: [columns, light_count * rows_per_light],
            layers: Some(module.constant(layers)?),
            is_depth: false,
        };
        Ok(VplLists {
            matte: Image::new(device, "VPLs", shape)?,
            glossy: None,
            room_per_light: [rows_per_light * columns, compactor.run_count()],
            compactor,
        })
    }

    /// How many texels the light that comes next has.
    pub fn set_texel_count(&mut self, texel_count: u32) -> Result<()> {
        self.compactor.set_item_count(texel_count)
    }

    /// With rays: how many VPLs each tile of the RSM has; after the submission.
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

/// The word of the shader permutations for an estimator.
pub(crate) fn estimator_word(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::RsmAverage => "average",
        Estimator::InstantRadiosity => "radiosity",
    }
}

/// Lists the VPLs of an RSM. What is left of the last fetch is zero: a VPL without power.
///
/// Where the lights share lists, these keep what they have, and the light's VPLs go to a place of their own.
pub(crate) fn extract<'r>(
    recorder: &mut Recorder<'r>,
    context: &Context,
    indirect: &IndirectPlan,
    light: &'r DeviceLight,
    rsm: &'r Rsm,
    vpls: &'r VplLists,
) -> Result<()> {
    if indirect.bounce().is_none() && light.parameters.first_vpl == 0 {
        for list in [Some(&vpls.matte), vpls.glossy.as_ref()]
            .into_iter()
            .flatten()
        {
            recorder.prepare_images(&[list]);
            recorder.clear_image(list);
        }
    }
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
    let (list, record) = match indirect.bounce() {
        Some(_) => ("bounce", "bounce"),
        None => ("apart", estimator_word(indirect.estimator)),
    };
    vpls.compactor.record(
        recorder,
        context,
        "vpl",
        &[brdf, list],
        &[brdf, record],
        &resources,
    )
}
