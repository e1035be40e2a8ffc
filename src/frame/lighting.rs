//! What the lights of a scene see and the VPLs they make: what frames share until a light or a surface changes.

use super::shuffle;
use crate::{
    Error, IndirectMethod, LightPlan, Result,
    passes::{
        Context, gather::ListedVpls, light::DeviceLight, rsm::Rsm, shadow::ShadowMap,
        vpl::VplLists, vpl_sampler::ListedLight,
    },
    scene::{Estimator, Light},
};

/// Lights, their maps and lists. Maps are room that the lights use in turn.
pub(crate) struct Lighting {
    made_for: Room,
    /// With indirect light.
    pub rsm: Option<Rsm>,
    pub vpls: Option<VplLists>,
    /// Where neither RSMs nor rays serve.
    pub shadow_map: Option<ShadowMap>,
    /// Whose turn the maps are at. They do not depend on what it emits.
    mapped: Option<(Light, LightPlan)>,
    /// In the order of the scene; `None`: to be made.
    lights: Vec<Option<LitLight>>,
}

/// A light whose maps and VPLs are there.
pub(crate) struct LitLight {
    light: Light,
    pub device: DeviceLight,
    /// After [`Lighting::take_vpls`].
    listed: Option<ListedVpls>,
    /// The same for the draws of rays.
    listed_light: Option<ListedLight>,
}

/// What of a light has to be made.
#[derive(Clone, Copy)]
pub(crate) struct Renewed {
    pub maps: bool,
    pub vpls: bool,
}

/// All that the room for maps and lists, and the form of what lies in it, depend on.
#[derive(PartialEq)]
struct Room {
    indirect: Option<(Estimator, u32, Lists)>,
    own_map_size: Option<u32>,
    max_faces: u32,
    light_count: usize,
    is_specular: bool,
    vpl_order: Option<u64>,
}

/// Where VPLs are listed.
#[derive(Clone, Copy, PartialEq)]
enum Lists {
    /// One light's at a time.
    InTurn,
    /// All lights', in records of sums.
    OfAll,
    /// All lights', in records of rays.
    OfAllForRays,
}

impl Room {
    fn of(context: &Context) -> Room {
        let plan = context.plan;
        Room {
            indirect: plan.indirect.map(|indirect| {
                let lists = match indirect.method {
                    IndirectMethod::Bounce(_) => Lists::OfAllForRays,
                    IndirectMethod::Sum(_) if indirect.refinement().is_some() => Lists::OfAll,
                    IndirectMethod::Sum(_) => Lists::InTurn,
                };
                (indirect.estimator, indirect.rsm_size, lists)
            }),
            own_map_size: plan.own_map_size(),
            max_faces: plan.max_faces(),
            light_count: plan.lights.len(),
            is_specular: plan.is_specular,
            vpl_order: context.vpl_order,
        }
    }

    /// Whether what a light has left is still there after the other lights had their turn.
    fn is_lasting(&self, context: &Context) -> bool {
        let in_turn = matches!(self.indirect, Some((.., Lists::InTurn)));
        self.light_count == 1 || (!in_turn && !context.plan.has_shadow_maps())
    }
}

impl Lighting {
    /// That of the frame before, over the same surfaces, where it still fits; without the lights that have changed.
    pub fn kept(lighting: Option<Lighting>, context: &Context) -> Option<Lighting> {
        let mut lighting = lighting.filter(|lighting| lighting.made_for == Room::of(context))?;
        let lights = context.scene.lights.iter().zip(&context.plan.lights);
        for ((light, plan), kept) in lights.zip(&mut lighting.lights) {
            kept.take_if(|kept| kept.light != *light || kept.device.plan != *plan);
        }
        let lists = lighting.made_for.indirect.map(|(.., lists)| lists);
        // Sums read whole fetches, so that a new list has to begin with zeros everywhere.
        let is_all_or_nothing = lists == Some(Lists::OfAll);
        let is_whole = lighting.lights.iter().all(Option::is_some);
        if !lighting.made_for.is_lasting(context) || (is_all_or_nothing && !is_whole) {
            lighting.lights.fill_with(|| None);
        }
        Some(lighting)
    }

    /// Room for the lights of the context's scene.
    pub fn new(context: &Context) -> Result<Lighting> {
        let Context { device, plan, .. } = *context;
        let faces = plan.max_faces();
        let made_for = Room::of(context);
        let (rsm, vpls) = match made_for.indirect {
            None => (None, None),
            Some((_, rsm_size, lists)) => {
                let texels = faces * rsm_size * rsm_size;
                let light_count = made_for.light_count as u32;
                let vpls = match lists {
                    Lists::InTurn => VplLists::new(device, plan, 1, texels)?,
                    Lists::OfAll => VplLists::new(device, plan, light_count, texels)?,
                    Lists::OfAllForRays => VplLists::for_bounce(device, plan, light_count, texels)?,
                };
                (Some(Rsm::new(device, plan, rsm_size, faces)?), Some(vpls))
            }
        };
        Ok(Lighting {
            rsm,
            vpls,
            shadow_map: ShadowMap::for_plan(device, plan)?,
            mapped: None,
            lights: (0..made_for.light_count).map(|_| None).collect(),
            made_for,
        })
    }

    /// Puts the light of this number on the device. Where it was there, so are its maps and VPLs.
    pub fn renew(&mut self, context: &Context, index: usize) -> Result<Renewed> {
        if self.lights[index].is_some() {
            return Ok(Renewed {
                maps: false,
                vpls: false,
            });
        }
        if let Some((.., Lists::InTurn)) = self.made_for.indirect {
            // The one whose turn it was.
            self.lights.fill_with(|| None);
        }
        let light = &context.scene.lights[index];
        let place = match &self.vpls {
            Some(vpls) => vpls.room_per_light.map(|room| index as u32 * room),
            None => [0; 2],
        };
        let plan = &context.plan.lights[index];
        let device = DeviceLight::new(context, light, plan, place)?;
        if let Some(vpls) = &mut self.vpls {
            vpls.set_texel_count(device.texel_count)?;
        }
        self.lights[index] = Some(LitLight {
            light: *light,
            device,
            listed: None,
            listed_light: None,
        });
        let mapped = Some((light.with_emission([1.0; 3]), plan.clone()));
        let maps = self.mapped != mapped;
        self.mapped = mapped;
        Ok(Renewed { maps, vpls: true })
    }

    /// The light of this number, after [`Lighting::renew`].
    pub fn light(&self, index: usize) -> Result<&DeviceLight> {
        let light = self.lights.get(index).and_then(Option::as_ref);
        light
            .map(|light| &light.device)
            .ok_or_else(|| Error::internal("a light is not on the device"))
    }

    /// After the submission that listed a light's VPLs.
    pub fn take_vpls(&mut self, context: &Context, index: usize) -> Result<()> {
        let (Some(vpls), Some(lit)) = (&self.vpls, &mut self.lights[index]) else {
            return Ok(());
        };
        let listed = ListedVpls {
            first: lit.device.parameters.first_vpl,
            lengths: vpls.lengths()?,
        };
        lit.listed = Some(listed);
        match (self.made_for.indirect, self.made_for.vpl_order) {
            (Some((.., Lists::OfAllForRays)), _) => {
                lit.listed_light = Some(ListedLight::new(&lit.device, vpls)?);
                Ok(())
            }
            (_, Some(seed)) => shuffle::shuffle(context.device, vpls, listed, seed),
            (_, None) => Ok(()),
        }
    }

    /// Where the VPLs of a light lie; `None` without indirect light.
    pub fn vpls_of(&self, index: usize) -> Option<ListedVpls> {
        self.lights.get(index)?.as_ref()?.listed
    }

    /// Where the VPLs of all lights lie.
    pub fn listed(&self) -> Vec<ListedVpls> {
        let lights = self.lights.iter().flatten();
        lights.filter_map(|light| light.listed).collect()
    }

    /// The same for the draws of rays.
    pub fn listed_lights(&self) -> Vec<&ListedLight> {
        let lights = self.lights.iter().flatten();
        lights
            .filter_map(|light| light.listed_light.as_ref())
            .collect()
    }
}
