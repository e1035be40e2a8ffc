//! The meshes that a scene file names, with their materials and textures.

mod colors;
mod corners;
pub(super) mod gltf;
mod obj;
mod ply;
mod polygons;
mod split;
mod stl;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DMat4, DVec3};

use super::lines::resolved;
use super::unused::Unused;
use crate::scene::{
    Instance, Light, Material, Mesh, MeshFile, MeshOptions, Shared, Texture, TextureSource,
};
use crate::{Error, Result};

/// A `[[mesh]]` of the scene file.
#[derive(Clone)]
pub(super) struct MeshRequest {
    /// As written in the scene file.
    pub name: String,
    pub path: PathBuf,
    /// The line that names it.
    pub named_at: String,
    pub transform: Transform,
    /// Replaces every material of the file.
    pub material_override: Option<u32>,
    pub flat: bool,
    /// Whether the scene file places the same mesh again elsewhere.
    pub is_repeated: bool,
    /// Takes the place of `transform`, `material_override` and `flat`.
    pub as_is: Option<AsIs>,
}

/// How a mesh that stays as its file has it is placed: [`Scene::save`](crate::Scene::save) writes such meshes.
#[derive(Clone)]
pub(super) struct AsIs {
    pub to_world: DAffine3,
    /// Those that the faces of the file number.
    pub materials: Vec<u32>,
}

/// Identifies a mesh: the file, the index of the mesh in it (for glTF), and the options in the scene file.
pub(super) type MeshKey = (PathBuf, usize, bool, Option<u32>);

impl MeshRequest {
    pub fn key(&self, index: usize) -> MeshKey {
        let path = resolved(&self.path);
        (path, index, self.flat, self.material_override)
    }

    /// The material of a mesh whose format has none.
    pub fn only_material(&self) -> Result<u32> {
        self.material_override.ok_or_else(|| {
            let problem = format!("{} has no materials", self.path.display());
            let hint = "add material = \"NAME\" to the [[mesh]], and a [material.NAME] table to the scene file";
            Error::scene(&self.named_at, problem, hint)
        })
    }
}

/// Applies scale, then rotation, then translation.
#[derive(Clone, Copy)]
pub(super) struct Transform {
    pub scale: f64,
    pub rotation: DMat3,
    pub translation_m: DVec3,
}

impl Transform {
    pub const IDENTITY: Transform = Transform {
        scale: 1.0,
        rotation: DMat3::IDENTITY,
        translation_m: DVec3::ZERO,
    };

    pub fn matrix(&self) -> DMat4 {
        DMat4::from_mat3_translation(self.rotation * self.scale, self.translation_m)
    }
}

#[derive(Default)]
pub(super) struct Assets {
    pub meshes: Vec<Instance>,
    pub materials: Vec<Material>,
    /// File and line of each material.
    pub material_places: Vec<String>,
    pub textures: Vec<TextureSource>,
    /// Features of the files that are not modelled, each listed once.
    pub left_out: Vec<String>,
    /// Meshes that are placed several times, in their own space.
    pub shared_meshes: HashMap<MeshKey, Shared<Mesh>>,
    /// Meshes that stay as their files have them, by file and materials.
    as_is_meshes: HashMap<(PathBuf, Vec<u32>), Shared<Mesh>>,
    /// `None`: an alpha texture that cuts nothing out.
    texture_of_file: HashMap<(PathBuf, TextureUse), Option<usize>>,
}

/// How a texture file is used.
#[derive(PartialEq, Eq, Hash)]
pub(super) enum TextureUse {
    Reflectance,
    /// The bits of the strength, and whether the values may be heights.
    Normals(u64, bool),
    /// The bits of the cutoff: a texture that nothing of is below it is not kept.
    Alpha(u64),
    /// A grey factor, such as of the shininess.
    Factor,
    /// The channels as they are, each a factor.
    Factors,
}

impl MeshFile {
    /// Reads a glTF, OBJ, PLY or STL file, with its materials and textures.
    ///
    /// # Errors
    /// [`Error::Scene`] with file and line for what cannot be read, and for triangles without a material.
    pub fn load(path: &Path, options: MeshOptions) -> Result<MeshFile> {
        let at = path.display().to_string();
        let MeshOptions {
            scale,
            flat,
            material,
            first_material,
        } = options;
        if !(scale > 0.0 && scale.is_finite()) {
            let problem = format!("scale is {scale}");
            return Err(Error::scene(at, problem, "give a number above 0"));
        }
        let request = MeshRequest {
            name: at.clone(),
            path: path.to_owned(),
            named_at: at,
            transform: Transform {
                scale,
                ..Transform::IDENTITY
            },
            material_override: material,
            flat,
            is_repeated: false,
            as_is: None,
        };
        // Stand for the materials before the first one, so that the file's own are counted from there.
        let before = vec![Material::lambert("", [0.0; 3]); first_material as usize];
        let mut assets = Assets {
            materials: before,
            ..Assets::default()
        };
        let loaded = assets.load_mesh(request).map_err(|error| match error {
            Error::Scene { at, problem, hint } => {
                let hint = match hint.contains("[[mesh]]") {
                    true => "give material, the index of one of the scene's materials".into(),
                    false => hint,
                };
                Error::scene(at, problem, hint)
            }
            other => other,
        });
        Ok(MeshFile {
            lights: loaded?,
            meshes: assets.meshes,
            materials: assets.materials.split_off(first_material as usize),
            textures: assets.textures.iter().map(|t| t.colors().clone()).collect(),
            left_out: assets.left_out,
        })
    }
}

fn unknown_format(request: &MeshRequest) -> Error {
    Error::scene(
        &request.named_at,
        format!("{} is in no format that camlux reads", request.name),
        "export the mesh as .gltf, .glb, .obj, .ply or .stl",
    )
}

impl Assets {
    /// Loads a file as one mesh (glTF: one per node), with the materials and textures that its faces use. Returns its lights.
    pub fn load_mesh(&mut self, request: MeshRequest) -> Result<Vec<Light>> {
        if let Some(as_is) = &request.as_is {
            return self.load_as_is(&request, as_is);
        }
        let extension = request.path.extension().unwrap_or_default();
        let load = match extension.to_ascii_lowercase().to_str() {
            Some("glb" | "gltf") => return self.load_gltf(&request),
            Some("obj") => Assets::load_obj,
            Some("ply") => Assets::load_ply,
            Some("stl") => Assets::load_stl,
            _ => return Err(unknown_format(&request)),
        };
        if !request.is_repeated {
            let mesh = load(self, &request)?;
            self.meshes.push(mesh.into());
            return Ok(Vec::new());
        }
        let key = request.key(0);
        let mesh = match self.shared_meshes.get(&key) {
            Some(mesh) => mesh.clone(),
            None => {
                let in_own_space = MeshRequest {
                    transform: Transform::IDENTITY,
                    ..request.clone()
                };
                Shared::from(load(self, &in_own_space)?)
            }
        };
        self.shared_meshes.insert(key, mesh.clone());
        self.meshes.push(Instance {
            name: request.name,
            mesh,
            to_world: DAffine3::from_mat4(request.transform.matrix()),
        });
        Ok(Vec::new())
    }

    fn load_as_is(&mut self, request: &MeshRequest, as_is: &AsIs) -> Result<Vec<Light>> {
        let key = (resolved(&request.path), as_is.materials.clone());
        let mesh = match self.as_is_meshes.get(&key) {
            Some(mesh) => mesh.clone(),
            None => Shared::from(self.load_ply(request)?),
        };
        self.as_is_meshes.insert(key, mesh.clone());
        self.meshes.push(Instance {
            name: request.name.clone(),
            mesh,
            to_world: as_is.to_world,
        });
        Ok(Vec::new())
    }

    /// Warns once of what a file holds and camlux does not use.
    pub fn report(&mut self, file: &Path, unused: &Unused) {
        let warning = unused.warning(file);
        let is_new = |warning: &String| !self.left_out.contains(warning);
        self.left_out.extend(warning.filter(is_new));
    }

    /// Adds a material that was read at this place. Returns its index.
    pub fn push_material(&mut self, material: Material, at: String) -> u32 {
        let index = self.materials.len() as u32;
        self.materials.push(material);
        self.material_places.push(at);
        index
    }

    /// The index of a texture. A file that several materials use in the same way is loaded once.
    pub fn texture(
        &mut self,
        file: &Path,
        use_of: TextureUse,
        load: impl FnOnce(&TextureUse) -> Result<Option<Texture>>,
    ) -> Result<Option<usize>> {
        let key = (resolved(file), use_of);
        if let Some(&index) = self.texture_of_file.get(&key) {
            return Ok(index);
        }
        let texture = load(&key.1)?;
        let index = texture.as_ref().map(|_| self.textures.len());
        self.textures
            .extend(texture.map(|texture| Shared::from(texture).into()));
        self.texture_of_file.insert(key, index);
        Ok(index)
    }
}
