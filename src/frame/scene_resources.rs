//! The surfaces of a scene on the device. Frames share them until a mesh, a material or a texture changes.

use std::sync::Arc;

use super::cache::Cached;
use crate::{
    Error, LocalSpace, Result, Tracer,
    geometry::{Geometry, are_shared},
    passes::{
        Context, final_gather,
        hits::HitSurfaces,
        instances::Instances,
        materials::Materials,
        primary_rays,
        rays::RayTriangles,
        surface::Surfaces,
        textures::{TextureUses, Textures, uses_of},
    },
    ray_tree::MeshTrees,
    scene::{Instance, Lens, Material, Shared, Texture, TextureLookup},
    vulkan::{Buffer, TexelList},
};

/// Surfaces as the passes see them, in parts that change independently.
#[derive(Default)]
pub(crate) struct SceneResources {
    textures: Cached<TexturesKey, Arc<Textures>>,
    geometry: Cached<GeometryKey, Arc<Geometry>>,
    surfaces: Cached<SurfacesKey, Surfaces>,
    /// Only if kernels read it.
    materials: Cached<SurfacesKey, Arc<Materials>>,
    /// Only if something casts rays.
    ray_tree: Cached<RayTreeKey, RayTriangles>,
    mesh_trees: MeshTrees,
    /// Only if what the rays hit is shaded.
    hit_surfaces: Cached<SurfacesKey, HitSurfaces>,
    /// Only if the camera's lens distorts the image.
    lens_rays: Cached<(Lens, [u32; 2]), Arc<Buffer>>,
    /// The points that final gathering draws from; only if it does.
    lattice: Option<TexelList>,
    /// Generation of the surfaces. Another number means other surfaces.
    pub generation: u64,
}

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
    /// Copies to the device what has changed since the previous frame. Returns whether anything has.
    pub fn update(&mut self, context: &Context) -> Result<bool> {
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
        let (geometry, _) = self.geometry.get_or_make(geometry_key, geometry)?;
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
        self.surfaces.drop_unless(&surfaces_key);
        self.ray_tree.drop_unless(&ray_tree_key);
        self.hit_surfaces.drop_unless(&surfaces_key);
        self.materials.drop_unless(&surfaces_key);
        if tracer.is_none() {
            self.ray_tree.take();
            self.mesh_trees = MeshTrees::default();
        }
        if !plan.shades_hits() {
            self.hit_surfaces.take();
        }
        let lens_key = (scene.camera.lens, plan.resolution_px);
        self.lens_rays.drop_unless(&lens_key);

        let (textures, _) = self.textures.get_or_make(textures_key, || {
            Ok(Arc::new(match plan.reads_texcoords() {
                true => Textures::upload(commands, scene)?,
                false => Textures::default(),
            }))
        })?;
        let (instances, are_moved) = match tracer {
            Some(tracer) => {
                let by = (tracer, &mut self.mesh_trees);
                let tree = || RayTriangles::of(commands, scene, &geometry, space, textures, by);
                let (tree, is_new) = self.ray_tree.get_or_make(ray_tree_key, tree)?;
                (
                    tree.instances.clone(),
                    is_new && !geometry.shared.is_empty(),
                )
            }
            // Without rays no mesh is shared.
            None => {
                let none = Instances::upload(commands, &geometry, space, (&[], 0))?;
                (Arc::new(none), false)
            }
        };
        let materials = match plan.needs_materials() {
            true => {
                let upload = || Ok(Materials::upload(commands, scene, &geometry, textures)?.into());
                Some(&*self.materials.get_or_make(surfaces_key.clone(), upload)?.0)
            }
            false => {
                self.materials.take();
                None
            }
        };
        let (surfaces, is_new) = self.surfaces.get_or_make(surfaces_key.clone(), || {
            let instanced = (&*geometry, &instances);
            let shown = (&*textures, materials);
            Surfaces::upload(commands, scene, plan, space, shown, instanced)
        })?;
        surfaces.instances = instances;
        if !plan.has_final_gather() {
            self.lattice = None;
        } else if self.lattice.is_none() {
            self.lattice = Some(final_gather::upload_lattice(commands)?);
        }
        let mut is_changed = is_new || are_moved;
        self.generation += u64::from(is_changed);
        if plan.has_distortion {
            let lens = || primary_rays::upload_lens(commands, &scene.camera);
            is_changed |= self.lens_rays.get_or_make(lens_key, lens)?.1;
        }
        if plan.shades_hits() {
            let materials = materials.ok_or_else(|| {
                Error::internal("the materials of what rays hit are not on the device")
            })?;
            let hits = || HitSurfaces::upload(commands, &geometry, textures, materials);
            self.hit_surfaces.get_or_make(surfaces_key, hits)?;
        }
        Ok(is_changed)
    }

    pub fn surfaces(&self) -> Result<&Surfaces> {
        let surfaces = self.surfaces.get();
        surfaces.ok_or_else(|| Error::internal("the surfaces are not on the device"))
    }

    pub fn ray_tree(&self) -> Result<&RayTriangles> {
        let tree = self.ray_tree.get();
        tree.ok_or_else(|| Error::internal("there are no triangles for rays"))
    }

    /// The rays of the camera's lens, if it distorts the image.
    pub fn lens_rays(&self) -> Option<&Buffer> {
        self.lens_rays.get().map(Arc::as_ref)
    }

    /// The points that final gathering draws from.
    pub fn lattice(&self) -> Result<&TexelList> {
        let lattice = self.lattice.as_ref();
        lattice.ok_or_else(|| Error::internal("the lattice is not on the device"))
    }

    pub fn hit_surfaces(&self) -> Result<&HitSurfaces> {
        let surfaces = self.hit_surfaces.get();
        surfaces.ok_or_else(|| Error::internal("rays have no surfaces to hit"))
    }
}
