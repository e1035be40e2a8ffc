//! The surfaces of a scene on the device: what frames share until a mesh, a material or a texture changes.

use crate::{
    LocalSpace, Result,
    passes::{Context, hits::HitSurfaces, rays::RayTreeImages, surface::Surfaces},
    scene::{Material, Mesh, Shared, Texture},
    vulkan::Recorder,
};

/// Surfaces as the passes see them.
pub(crate) struct Stage {
    made_from: StageInput,
    pub surfaces: Surfaces,
    /// Only where something casts rays.
    pub ray_tree: Option<RayTreeImages>,
    /// Only where the bounce does.
    pub hit_surfaces: Option<HitSurfaces>,
}

/// All that a stage depends on.
#[derive(PartialEq)]
struct StageInput {
    space: LocalSpace,
    materials: Vec<Material>,
    is_textured: bool,
    is_smooth: bool,
    has_rays: bool,
    has_bounce: bool,
    meshes: Kept<Mesh>,
    textures: Kept<Texture>,
}

/// Values that cannot change as long as they are kept. Others are taken for different ones without a look at them.
struct Kept<T>(Vec<Shared<T>>);

impl<T> PartialEq for Kept<T> {
    fn eq(&self, other: &Self) -> bool {
        let pairs = self.0.iter().zip(&other.0);
        self.0.len() == other.0.len() && pairs.into_iter().all(|(a, b)| a.is_one(b))
    }
}

impl StageInput {
    fn of(context: &Context) -> StageInput {
        let Context {
            scene, plan, space, ..
        } = *context;
        StageInput {
            space: *space,
            materials: scene.materials.clone(),
            is_textured: plan.is_textured,
            is_smooth: plan.is_smooth,
            has_rays: plan.has_rays(),
            has_bounce: plan.bounce().is_some(),
            meshes: Kept(scene.meshes.clone()),
            textures: Kept(scene.textures.clone()),
        }
    }
}

impl Stage {
    /// The stage of the frame before, where it still fits.
    pub fn kept(stage: Option<Stage>, context: &Context) -> Option<Stage> {
        stage.filter(|stage| stage.made_from == StageInput::of(context))
    }

    /// Copies the surfaces of the context's scene to the device, and records what makes them ready.
    pub fn new(context: &Context) -> Result<Stage> {
        let Context {
            device,
            scene,
            plan,
            space,
            ..
        } = *context;
        Ok(Stage {
            made_from: StageInput::of(context),
            surfaces: Surfaces::upload(device, scene, plan, space)?,
            ray_tree: RayTreeImages::for_plan(device, scene, plan, space)?,
            hit_surfaces: plan
                .bounce()
                .map(|_| HitSurfaces::upload(device, scene, plan))
                .transpose()?,
        })
    }

    /// Fills the images; once, before anything reads them.
    pub fn record_copies<'r>(&'r self, recorder: &mut Recorder<'r>) {
        self.surfaces.record_textures(recorder);
        if let Some(tree) = &self.ray_tree {
            tree.record_copy(recorder);
        }
        if let Some(surfaces) = &self.hit_surfaces {
            surfaces.record_copy(recorder);
        }
    }
}
