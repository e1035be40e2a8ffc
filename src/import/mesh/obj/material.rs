//! From a material of an MTL file to a material of the scene.

use std::path::PathBuf;

use super::map::Map;
use super::mtl::LibraryMaterial;
use crate::import::mesh::{Assets, TextureUse};
use crate::import::texture::{self, NormalMap};
use crate::scene::{
    Bands, Encoding, Material, MetallicRoughness, SMOOTHEST, Texels, Texture, TextureLookup,
};
use crate::{Error, Result};

impl Assets {
    /// The material, with its textures loaded.
    pub(super) fn material_from(&mut self, entry: &LibraryMaterial) -> Result<Material> {
        let incomplete = |problem: &str, hint: &str| {
            let problem = format!("material \"{}\" {problem}", entry.name);
            Error::scene(&entry.at, problem, hint)
        };
        let kd_texture = self.lookup(entry.kd_map.as_deref(), TextureUse::Reflectance)?;
        let ks_texture = self.lookup(entry.ks_map.as_deref(), TextureUse::Reflectance)?;
        let shininess_texture = self.lookup(entry.shininess_map.as_deref(), TextureUse::Factor)?;
        let alpha = TextureUse::Alpha(0.5_f64.to_bits());
        let alpha_texture = self.lookup(entry.alpha_map.as_deref(), alpha)?;
        let normals = entry.normal_map.as_deref();
        let normal_use = normals.map_or(TextureUse::Factor, |map| {
            TextureUse::Normals(map.strength.to_bits(), map.may_be_heights)
        });
        let normal_texture = self.lookup(normals, normal_use)?;
        let emission_map = entry.emission_map.as_deref();
        let emission_texture = self.lookup(emission_map, TextureUse::Reflectance)?;
        // Exporters write the Ke of 0 that their materials have without the map.
        let is_some = |emission: &Bands| emission_texture.is_none() || *emission != [0.0; 3];
        let emission = entry.emission.filter(is_some);
        let emission_w_sr_m2 = emission.or(emission_texture.map(|_| [1.0; 3]));
        let emission_w_sr_m2 = emission_w_sr_m2.unwrap_or_default();

        let kd = entry.kd.or(kd_texture.map(|_| [1.0; 3]));
        let kd = kd.ok_or_else(|| {
            incomplete(
                "has neither Kd nor map_Kd",
                "add a line such as Kd 0.8 0.8 0.8",
            )
        })?;
        if entry.roughness.is_some() || entry.roughness_map.is_some() {
            let facets = MetallicRoughness {
                metallic: entry
                    .metallic
                    .unwrap_or(f64::from(u8::from(entry.metallic_map.is_some()))),
                roughness: entry.roughness.unwrap_or(1.0).max(SMOOTHEST),
                ..MetallicRoughness::DEFAULT
            };
            return Ok(Material {
                microfacets: Some(facets),
                metallic_roughness_texture: self.metallic_roughness(entry)?,
                kd_texture,
                emission_w_sr_m2,
                emission_texture,
                normal_texture,
                alpha_texture,
                ..Material::lambert(&entry.name, kd)
            });
        }
        let ks = entry.ks.or(ks_texture.map(|_| [1.0; 3]));
        let mut material = Material {
            ks: ks.unwrap_or_default(),
            kd_texture,
            emission_w_sr_m2,
            emission_texture,
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

    /// One texture of `map_Pr` and `map_Pm`: roughness in green, metallic in blue.
    fn metallic_roughness(&mut self, entry: &LibraryMaterial) -> Result<Option<TextureLookup>> {
        let maps = [
            entry.roughness_map.as_deref(),
            entry.metallic_map.as_deref(),
        ];
        let Some(first) = maps.into_iter().flatten().next() else {
            return Ok(None);
        };
        let differ = |problem: &str, hint: &str| {
            let problem = format!("map_Pr and map_Pm of material \"{}\" {problem}", entry.name);
            Error::scene(&entry.at, problem, hint)
        };
        if maps
            .iter()
            .flatten()
            .any(|map| map.lookup(0) != first.lookup(0))
        {
            return Err(differ(
                "have different options",
                "give both the same -s, -o and -clamp",
            ));
        }
        let load = |_: &TextureUse| {
            let load = |map: &Map| texture::load(&map.file, &map.named_at);
            let [roughness, metallic] =
                maps.map(|map| map.map(|map| load(map).map(Texture::into_brightness)));
            let (roughness, metallic) = (roughness.transpose()?, metallic.transpose()?);
            let sizes = [&roughness, &metallic].map(|map| map.as_ref().map(|map| map.size_px));
            let size_px = sizes[0].or(sizes[1]).unwrap_or_default();
            if sizes.iter().flatten().any(|size| *size != size_px) {
                let hint = "scale one of the images to the size of the other";
                return Err(differ("are images of different sizes", hint));
            }
            let count = size_px[0] as usize * size_px[1] as usize;
            let values = |map: &Option<Texture>| match map {
                Some(map) => Vec::from_iter(map.texels.reflectances().map(|[value, ..]| value)),
                None => vec![1.0; count],
            };
            let texels = values(&roughness).into_iter().zip(values(&metallic));
            let texels = texels.map(|(roughness, metallic)| [0.0, roughness, metallic]);
            let texels = texels.map(|texel| texel.map(|value| (value * 65535.0).round() as u16));
            let of_first = roughness.or(metallic).map(|texture| Texture {
                texels: Texels::U16(texels.collect(), Encoding::Linear),
                ..texture
            });
            Ok(of_first)
        };
        let files = maps
            .into_iter()
            .flatten()
            .map(|map| map.file.display().to_string());
        let both = PathBuf::from(Vec::from_iter(files).join(" and "));
        let texture = self.texture(&both, TextureUse::Factors, load)?;
        Ok(texture.map(|texture| first.lookup(texture)))
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
            TextureUse::Reflectance | TextureUse::Factors => {
                texture::load(&map.file, &map.named_at).map(Some)
            }
        };
        let texture = self.texture(&map.file, use_of, load)?;
        Ok(texture.map(|texture| map.lookup(texture)))
    }
}
