//! Converts metallic-roughness materials to modified Phong.

use std::path::PathBuf;

use gltf::material::AlphaMode;
use gltf::texture::{Info, WrappingMode};

use super::file::GltfFile;
use crate::import::assets::{Assets, TextureUse};
use crate::import::texture;
use crate::scene::{Material, MetallicRoughness};
use crate::{Error, Result};

impl Assets {
    /// Adds a material of a file and its textures. Returns its index.
    pub(super) fn add_gltf_material(
        &mut self,
        file: &GltfFile,
        material: &gltf::Material,
    ) -> Result<u32> {
        let pbr = material.pbr_metallic_roughness();
        let [r, g, b, alpha] = pbr.base_color_factor().map(f64::from);
        let name = match material.name() {
            Some(name) => name.to_owned(),
            None => format!("material{}", material.index().unwrap_or_default()),
        };
        let place = format!("{}: material \"{name}\"", file.path.display());
        let mut surface = MetallicRoughness {
            base_color: [r, g, b],
            metallic: pbr.metallic_factor().into(),
            roughness: pbr.roughness_factor().into(),
        };
        let mut texture = |info: &Info, use_of, what: &str| {
            check_texcoords(info.tex_coord(), &place, what)?;
            self.gltf_texture(file, &info.texture(), use_of, &place)
        };
        let base = pbr.base_color_texture();
        let kd_texture = base
            .as_ref()
            .map(|info| texture(info, TextureUse::Reflectance, "baseColorTexture"));
        let kd_texture = kd_texture.transpose()?.flatten();
        let alpha_texture = match (&base, material.alpha_mode()) {
            (Some(info), AlphaMode::Mask) => {
                let cutoff = f64::from(material.alpha_cutoff().unwrap_or(0.5));
                // Scales alpha so that there is a surface from 1/2 on.
                let factor = 0.5 * alpha / cutoff.max(1e-6);
                let use_of = TextureUse::Alpha(factor.to_bits());
                texture(info, use_of, "baseColorTexture")?
            }
            _ => None,
        };
        let normal = material.normal_texture().map(|info| {
            check_texcoords(info.tex_coord(), &place, "normalTexture")?;
            let use_of = TextureUse::Normals(f64::from(info.scale()).to_bits(), false);
            self.gltf_texture(file, &info.texture(), use_of, &place)
        });
        let normal_texture = normal.transpose()?.flatten();
        if let Some(info) = pbr.metallic_roughness_texture() {
            let [roughness, metallic] = mean_of_texture(file, &info, &place)?;
            surface.roughness *= roughness;
            surface.metallic *= metallic;
            self.leave_out(
                &file.path,
                "the variation in metallicRoughnessTexture: the whole surface gets its mean",
            );
        }
        if kd_texture.is_some() && surface.metallic > 0.0 {
            self.leave_out(&file.path, "baseColorTexture in the lobe of metals: it colours only the diffuse part, and baseColorFactor colours the lobe");
        }
        if material.alpha_mode() == AlphaMode::Blend {
            self.leave_out(&file.path, "alphaMode BLEND: surfaces are opaque");
        }
        if material.emissive_factor() != [0.0; 3] {
            self.leave_out(&file.path, "emissive surfaces: they give no light");
        }
        let (kd, ks, shininess) = surface.as_phong();
        self.leave_out(&file.path, "the Fresnel term and the microfacets of metallic-roughness materials, which are modified Phong here");
        let material = Material {
            ks,
            shininess,
            kd_texture: kd_texture.map(Into::into),
            normal_texture: normal_texture.map(Into::into),
            alpha_texture: alpha_texture.map(Into::into),
            ..Material::lambert(name, kd)
        };
        Ok(self.push_material(material, place))
    }

    /// The index of a texture of the file; `None` for alpha that cuts nothing out.
    fn gltf_texture(
        &mut self,
        file: &GltfFile,
        of_file: &gltf::Texture,
        use_of: TextureUse,
        place: &str,
    ) -> Result<Option<usize>> {
        let image = of_file.source();
        let sampler = of_file.sampler();
        if [sampler.wrap_s(), sampler.wrap_t()] != [WrappingMode::Repeat; 2] {
            self.leave_out(
                &file.path,
                "samplers that do not repeat: all textures repeat, bilinear",
            );
        }
        let name = PathBuf::from(format!("{}#image{}", file.path.display(), image.index()));
        let load = |use_of: &TextureUse| {
            let decoded = decoded(file, &image, place)?;
            let name = name.display().to_string();
            Ok(match use_of {
                TextureUse::Reflectance | TextureUse::Factor => {
                    Some(texture::of_image(name, decoded))
                }
                TextureUse::Normals(strength, _) => {
                    let texture = texture::of_image(name, decoded);
                    Some(texture::as_normals(
                        texture,
                        f64::from_bits(*strength),
                        false,
                    ))
                }
                TextureUse::Alpha(factor) => {
                    let factor = f64::from_bits(*factor);
                    let size_px = [decoded.width(), decoded.height()];
                    let values = texture::alpha_channel(decoded).into_iter();
                    // The cast turns a value that is too large into 255.
                    let values = values.map(|value| (factor * f64::from(value)).round() as u8);
                    texture::alpha_texture(name, size_px, values.collect())
                }
            })
        };
        self.texture(&name, use_of, load)
    }
}

fn decoded(file: &GltfFile, image: &gltf::Image, place: &str) -> Result<image::DynamicImage> {
    texture::decode(&file.image(image)?).map_err(|problem| {
        let problem = format!("cannot read image {}: {problem}", image.index());
        Error::scene(place, problem, "give a PNG or JPEG image")
    })
}

/// The means of the roughness and metal channels.
fn mean_of_texture(file: &GltfFile, info: &Info, place: &str) -> Result<[f64; 2]> {
    let image = decoded(file, &info.texture().source(), place)?.into_rgb8();
    let count = f64::from(u8::MAX) * image.pixels().len().max(1) as f64;
    let sum = |channel: usize| {
        image
            .pixels()
            .map(|pixel| f64::from(pixel[channel]))
            .sum::<f64>()
    };
    Ok([1, 2].map(|channel| sum(channel) / count))
}

fn check_texcoords(set: u32, place: &str, what: &str) -> Result<()> {
    if set == 0 {
        return Ok(());
    }
    let problem = format!("{what} uses TEXCOORD_{set}");
    Err(Error::scene(
        place,
        problem,
        "use the first set, TEXCOORD_0, for all textures",
    ))
}
