//! From a material of an MTL file to a material of the scene.

use super::map::Map;
use super::mtl::LibraryMaterial;
use crate::import::mesh::{Assets, TextureUse};
use crate::import::texture::{self, NormalMap};
use crate::scene::{Material, Texture, TextureLookup};
use crate::{Error, Result};

impl Assets {
    /// The material, with its textures loaded.
    pub(super) fn material_from(&mut self, entry: &LibraryMaterial) -> Result<Material> {
        let incomplete = |problem: &str, hint: &str| {
            let problem = format!("material \"{}\" {problem}", entry.name);
            Error::scene(&entry.at, problem, hint)
        };
        let kd_texture = self.lookup(entry.kd_map.as_ref(), TextureUse::Reflectance)?;
        let ks_texture = self.lookup(entry.ks_map.as_ref(), TextureUse::Reflectance)?;
        let shininess_texture = self.lookup(entry.shininess_map.as_ref(), TextureUse::Factor)?;
        let alpha = TextureUse::Alpha(0.5_f64.to_bits());
        let alpha_texture = self.lookup(entry.alpha_map.as_ref(), alpha)?;
        let normals = entry.normal_map.as_ref();
        let normal_use = normals.map_or(TextureUse::Factor, |map| {
            TextureUse::Normals(map.strength.to_bits(), map.may_be_heights)
        });
        let normal_texture = self.lookup(normals, normal_use)?;

        let kd = entry.kd.or(kd_texture.map(|_| [1.0; 3]));
        let kd = kd.ok_or_else(|| {
            incomplete(
                "has neither Kd nor map_Kd",
                "add a line such as Kd 0.8 0.8 0.8",
            )
        })?;
        let ks = entry.ks.or(ks_texture.map(|_| [1.0; 3]));
        let mut material = Material {
            ks: ks.unwrap_or_default(),
            kd_texture,
            normal_texture,
            alpha_texture,
            ..Material::lambert(&entry.name, kd)
        };
        if material.is_specular() {
            material.ks_texture = ks_texture;
            material.shininess_texture = shininess_texture;
        }
        match entry.shininess {
            Some(shininess) => material.shininess = shininess,
            None if material.is_specular() => {
                return Err(incomplete("has Ks without Ns", "add a line such as Ns 20"));
            }
            None => {}
        }
        Ok(material)
    }

    /// The texture of a map; `None` if there is none, or if it cuts nothing out.
    fn lookup(&mut self, map: Option<&Map>, use_of: TextureUse) -> Result<Option<TextureLookup>> {
        let Some(map) = map else {
            return Ok(None);
        };
        let load = |use_of: &TextureUse| match use_of {
            TextureUse::Normals(..) => {
                let normals = NormalMap {
                    strength: map.strength,
                    may_be_heights: map.may_be_heights,
                    named_at: map.named_at.clone(),
                };
                texture::load_normals(&map.file, &normals).map(Some)
            }
            TextureUse::Alpha(_) => texture::load_alpha(&map.file, &map.named_at),
            TextureUse::Factor => {
                let texture = texture::load(&map.file, &map.named_at);
                texture.map(Texture::into_brightness).map(Some)
            }
            TextureUse::Reflectance => texture::load(&map.file, &map.named_at).map(Some),
        };
        let texture = self.texture(&map.file, use_of, load)?;
        Ok(texture.map(|texture| map.lookup(texture)))
    }
}
