//! What the lights of a scene see, and their VPLs. Frames share these until a light or a surface changes.

use super::{cache::Cached, scene_resources::SceneResources};
use crate::{
    Error, LightPlan, Result,
    passes::{
        Context, direct::Occluders, gather::ListedVpls, light::DeviceLight, rsm::Rsm,
        shadow::ShadowMap, vpl::VplLists,
    },
    plan::ShadowPlan,
    scene::{Light, VplSum},
    vulkan::Recorder,
};

/// Lights, their maps and their VPLs.
pub(crate) struct Lights {
    /// The VPLs of all lights; only if sums are taken over them.
    pub vpls: Option<VplLists>,
    /// One set per light, or one that the lights use one after the other.
    map_sets: Vec<MapSet>,
    /// In the order of the scene.
    lights: Vec<Cached<LightKey, LitLight>>,
}

/// Everything that the room for maps and lists, and their layout, depends on.
#[derive(PartialEq)]
pub(crate) struct LightsKey {
    /// The sum (`None` for final gathering), and the size of the emission domain.
    indirect: Option<(Option<VplSum>, u32)>,
    own_map_size: Option<u32>,
    max_faces: u32,
    light_count: usize,
    map_sets: u32,
    is_specular: bool,
    has_phasors: bool,
}

/// What a light and its VPLs depend on. `generation` is that of the surfaces.
#[derive(PartialEq)]
struct LightKey {
    light: Light,
    plan: LightPlan,
    /// Frequencies of the light's modulation.
    frequencies_hz: Vec<f64>,
    /// Of the points on emissive surfaces; 0 for other lights.
    seed: u32,
    generation: u64,
}

/// The maps of a light, and the keys of what they show.
struct MapSet {
    /// Only if VPLs are taken from it.
    rsm: Option<Rsm>,
    rsm_shows: Cached<LightKey, ()>,
    /// Only if neither RSMs nor rays serve the shadow test.
    shadow_map: Option<ShadowMap>,
    shadow_map_shows: Cached<LightKey, ()>,
}

/// A light on the device.
struct LitLight {
    device: DeviceLight,
    /// Set by [`Lights::take_vpls`].
    listed: Option<ListedVpls>,
}

/// A light of this frame.
pub(crate) struct UpdatedLight<'l> {
    /// In the scene.
    pub index: usize,
    pub device: &'l DeviceLight,
    /// Where the shadow test looks for occluders.
    pub occluders: Occluders<'l>,
    /// What has to be made in this frame.
    pub rsm_to_draw: Option<&'l Rsm>,
    pub shadow_map_to_draw: Option<&'l ShadowMap>,
    pub vpls_to_list: Option<(&'l Rsm, &'l VplLists)>,
}

impl LightsKey {
    pub fn new(context: &Context) -> LightsKey {
        let plan = context.plan;
        LightsKey {
            indirect: plan.indirect.map(|plan| (plan.sum(), plan.emission_size)),
            own_map_size: plan.own_map_size(),
            max_faces: plan.max_faces(),
            light_count: plan.lights.len(),
            map_sets: plan.map_sets,
            is_specular: plan.is_specular,
            has_phasors: plan.bounced_tof().is_some(),
        }
    }
}

impl Lights {
    /// Allocates room for the lights of the context's scene.
    pub fn new(context: &Context) -> Result<Lights> {
        let Context { device, plan, .. } = *context;
        let map_set = |_| {
            Ok(MapSet {
                rsm: Rsm::for_plan(device, plan)?,
                rsm_shows: Cached::default(),
                shadow_map: ShadowMap::for_plan(device, plan)?,
                shadow_map_shows: Cached::default(),
            })
        };
        Ok(Lights {
            vpls: VplLists::for_plan(device, plan)?,
            map_sets: (0..plan.map_sets).map(map_set).collect::<Result<_>>()?,
            lights: plan.lights.iter().map(|_| Cached::default()).collect(),
        })
    }

    /// Clears new lists before anything reads them.
    pub fn record_clears(&self, recorder: &mut Recorder) {
        if let Some(vpls) = &self.vpls {
            vpls.clear(recorder);
        }
    }

    /// Puts the light with this index on the device.
    pub fn update<'l>(
        &'l mut self,
        context: &Context,
        index: usize,
        scene: &'l SceneResources,
    ) -> Result<UpdatedLight<'l>> {
        let light = &context.scene.lights[index].light;
        let plan = &context.plan.lights[index];
        let tof = context.scene.tof.as_ref();
        let tof = tof.filter(|_| plan.is_modulated);
        let key = LightKey {
            light: light.clone(),
            plan: plan.clone(),
            frequencies_hz: tof.map_or_else(Vec::new, |tof| tof.frequencies_hz.clone()),
            seed: if plan.emission_points > 0 {
                context.seed
            } else {
                0
            },
            generation: scene.generation,
        };
        let room = self.vpls.as_ref().map_or(0, |vpls| vpls.room_per_light);
        let tiles = context
            .plan
            .indirect
            .map_or(0, |plan| plan.emission_size.pow(2));
        let place = [room, context.plan.max_faces() * tiles].map(|room| index as u32 * room);
        let (lit, is_new) = self.lights[index].get_or_make(key, || {
            Ok(LitLight {
                device: DeviceLight::new(context, index, place)?,
                listed: None,
            })
        })?;
        if let Some(vpls) = &mut self.vpls {
            vpls.set_texel_count(lit.device.texel_count)?;
        }
        let map_count = self.map_sets.len();
        let maps = &mut self.map_sets[index % map_count];
        // What a light sees does not depend on what it emits.
        let sees = || LightKey {
            light: light.with_emission([1.0; 3]),
            plan: LightPlan {
                is_modulated: false,
                ..plan.clone()
            },
            frequencies_hz: Vec::new(),
            seed: 0,
            generation: scene.generation,
        };
        let is_old = |shows: &mut Cached<LightKey, ()>| -> Result<bool> {
            Ok(shows.get_or_make(sees(), || Ok(()))?.1)
        };
        let reads_rsm = is_new || matches!(plan.shadow, ShadowPlan::Rsm { .. });
        let draws_rsm = reads_rsm && maps.rsm.is_some() && is_old(&mut maps.rsm_shows)?;
        let draws_map = maps.shadow_map.is_some() && is_old(&mut maps.shadow_map_shows)?;

        let (rsm, shadow_map) = (maps.rsm.as_ref(), maps.shadow_map.as_ref());
        let positions = match plan.shadow {
            ShadowPlan::Rsm { .. } => rsm.map(|rsm| &rsm.position),
            ShadowPlan::Map { .. } => shadow_map.map(|map| &map.position),
            ShadowPlan::Rays => None,
        };
        let occluders = match (plan.shadow, positions) {
            (ShadowPlan::Rays, _) => Occluders::Rays(scene.ray_tree()?),
            (_, Some(positions)) => Occluders::Map(positions),
            _ => return Err(Error::internal("a light has no shadow map")),
        };
        Ok(UpdatedLight {
            index,
            device: &lit.device,
            occluders,
            rsm_to_draw: rsm.filter(|_| draws_rsm),
            shadow_map_to_draw: shadow_map.filter(|_| draws_map),
            vpls_to_list: rsm.zip(self.vpls.as_ref()).filter(|_| is_new),
        })
    }

    /// A light on the device and its maps, after [`Lights::update`].
    #[cfg(feature = "internals")]
    pub fn light(&self, index: usize) -> Result<(&DeviceLight, Option<&Rsm>, Option<&ShadowMap>)> {
        let maps = &self.map_sets[index % self.map_sets.len()];
        let lit = self.lights.get(index).and_then(Cached::get);
        let lit = lit.ok_or_else(|| Error::internal("a light is not on the device"))?;
        Ok((&lit.device, maps.rsm.as_ref(), maps.shadow_map.as_ref()))
    }

    /// Reads how many VPLs a light has. Call it after the submission that listed them.
    pub fn take_vpls(&mut self, index: usize) -> Result<()> {
        let (Some(vpls), Some(lit)) = (&self.vpls, self.lights[index].get_mut()) else {
            return Ok(());
        };
        let listed = ListedVpls {
            first: lit.device.parameters.first_vpl,
            lengths: vpls.lengths()?,
        };
        lit.listed = Some(listed);
        Ok(())
    }

    /// Where the VPLs of a light are in the lists; `None` if they are not listed.
    pub fn vpls_of(&self, index: usize) -> Option<ListedVpls> {
        self.lights.get(index)?.get()?.listed
    }

    /// Where the VPLs of all lights are in the lists.
    pub fn listed(&self) -> Vec<ListedVpls> {
        let lights = 0..self.lights.len();
        lights.filter_map(|index| self.vpls_of(index)).collect()
    }

    /// Number of VPLs that carry flux, over all lights.
    pub fn vpl_count(&self) -> u64 {
        self.listed().iter().map(|l| u64::from(l.count())).sum()
    }

    /// All lights on the device.
    pub fn on_device(&self) -> Vec<&DeviceLight> {
        let lights = self.lights.iter().filter_map(Cached::get);
        lights.map(|light| &light.device).collect()
    }
}
