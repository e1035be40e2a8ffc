//! The surfaces of a scene on the device. Frames share them until a mesh, a material or a texture changes, and so do renderers of one device.

use std::sync::{Arc, Mutex};

use super::cache::{LockedLate, SharedValue, SharedValues};
use crate::{
    Error, LocalSpace, Result, Tracer,
    geometry::{Geometry, are_shared},
    passes::{
        Context, final_gather,
        hits::{HitScene, HitSurfaces},
        instances::Instances,
        materials::Materials,
        primary_rays,
        rays::RayTriangles,
        surface::{SurfaceLists, Surfaces},
        textures::{TextureUses, Textures, uses_of},
    },
    ray_tree::MeshTrees,
    scene::{Instance, Lens, Material, Shared, Texture, TextureLookup},
    vulkan::{Buffer, TexelList},
};

/// Surfaces as the passes see them, in parts that change independently.
#[derive(Default)]
pub(crate) struct SceneResources {
    textures: SharedValue<TexturesKey, Arc<Textures>>,
    geometry: SharedValue<GeometryKey, Arc<Geometry>>,
    surface_lists: SharedValue<SurfacesKey, Arc<SurfaceLists>>,
    surfaces: Option<Surfaces>,
    /// Only if kernels read it.
    materials: SharedValue<SurfacesKey, Arc<Materials>>,
    /// Only if something casts rays.
    ray_tree: SharedValue<RayTreeKey, RayTriangles>,
    mesh_trees: MeshTrees,
    /// Only if what the rays hit is shaded.
    hit_surfaces: SharedValue<SurfacesKey, HitSurfaces>,
    /// Only if the camera's lens distorts the image.
    lens_rays: SharedValue<LensKey, Arc<Buffer>>,
    /// The points that final gathering draws from; only if it does.
    lattice: SharedValue<(), TexelList>,
    /// Generation of the surfaces. Another number means other surfaces.
    pub generation: u64,
}

/// The parts that the renderers of a device have on it.
#[derive(Default)]
pub(crate) struct SharedScenes {
    textures: SharedValues<TexturesKey, Arc<Textures>>,
    geometry: SharedValues<GeometryKey, Arc<Geometry>>,
    surface_lists: SharedValues<SurfacesKey, Arc<SurfaceLists>>,
    materials: SharedValues<SurfacesKey, Arc<Materials>>,
    ray_tree: SharedValues<RayTreeKey, RayTriangles>,
    hit_surfaces: SharedValues<SurfacesKey, HitSurfaces>,
    lens_rays: SharedValues<LensKey, Arc<Buffer>>,
    lattice: SharedValues<(), TexelList>,
}

type LensKey = (Lens, [u32; 2]);

/// The alpha texture of a material, and its cutoff.
type Cutout = (Option<TextureLookup>, f64);

#[derive(Clone, PartialEq)]
struct TexturesKey {
    is_textured: bool,
    uses: Vec<TextureUses>,
    textures: SameValues<Texture>,
}

#[derive(Clone, PartialEq)]
struct SurfacesKey {
    space: LocalSpace,
    is_smooth: bool,
    materials: Vec<Material>,
    meshes: HeldMeshes,
    textures: TexturesKey,
}

#[derive(PartialEq)]
struct RayTreeKey {
    tracer: Option<Tracer>,
    space: LocalSpace,
    geometry: SameGeometry,
    /// The alpha texture of each material, and the textures; only if there are cut-outs.
    cutouts: Option<(Vec<Cutout>, TexturesKey)>,
}

/// Equal if all are the same objects: values that cannot change as long as they are kept. Other objects count as different,
/// without comparing their values.
#[derive(Clone)]
struct SameValues<T>(Vec<Shared<T>>);

impl<T> PartialEq for SameValues<T> {
    fn eq(&self, other: &Self) -> bool {
        let pairs = self.0.iter().zip(&other.0);
        self.0.len() == other.0.len() && pairs.into_iter().all(|(a, b)| a.ptr_eq(b))
    }
}

/// Equal if the same mesh objects are at the same places, in the same order, and are shared alike.
#[derive(PartialEq)]
struct GeometryKey {
    instances: Vec<SameInstance>,
    are_shared: Vec<bool>,
}

struct SameInstance(Instance);

impl PartialEq for SameInstance {
    fn eq(&self, other: &Self) -> bool {
        self.0.is_same(&other.0)
    }
}

/// Equal if the device holds the same meshes. The places of the meshes that instances share do not matter.
#[derive(Clone)]
struct HeldMeshes(Arc<Geometry>);

impl PartialEq for HeldMeshes {
    fn eq(&self, other: &Self) -> bool {
        self.0.holds_the_same(&other.0)
    }
}

/// Equal if all meshes are the same and are at the same places.
struct SameGeometry(Arc<Geometry>);

impl PartialEq for SameGeometry {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl SceneResources {
    /// Copies to the device what has changed since the previous frame and no other renderer has there. Returns whether anything has changed.
    pub fn update(&mut self, context: &Context, scenes: &Arc<Mutex<SharedScenes>>) -> Result<bool> {
        let shared = &mut LockedLate::new(scenes);
        let is_changed = self.update_parts(context, shared)?;
        // Other renderers may wait for what is new. Without others, it is shared at the end of the frame.
        if shared.is_locked() && Arc::strong_count(scenes) > 1 {
            context.submit(|_| Ok(()))?;
            self.share(shared.lock());
        }
        Ok(is_changed)
    }

    /// Lets other renderers find what is here. It must have been copied to the device.
    pub fn share(&self, scenes: &mut SharedScenes) {
        self.textures.share(&mut scenes.textures);
        self.geometry.share(&mut scenes.geometry);
        self.surface_lists.share(&mut scenes.surface_lists);
        self.materials.share(&mut scenes.materials);
        self.ray_tree.share(&mut scenes.ray_tree);
        self.hit_surfaces.share(&mut scenes.hit_surfaces);
        self.lens_rays.share(&mut scenes.lens_rays);
        self.lattice.share(&mut scenes.lattice);
    }

    fn update_parts(
        &mut self,
        context: &Context,
        shared: &mut LockedLate<SharedScenes>,
    ) -> Result<bool> {
        let Context {
            commands,
            scene,
            plan,
            space,
            ..
        } = *context;
        let instances = scene.meshes.iter().cloned().map(SameInstance);
        let geometry_key = GeometryKey {
            instances: instances.collect(),
            are_shared: are_shared(scene),
        };
        let before = self.geometry.get().cloned();
        self.geometry.drop_unless(&geometry_key);
        let geometry = || Ok(Geometry::of(scene, before.as_deref()).into());
        let (geometry, _) =
            self.geometry
                .get_or_make(geometry_key, shared, |all| &mut all.geometry, geometry)?;
        let geometry = geometry.clone();
        let textures_key = TexturesKey {
            is_textured: plan.reads_texcoords(),
            uses: uses_of(scene),
            textures: SameValues(scene.textures.clone()),
        };
        let surfaces_key = SurfacesKey {
            space: *space,
            is_smooth: plan.is_smooth,
            materials: scene.materials.clone(),
            meshes: HeldMeshes(geometry.clone()),
            textures: textures_key.clone(),
        };
        let tracer = plan.tracer;
        let ray_tree_key = RayTreeKey {
            tracer,
            space: *space,
            geometry: SameGeometry(geometry.clone()),
            cutouts: plan.has_cutouts.then(|| {
                let materials = scene.materials.iter();
                let alpha =
                    materials.map(|material| (material.alpha_texture, material.alpha_cutoff));
                let alpha = alpha.collect();
                (alpha, textures_key.clone())
            }),
        };
        self.textures.drop_unless(&textures_key);
        self.surfaces = None;
        self.surface_lists.drop_unless(&surfaces_key);
        self.ray_tree.drop_unless(&ray_tree_key);
        self.hit_surfaces.drop_unless(&surfaces_key);
        self.materials.drop_unless(&surfaces_key);
        if tracer.is_none() {
            self.ray_tree.clear();
            self.mesh_trees = MeshTrees::default();
        }
        if !plan.shades_hits() {
            self.hit_surfaces.clear();
        }
        let lens_key = (scene.camera.lens, plan.resolution_px);
        self.lens_rays.drop_unless(&lens_key);

        let upload = || {
            Ok(Arc::new(match plan.reads_texcoords() {
                true => Textures::upload(commands, scene)?,
                false => Textures::default(),
            }))
        };
        let (textures, _) =
            self.textures
                .get_or_make(textures_key, shared, |all| &mut all.textures, upload)?;
        let (instances, are_moved) = match tracer {
            Some(tracer) => {
                let trees = &mut self.mesh_trees;
                let tree =
                    || RayTriangles::of(commands, scene, &geometry, space, textures, tracer, trees);
                let (tree, is_new) = self.ray_tree.get_or_make(
                    ray_tree_key,
                    shared,
                    |all| &mut all.ray_tree,
                    tree,
                )?;
                (
                    tree.instances.clone(),
                    is_new && !geometry.shared.is_empty(),
                )
            }
            // Without rays no mesh is shared.
            None => {
                let none = Instances::upload(commands, &geometry, space, &[], 0)?;
                (Arc::new(none), false)
            }
        };
        let materials = match plan.needs_materials() {
            true => {
                let upload = || Ok(Materials::upload(commands, scene, &geometry, textures)?.into());
                let (materials, _) = self.materials.get_or_make(
                    surfaces_key.clone(),
                    shared,
                    |all| &mut all.materials,
                    upload,
                )?;
                Some(materials)
            }
            false => {
                self.materials.clear();
                None
            }
        };
        let upload = || {
            SurfaceLists::upload(commands, scene, plan, space, textures, materials, &geometry)
                .map(Arc::new)
        };
        let (lists, is_new) = self.surface_lists.get_or_make(
            surfaces_key.clone(),
            shared,
            |all| &mut all.surface_lists,
            upload,
        )?;
        self.surfaces = Some(Surfaces {
            lists: lists.clone(),
            instances,
        });
        match plan.has_final_gather() {
            true => {
                let upload = || final_gather::upload_lattice(commands);
                self.lattice
                    .get_or_make((), shared, |all| &mut all.lattice, upload)?;
            }
            false => self.lattice.clear(),
        }
        let mut is_changed = is_new || are_moved;
        self.generation += u64::from(is_changed);
        if plan.has_distortion {
            let lens = || primary_rays::upload_lens(commands, &scene.camera);
            let (_, is_new) =
                self.lens_rays
                    .get_or_make(lens_key, shared, |all| &mut all.lens_rays, lens)?;
            is_changed |= is_new;
        }
        if plan.shades_hits() {
            let materials = materials.ok_or_else(|| {
                Error::internal("the materials of what rays hit are not on the device")
            })?;
            let hits = || HitSurfaces::upload(commands, &geometry, textures, materials);
            self.hit_surfaces.get_or_make(
                surfaces_key,
                shared,
                |all| &mut all.hit_surfaces,
                hits,
            )?;
        }
        Ok(is_changed)
    }

    pub fn surfaces(&self) -> Result<&Surfaces> {
        let surfaces = self.surfaces.as_ref();
        surfaces.ok_or_else(|| Error::internal("the surfaces are not on the device"))
    }

    /// The geometry of the last frame.
    pub fn geometry(&self) -> Option<&Arc<Geometry>> {
        self.geometry.get()
    }

    pub fn ray_tree(&self) -> Result<&RayTriangles> {
        let tree = self.ray_tree.get();
        tree.ok_or_else(|| Error::internal("there are no triangles for rays"))
    }

    /// The triangles for rays, with their shading.
    pub fn hit_scene(&self) -> Result<HitScene<'_>> {
        let surfaces = self.hit_surfaces.get();
        Ok(HitScene {
            tree: self.ray_tree()?,
            surfaces: surfaces.ok_or_else(|| Error::internal("rays have no surfaces to hit"))?,
        })
    }

    /// The rays of the camera's lens, if it distorts the image.
    pub fn lens_rays(&self) -> Option<&Buffer> {
        self.lens_rays.get().map(Arc::as_ref)
    }

    /// The points that final gathering draws from.
    pub fn lattice(&self) -> Result<&TexelList> {
        let lattice = self.lattice.get();
        lattice.ok_or_else(|| Error::internal("the lattice is not on the device"))
    }
}
