//! Reads metallic-roughness materials.

use std::path::PathBuf;

use image::DynamicImage;

use super::file::GltfFile;
use super::light::LUMEN_PER_WATT;
use super::surface::{self, AlphaMode, TextureInfo};
use crate::import::mesh::{Assets, TextureUse};
use crate::import::texture;
use crate::scene::{Material, MetallicRoughness, SMOOTHEST, Texture, TextureLookup};
use crate::{Error, Result};

/// A material of the file in the scene.
#[derive(Clone, Copy)]
pub(super) enum Converted {
    /// Its index.
    Visible(u32),
    /// All of it is cut out.
    Invisible,
}

/// Where alpha cuts a surface out.
enum Cutout {
    Nowhere,
    Everywhere,
    /// Where the texture is below this value.
    Below(TextureLookup, f64),
}

/// A material that is being converted.
struct Conversion<'c> {
    file: &'c GltfFile,
    material: &'c surface::Material,
    /// Names the material in messages.
    place: String,
}

impl Assets {
    /// Adds a material of a file and its textures. `None`: the default material.
    pub(super) fn add_gltf_material(
        &mut self,
        file: &GltfFile,
        index: Option<usize>,
    ) -> Result<Converted> {
        let default = surface::Material::default();
        let material = index.and_then(|index| file.document.materials.get(index));
        let material = material.unwrap_or(&default);
        let name = match &material.name {
            Some(name) => name.to_owned(),
            None => index.map_or("default".into(), |index| format!("material{index}")),
        };
        let conversion = Conversion {
            file,
            material,
            place: format!("{}: material \"{name}\"", file.path.display()),
        };
        conversion.add_to(self, name)
    }
}

impl Conversion<'_> {
    fn add_to(&self, assets: &mut Assets, name: String) -> Result<Converted> {
        let (file, material) = (self.file, self.material);
        let (cutoff_texture, alpha_cutoff) = match self.cutout(assets)? {
            Cutout::Everywhere => return Ok(Converted::Invisible),
            Cutout::Nowhere => (None, 0.5),
            Cutout::Below(lookup, cutoff) => (Some(lookup), cutoff),
        };
        let [r, g, b, _] = material.base_color;
        let kd_texture = self.lookup(assets, material.base_texture, TextureUse::Reflectance)?;
        let scale = material.normal_texture.map_or(1.0, |info| info.scale);
        let use_of = TextureUse::Normals(scale.to_bits(), false);
        let normal_texture = self.lookup(assets, material.normal_texture, use_of)?;
        let sets = material.texcoord_sets();
        let with_set = |info: Option<TextureInfo>, left_out: &str| {
            if info.is_some_and(|info| !sets.contains(&info.texcoord_set)) {
                file.leave_out(left_out);
                return None;
            }
            info
        };
        let of_facets = with_set(
            material.metallic_roughness_texture,
            "a metallicRoughnessTexture with a third set of texture coordinates",
        );
        let metallic_roughness_texture = self.lookup(assets, of_facets, TextureUse::Factors)?;
        let of_emission = with_set(
            material.emissive_texture,
            "an emissiveTexture with a third set of texture coordinates",
        );
        let emission_texture = self.lookup(assets, of_emission, TextureUse::Reflectance)?;
        let microfacets = MetallicRoughness {
            metallic: material.metallic.clamp(0.0, 1.0),
            roughness: material.roughness.clamp(SMOOTHEST, 1.0),
            ior: material.ior.clamp(1.0, 10.0),
            specular: material.specular.clamp(0.0, 1.0),
        };
        if material.roughness < SMOOTHEST {
            file.leave_out("a roughness below 0.03: the surface is as rough as that");
        }
        let material = Material {
            microfacets: Some(microfacets),
            kd_texture,
            metallic_roughness_texture,
            emission_w_sr_m2: material.emission.map(|nits| nits / LUMEN_PER_WATT),
            emission_texture,
            is_one_sided: !material.is_double_sided,
            normal_texture,
            alpha_texture: cutoff_texture,
            alpha_cutoff,
            ..Material::lambert(name, [r, g, b])
        };
        let index = assets.push_material(material, self.place.clone());
        Ok(Converted::Visible(index))
    }

    /// Where alpha, which is that of the factor times that of the texture, is below the cutoff.
    fn cutout(&self, assets: &mut Assets) -> Result<Cutout> {
        let material = self.material;
        let factor = material.base_color[3];
        match material.alpha_mode {
            AlphaMode::Opaque => return Ok(Cutout::Nowhere),
            AlphaMode::Blend => {
                if factor != 1.0 || !self.has_opaque_texture()? {
                    self.file.leave_out("alphaMode BLEND: surfaces are opaque");
                }
                return Ok(Cutout::Nowhere);
            }
            AlphaMode::Mask => {}
        }
        if material.alpha_cutoff <= 0.0 {
            return Ok(Cutout::Nowhere);
        }
        // What the texture's own alpha is compared with.
        let cutoff = match factor > 0.0 {
            true => material.alpha_cutoff / factor,
            false => f64::INFINITY,
        };
        let use_of = TextureUse::Alpha(cutoff.to_bits());
        let lookup = match self.has_image(material.base_texture) && cutoff <= 1.0 {
            true => self.lookup(assets, material.base_texture, use_of)?,
            false => None,
        };
        let Some(lookup) = lookup else {
            // Without a texture its alpha is 1. A texture that cuts nothing out is not kept.
            return Ok(match cutoff > 1.0 {
                true => Cutout::Everywhere,
                false => Cutout::Nowhere,
            });
        };
        let texels = &assets.textures[lookup.texture].colors().texels;
        let mut alpha = texels.reflectances().map(|[alpha, ..]| f64::from(alpha));
        Ok(match alpha.all(|alpha| alpha < cutoff) {
            true => Cutout::Everywhere,
            false => Cutout::Below(lookup, cutoff),
        })
    }

    fn has_opaque_texture(&self) -> Result<bool> {
        let Some((index, _)) = self.image(self.material.base_texture)? else {
            return Ok(true);
        };
        let image = self.decoded(index)?;
        Ok(!image.color().has_alpha()
            || texture::alpha_channel(image).iter().all(|&a| a == u8::MAX))
    }

    fn has_image(&self, info: Option<TextureInfo>) -> bool {
        matches!(self.image(info), Ok(Some(_)))
    }

    /// The image and the sampler of a texture; `None` if it has no image.
    fn image(&self, info: Option<TextureInfo>) -> Result<Option<(usize, surface::Sampler)>> {
        let Some(info) = info else {
            return Ok(None);
        };
        let file = self.file;
        let document = &file.document;
        let user = "a texture of a material";
        let of_file = file.find(&document.textures, info.texture, "texture", user)?;
        let user = format!("texture {}", info.texture);
        let sampler = match of_file.sampler {
            Some(sampler) => *file.find(&document.samplers, sampler, "sampler", &user)?,
            None => surface::Sampler::default(),
        };
        match (of_file.image, of_file.other_kind) {
            (Some(image), _) => {
                file.find(&document.images, image, "image", &user)?;
                Ok(Some((image, sampler)))
            }
            (None, Some(extension)) => {
                let problem = format!(
                    "texture {} has only an image of {extension}, which camlux does not read",
                    info.texture
                );
                let hint = "export its images as PNG, JPEG or WebP";
                Err(Error::scene(&self.place, problem, hint))
            }
            (None, None) => Ok(None),
        }
    }

    /// Looks a texture up; `None` for alpha that cuts nothing out.
    fn lookup(
        &self,
        assets: &mut Assets,
        info: Option<TextureInfo>,
        use_of: TextureUse,
    ) -> Result<Option<TextureLookup>> {
        let Some(info) = info else {
            return Ok(None);
        };
        let Some((image, sampler)) = self.image(Some(info))? else {
            self.file.leave_out("a texture without an image");
            return Ok(None);
        };
        let name = PathBuf::from(format!("{}#image{image}", self.file.path.display()));
        let load = |use_of: &TextureUse| self.load(image, name.display().to_string(), use_of);
        let texture = assets.texture(&name, use_of, load)?;
        let sets = self.material.texcoord_sets();
        let place = sets.iter().position(|&set| set == info.texcoord_set);
        let [[a, b, c], [d, e, f]] = info.transform;
        Ok(texture.map(|texture| TextureLookup {
            texture,
            texcoord_set: place.unwrap_or_default() as u32,
            // From v downwards to v upwards, on both sides.
            transform: [[a, -b, b + c], [-d, e, 1.0 - e - f]].map(|row| row.map(|x| x + 0.0)),
            wrap: sampler.wrap,
            filter: sampler.filter,
        }))
    }

    fn load(&self, image: usize, name: String, use_of: &TextureUse) -> Result<Option<Texture>> {
        let decoded = self.decoded(image)?;
        Ok(match use_of {
            TextureUse::Reflectance | TextureUse::Factor => Some(texture::of_image(name, decoded)),
            TextureUse::Factors => Some(texture::of_image(name, decoded).into_linear()),
            TextureUse::Normals(strength, _) => {
                let texture = texture::of_image(name, decoded);
                let strength = f64::from_bits(*strength);
                Some(texture::as_normals(texture, strength, false))
            }
            TextureUse::Alpha(cutoff) => {
                let size_px = [decoded.width(), decoded.height()];
                let values = texture::alpha_channel(decoded);
                texture::alpha_texture(name, size_px, values, f64::from_bits(*cutoff))
            }
        })
    }

    fn decoded(&self, index: usize) -> Result<DynamicImage> {
        let image = self
            .file
            .find(&self.file.document.images, index, "image", "a texture")?;
        texture::decode(&self.file.image(index, image)?).map_err(|problem| {
            let problem = format!("cannot read image {index}: {problem}");
            Error::scene(&self.place, problem, texture::GIVE_IMAGE)
        })
    }
}
