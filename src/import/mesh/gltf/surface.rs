//! Images, textures and materials of a glTF file.

use super::keys;
use super::record::{Parsed, Record};
use crate::scene::{Filter, Wrap};

pub(super) struct Image {
    pub uri: Option<String>,
    pub view: Option<usize>,
}

#[derive(Clone, Copy, Default)]
pub(super) struct Sampler {
    pub wrap: [Wrap; 2],
    pub filter: Filter,
}

pub(super) struct Texture {
    pub sampler: Option<usize>,
    pub image: Option<usize>,
    /// An extension with an image of a kind that camlux does not read.
    pub other_kind: Option<&'static str>,
}

/// A texture of a material.
#[derive(Clone, Copy)]
pub(super) struct TextureInfo {
    pub texture: usize,
    /// n of TEXCOORD_n.
    pub texcoord_set: usize,
    /// The rows of the transform of (u, v, 1), v downwards.
    pub transform: [[f64; 3]; 2],
    /// Of slopes, for a normal texture.
    pub scale: f64,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum AlphaMode {
    Opaque,
    Mask,
    Blend,
}

#[derive(Clone)]
pub(super) struct Material {
    pub name: Option<String>,
    pub base_color: [f64; 4],
    pub base_texture: Option<TextureInfo>,
    pub metallic: f64,
    pub roughness: f64,
    /// Index of refraction, of `KHR_materials_ior`.
    pub ior: f64,
    /// The factor of `KHR_materials_specular`.
    pub specular: f64,
    pub metallic_roughness_texture: Option<TextureInfo>,
    pub normal_texture: Option<TextureInfo>,
    pub alpha_mode: AlphaMode,
    pub alpha_cutoff: f64,
    /// Luminance, cd/m².
    pub emission: [f64; 3],
    /// Only of a surface that emits light.
    pub emissive_texture: Option<TextureInfo>,
    pub is_double_sided: bool,
}

impl Default for Material {
    /// What a primitive without a material has.
    fn default() -> Self {
        Material {
            name: None,
            base_color: [1.0; 4],
            base_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            ior: 1.5,
            specular: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            alpha_mode: AlphaMode::Opaque,
            alpha_cutoff: 0.5,
            emission: [0.0; 3],
            emissive_texture: None,
            is_double_sided: false,
        }
    }
}

impl Material {
    /// The sets of texture coordinates that it uses, in order: the first two of its textures.
    pub fn texcoord_sets(&self) -> Vec<usize> {
        let infos = [
            self.base_texture,
            self.normal_texture,
            self.metallic_roughness_texture,
            self.emissive_texture,
        ];
        let mut sets: Vec<usize> = Vec::new();
        for set in infos.iter().flatten().map(|info| info.texcoord_set) {
            if sets.len() < 2 && !sets.contains(&set) {
                sets.push(set);
            }
        }
        sets.sort_unstable();
        sets
    }
}

pub(super) fn image(mut keys: Record) -> Parsed<Image> {
    Ok(Image {
        uri: keys.text("uri")?,
        view: keys.index("bufferView")?,
    })
}

pub(super) fn sampler(mut keys: Record) -> Parsed<Sampler> {
    let mut wrap = |key: &str| match keys.index(key)? {
        None | Some(10497) => Ok(Wrap::Repeat),
        Some(33648) => Ok(Wrap::Mirror),
        Some(33071) => Ok(Wrap::Clamp),
        Some(code) => Err(keys.wrong(key, &format!("is {code}"))),
    };
    let wrap = [wrap("wrapS")?, wrap("wrapT")?];
    let filter = match keys.index("magFilter")? {
        None | Some(9729) => Filter::Bilinear,
        Some(9728) => Filter::Nearest,
        Some(code) => return Err(keys.wrong("magFilter", &format!("is {code}"))),
    };
    // Without mip levels and like the other filter, it is what camlux does.
    let alike = match filter {
        Filter::Bilinear => 9729,
        Filter::Nearest => 9728,
    };
    keys.take_if("minFilter", alike);
    Ok(Sampler { wrap, filter })
}

pub(super) fn texture(mut keys: Record) -> Parsed<Texture> {
    const OTHER_KINDS: [&str; 4] = [
        "KHR_texture_basisu",
        "MSFT_texture_dds",
        "EXT_texture_avif",
        "EXT_texture_astc",
    ];
    let webp = keys.extension("EXT_texture_webp", &keys::TEXTURE_SOURCE)?;
    let webp = match webp {
        Some(mut webp) => webp.index("source")?,
        None => None,
    };
    let fallback = keys.index("source")?;
    let is_used = |name: &&str| keys.other_extensions().any(|other| other == *name);
    Ok(Texture {
        other_kind: OTHER_KINDS.into_iter().find(is_used),
        sampler: keys.index("sampler")?,
        image: webp.or(fallback),
    })
}

fn texture_info(keys: Option<Record>) -> Parsed<Option<TextureInfo>> {
    let Some(mut keys) = keys else {
        return Ok(None);
    };
    let texture = keys.index("index")?;
    let texture = keys.need("index", texture)?;
    let mut texcoord_set = keys.index("texCoord")?.unwrap_or(0);
    let mut transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    if let Some(mut keys) = keys.extension("KHR_texture_transform", &keys::TEXTURE_TRANSFORM)? {
        let [x, y] = keys.numbers("offset")?.unwrap_or([0.0; 2]);
        let [width, height] = keys.numbers("scale")?.unwrap_or([1.0; 2]);
        let (sin, cos) = keys.number("rotation")?.unwrap_or(0.0).sin_cos();
        // Counterclockwise, as the extension's text and example say. The matrix in its text turns the other way.
        transform = [
            [cos * width, sin * height, x],
            [-sin * width, cos * height, y],
        ];
        texcoord_set = keys.index("texCoord")?.unwrap_or(texcoord_set);
    }
    Ok(Some(TextureInfo {
        texture,
        texcoord_set,
        transform,
        scale: 1.0,
    }))
}

pub(super) fn material(mut keys: Record) -> Parsed<Material> {
    let default = Material::default();
    let pbr = keys.record("pbrMetallicRoughness", &keys::PBR)?;
    let normal_texture = match keys.record("normalTexture", &keys::TEXTURE_INFO)? {
        Some(mut info) => {
            let scale = info.number("scale")?.unwrap_or(1.0);
            texture_info(Some(info))?.map(|info| TextureInfo { scale, ..info })
        }
        None => None,
    };
    let ior = match keys.extension("KHR_materials_ior", &keys::IOR)? {
        Some(mut ior) => ior.number("ior")?.unwrap_or(default.ior),
        None => default.ior,
    };
    let specular = match keys.extension("KHR_materials_specular", &keys::SPECULAR)? {
        Some(mut of) => of.number("specularFactor")?.unwrap_or(default.specular),
        None => default.specular,
    };
    let strength = keys.extension("KHR_materials_emissive_strength", &keys::EMISSIVE_STRENGTH)?;
    let strength = match strength {
        Some(mut of) => of.number("emissiveStrength")?.unwrap_or(1.0),
        None => 1.0,
    };
    let emission = keys.numbers("emissiveFactor")?.unwrap_or([0.0; 3]);
    let emission = emission.map(|factor: f64| strength * factor);
    let emissive_texture = match emission == [0.0; 3] {
        // Left where it is, it is named.
        true => None,
        false => texture_info(keys.record("emissiveTexture", &keys::TEXTURE_INFO)?)?,
    };
    let mut material = Material {
        name: keys.text("name")?,
        normal_texture,
        alpha_mode: match keys.text("alphaMode")?.as_deref() {
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some("MASK") => AlphaMode::Mask,
            Some("BLEND") => AlphaMode::Blend,
            Some(other) => return Err(keys.wrong("alphaMode", &format!("is \"{other}\""))),
        },
        alpha_cutoff: keys.number("alphaCutoff")?.unwrap_or(0.5),
        emission,
        emissive_texture,
        is_double_sided: keys.flag("doubleSided")?.unwrap_or(false),
        ior,
        specular,
        ..default
    };
    if let Some(mut pbr) = pbr {
        let factor = |value: Option<f64>| value.unwrap_or(1.0);
        material.base_color = pbr.numbers("baseColorFactor")?.unwrap_or([1.0; 4]);
        material.base_texture = texture_info(pbr.record("baseColorTexture", &keys::TEXTURE_INFO)?)?;
        material.metallic = factor(pbr.number("metallicFactor")?);
        material.roughness = factor(pbr.number("roughnessFactor")?);
        let of_both = pbr.record("metallicRoughnessTexture", &keys::TEXTURE_INFO)?;
        material.metallic_roughness_texture = texture_info(of_both)?;
    }
    Ok(material)
}
