//! The surfaces of a scene on the device: what frames share until a mesh, a material or a texture changes.

use std::sync::Arc;

use super::Kept;
use crate::{
    LocalSpace, Result,
    passes::{
        Context,
        hits::HitSurfaces,
        rays::RayTreeImages,
        surface::{Surfaces, Textures},
    },
    scene::{Material, Mesh, Shared, Texture},
    vulkan::Recorder,
};

/// Surfaces as the passes see them, in parts that change apart.
pub(crate) struct Stage {
    textures: Part<TextureInput, Arc<Textures>>,
    surfaces: Part<SurfaceInput, Surfaces>,
    /// Only where something casts rays.
    ray_tree: Part<RayTreeInput, Option<RayTreeImages>>,
    /// Only where the bounce does.
    hit_surfaces: Part<HitInput, Option<HitSurfaces>>,
}

/// What was made, and all that it depends on.
struct Part<I, T> {
    made_from: I,
    made: T,
    /// By this frame.
    is_new: bool,
}

#[derive(Clone, PartialEq)]
struct TextureInput {
    is_textured: bool,
    textures: Unchanged<Texture>,
}

#[derive(Clone, PartialEq)]
struct SurfaceInput {
    space: LocalSpace,
    is_smooth: bool,
    materials: Vec<Material>,
    meshes: Unchanged<Mesh>,
    textures: TextureInput,
}

#[derive(PartialEq)]
struct RayTreeInput {
    has_rays: bool,
    space: LocalSpace,
    meshes: Unchanged<Mesh>,
}

#[derive(PartialEq)]
struct HitInput {
    has_bounce: bool,
    surfaces: SurfaceInput,
}

/// Equal where all are the very same: values that cannot change as long as they are kept. Others are taken for different ones
/// without a look at them.
#[derive(Clone)]
struct Unchanged<T>(Vec<Shared<T>>);

impl<T> PartialEq for Unchanged<T> {
    fn eq(&self, other: &Self) -> bool {
        let pairs = self.0.iter().zip(&other.0);
        self.0.len() == other.0.len() && pairs.into_iter().all(|(a, b)| a.is_one(b))
    }
}

impl<I: PartialEq, T> Part<I, T> {
    /// That of the frame before, where it still fits.
    fn kept(before: Option<Part<I, T>>, input: &I) -> Option<Part<I, T>> {
        before.filter(|part| part.made_from == *input)
    }

    fn renew(
        kept: Option<Part<I, T>>,
        input: I,
        make: impl FnOnce() -> Result<T>,
    ) -> Result<Part<I, T>> {
        Ok(match kept {
            Some(part) => Part {
                is_new: false,
                ..part
            },
            None => Part {
                made: make()?,
                made_from: input,
                is_new: true,
            },
        })
    }
}

impl Stage {
    /// The surfaces of the context's scene: what has changed since the frame before is copied to the device. Where surfaces
    /// have, what lights saw of them is given up.
    pub fn renew(kept: &mut Kept, context: &Context) -> Result<Stage> {
        let Context {
            device,
            scene,
            plan,
            space,
            ..
        } = *context;
        let (textures, surfaces, ray_tree, hit_surfaces) = match kept.stage.take() {
            None => (None, None, None, None),
            Some(stage) => (
                Some(stage.textures),
                Some(stage.surfaces),
                Some(stage.ray_tree),
                Some(stage.hit_surfaces),
            ),
        };
        let meshes = Unchanged(scene.meshes.clone());
        let texture_input = TextureInput {
            is_textured: plan.is_textured,
            textures: Unchanged(scene.textures.clone()),
        };
        let surface_input = SurfaceInput {
            space: *space,
            is_smooth: plan.is_smooth,
            materials: scene.materials.clone(),
            meshes: meshes.clone(),
            textures: texture_input.clone(),
        };
        let ray_tree_input = RayTreeInput {
            has_rays: plan.has_rays(),
            space: *space,
            meshes,
        };
        let hit_input = HitInput {
            has_bounce: plan.bounce().is_some(),
            surfaces: surface_input.clone(),
        };
        // All before anything is made, so that old and new are never there together.
        let surfaces = Part::kept(surfaces, &surface_input);
        let textures = Part::kept(textures, &texture_input);
        let ray_tree = Part::kept(ray_tree, &ray_tree_input);
        let hit_surfaces = Part::kept(hit_surfaces, &hit_input);
        if surfaces.is_none() {
            kept.lighting = None;
        }
        let textures = Part::renew(textures, texture_input, || {
            Ok(Arc::new(Textures::upload(device, scene, plan)?))
        })?;
        Ok(Stage {
            surfaces: Part::renew(surfaces, surface_input, || {
                Surfaces::upload(device, scene, plan, space, &textures.made)
            })?,
            textures,
            ray_tree: Part::renew(ray_tree, ray_tree_input, || {
                RayTreeImages::for_plan(device, scene, plan, space)
            })?,
            hit_surfaces: Part::renew(hit_surfaces, hit_input, || {
                let bounce = plan.bounce();
                bounce
                    .map(|_| HitSurfaces::upload(device, scene, plan))
                    .transpose()
            })?,
        })
    }

    pub fn surfaces(&self) -> &Surfaces {
        &self.surfaces.made
    }

    pub fn ray_tree(&self) -> Option<&RayTreeImages> {
        self.ray_tree.made.as_ref()
    }

    pub fn hit_surfaces(&self) -> Option<&HitSurfaces> {
        self.hit_surfaces.made.as_ref()
    }

    /// Fills the images that are new, before anything reads them.
    pub fn record_copies<'r>(&'r self, recorder: &mut Recorder<'r>) {
        if self.textures.is_new {
            self.textures.made.record_copies(recorder);
        }
        if let (true, Some(tree)) = (self.ray_tree.is_new, self.ray_tree()) {
            tree.record_copy(recorder);
        }
        if let (true, Some(surfaces)) = (self.hit_surfaces.is_new, self.hit_surfaces()) {
            surfaces.record_copy(recorder);
        }
    }
}
