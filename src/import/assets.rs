//! The files that a scene file uses: meshes, their materials, their textures.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DMat4, DVec3};

use super::lines::{place, read_text, resolved};
use super::mtl::{Library, LibraryMaterial};
use super::obj_check::{self, CheckedObj, FaceGroup, Named};
use super::unused::Unused;
use super::{obj, texture};
use crate::keys::did_you_mean;
use crate::scene::{Instance, Light, Material, Mesh, Shared, Texture};
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
}

/// Identifies a mesh: the file, the index of the mesh in it (for glTF), and the options in the scene file.
pub(super) type MeshKey = (PathBuf, usize, bool, Option<u32>);

impl MeshRequest {
    pub fn key(&self, index: usize) -> MeshKey {
        let path = resolved(&self.path);
        (path, index, self.flat, self.material_override)
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

    pub fn place(&self, position: DVec3) -> DVec3 {
        self.rotation * (self.scale * position) + self.translation_m
    }

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
    pub textures: Vec<Texture>,
    /// Features of the files that are not modelled, each listed once.
    pub left_out: Vec<String>,
    /// Meshes that are placed several times, in their own space.
    pub shared_meshes: HashMap<MeshKey, Shared<Mesh>>,
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
}

impl Assets {
    /// Loads a file as one mesh (glTF: one per node), with the materials and textures that its faces use. Returns its lights.
    pub fn load_mesh(&mut self, request: MeshRequest) -> Result<Vec<Light>> {
        let extension = request.path.extension().unwrap_or_default();
        let load = match extension.to_ascii_lowercase().to_str() {
            Some("glb" | "gltf") => return self.load_gltf(&request),
            Some("ply") => Assets::load_ply,
            _ => Assets::load_obj,
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

    fn load_obj(&mut self, request: &MeshRequest) -> Result<Mesh> {
        let file = &request.path;
        let text = read_text(file, &request.named_at, "mesh")?;
        let checked = obj_check::check(&text, file, request.flat)?;
        let material_of_run = match request.material_override {
            Some(material) => vec![material; checked.runs.len()],
            None => self.materials_of_runs(&checked, file)?,
        };
        obj::assemble(&checked, &material_of_run, request)
    }

    fn materials_of_runs(&mut self, checked: &CheckedObj, file: &Path) -> Result<Vec<u32>> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let mut library = Library::default();
        for statement in &checked.libraries {
            library.read(&statement.name, folder, &place(file, statement.line))?;
        }
        let any_texcoords = checked.runs.iter().any(|run| run.form.texcoords);
        let mut index_of_name = HashMap::new();
        let mut materials = Vec::with_capacity(checked.runs.len());
        for run in &checked.runs {
            let name = run.material.map(|index| &checked.materials[index]);
            let name = name.ok_or_else(|| {
                Error::scene(
                    place(file, run.line),
                    "a face has no material",
                    "name one with mtllib and usemtl above it, or give the [[mesh]] a material = \"...\"",
                )
            })?;
            let index = match index_of_name.entry(&name.name) {
                Entry::Occupied(known) => *known.get(),
                Entry::Vacant(new) => *new.insert(self.add_from_library(name, file, &library)?),
            };
            if any_texcoords {
                self.check_texcoords(run, file, index)?;
            }
            materials.push(index);
        }
        Ok(materials)
    }

    /// Refuses a face of a textured material without texture coordinates: it would show one arbitrary texel if other faces have them.
    fn check_texcoords(&self, run: &FaceGroup, file: &Path, material: u32) -> Result<()> {
        let material = &self.materials[material as usize];
        if run.form.texcoords || !material.has_texture() {
            return Ok(());
        }
        Err(Error::scene(
            place(file, run.line),
            format!(
                "a face of the textured material \"{}\" has no texture coordinates",
                material.name
            ),
            "give its corners vt indices, or another material",
        ))
    }

    fn add_from_library(&mut self, name: &Named, file: &Path, library: &Library) -> Result<u32> {
        let entry = library.get(&name.name).ok_or_else(|| {
            let known = library.names();
            let hint = if known.is_empty() {
                "name its MTL file with mtllib, or give the [[mesh]] a material = \"...\"".into()
            } else {
                did_you_mean(&name.name, &known)
            };
            Error::scene(
                place(file, name.line),
                format!("material \"{}\" is in no MTL file", name.name),
                hint,
            )
        })?;
        let material = self.material_from(entry)?;
        Ok(self.push_material(material, entry.places.name.clone()))
    }

    fn material_from(&mut self, entry: &LibraryMaterial) -> Result<Material> {
        let properties = &entry.properties;
        let incomplete = |problem: &str, hint: &str| {
            let problem = format!("material \"{}\" {problem}", properties.name);
            Error::scene(&entry.places.name, problem, hint)
        };
        let texture = properties.diffuse_texture.as_ref();
        let texture = texture.map(|path| entry.folder.join(path));
        let kd_texture = texture.map(|file| {
            let load = |_: &_| texture::load(&file, &entry.places.texture).map(Some);
            self.texture(&file, TextureUse::Reflectance, load)
        });
        let kd_texture = kd_texture.transpose()?.flatten();
        let normals = entry.places.normal_map.as_ref();
        let normal_texture = normals.map(|map| {
            let file = entry.folder.join(&map.path);
            let use_of = TextureUse::Normals(map.strength.to_bits(), map.may_be_heights);
            self.texture(&file, use_of, |_| {
                texture::load_normals(&file, map).map(Some)
            })
        });
        let normal_texture = normal_texture.transpose()?.flatten();
        let alpha = entry.places.alpha_map.as_ref();
        let alpha_texture = alpha.map(|(path, named_at)| {
            let file = entry.folder.join(path);
            let load = |_: &_| texture::load_alpha(&file, named_at);
            self.texture(&file, TextureUse::Alpha(0.5_f64.to_bits()), load)
        });
        let alpha_texture = alpha_texture.transpose()?.flatten();
        let kd = properties.diffuse.or(kd_texture.map(|_| [1.0; 3]));
        let kd = kd.ok_or_else(|| {
            incomplete(
                "has neither Kd nor map_Kd",
                "add a line such as Kd 0.8 0.8 0.8",
            )
        })?;
        let mut material = Material::lambert(&properties.name, kd);
        material.ks = properties.specular.unwrap_or_default();
        material.kd_texture = kd_texture.map(Into::into);
        material.normal_texture = normal_texture.map(Into::into);
        material.alpha_texture = alpha_texture.map(Into::into);
        match properties.shininess {
            Some(shininess) => material.shininess = shininess,
            None if material.is_specular() => {
                return Err(incomplete("has Ks without Ns", "add a line such as Ns 20"));
            }
            None => {}
        }
        Ok(material)
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
        self.textures.extend(texture);
        self.texture_of_file.insert(key, index);
        Ok(index)
    }
}
