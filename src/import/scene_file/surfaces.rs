//! The textures and materials of a scene file.

use std::path::Path;

use crate::exr_decode::decode_file;
use crate::import::texture;
use crate::keys::{Keys, Value};
use crate::scene::{
    Encoding, Filter, Material, MetallicRoughness, Parameters, Shared, Texels, Texture,
    TextureLookup, TextureSource, Wrap,
};
use crate::{Error, Result};

use super::value_of;

/// Reads a `[[texture]]` table. Its role decides what is read, unless the table names an encoding.
pub(super) fn texture(mut keys: Keys, folder: &Path) -> Result<TextureSource> {
    keys.only(&["path", "encoding", "name"])?;
    let named = keys.need("path", "path = \"wood.png\"")?;
    let path = folder.join(named.text()?);
    let extension = path.extension().unwrap_or_default();
    let name = keys.optional("name", |name| Ok(name.text()?.to_owned()))?;
    let named_texture = |texture: Texture| Texture {
        name: name.clone().unwrap_or_else(|| texture.name.clone()),
        ..texture
    };
    if extension.eq_ignore_ascii_case("exr") {
        let hint = "remove it, or give a PNG, JPEG or WebP image";
        keys.refuse("encoding", "is given for OpenEXR, which is linear", hint)?;
        let texture = named_texture(float_texture(&path, &named.at)?);
        return Ok(Shared::from(texture).into());
    }
    let (texture, alpha) = texture::load_with_alpha(&path, &named.at)?;
    let texture = named_texture(texture);
    let encoding = keys.optional("encoding", |value| {
        value.choice(&Encoding::ALL, Encoding::name)
    })?;
    Ok(match encoding {
        // As it is, in every role.
        Some(Encoding::Linear) => Shared::from(texture.into_linear()).into(),
        Some(Encoding::Srgb) => TextureSource::new(texture, encoding, None),
        None => TextureSource::new(texture, None, alpha),
    })
}

/// Loads the channels R, G and B of an OpenEXR file as they are.
fn float_texture(path: &Path, named_at: &str) -> Result<Texture> {
    let unusable = |(problem, hint): (String, &str)| {
        let problem = format!("cannot read the texture {}: {problem}", path.display());
        Error::scene(named_at, problem, hint)
    };
    let image = decode_file(path, &|_| None).map_err(unusable)?;
    match &image.layers[..] {
        [layer] if layer.channel_names == ["R", "G", "B"] => Ok(Texture {
            name: path.display().to_string(),
            size_px: image.size_px,
            texels: Texels::F32(layer.values.as_chunks().0.to_vec()),
        }),
        _ => {
            let problem = "it has other channels than R, G and B".into();
            Err(unusable((problem, "save it with these three")))
        }
    }
}

/// Reads a `[material.KEY]` table. `textures`: the number of `[[texture]]` tables.
pub(super) fn material(mut keys: Keys, key: String, textures: usize) -> Result<Material> {
    let of_microfacets = MetallicRoughness::DEFAULT.rows().iter();
    let of_microfacets = Vec::from_iter(of_microfacets.map(|parameter| parameter.name));
    let textures_of_any = [
        "kd_texture",
        "ks_texture",
        "shininess_texture",
        "metallic_roughness_texture",
        "emission_texture",
        "normal_texture",
        "alpha_texture",
    ];
    let mut known = vec![
        "kd",
        "ks",
        "shininess",
        "base_color",
        "name",
        "alpha_cutoff",
        "emission_w_sr_m2",
        "one_sided",
    ];
    known.extend(textures_of_any);
    known.extend(&of_microfacets);
    keys.only(&known)?;
    let name = keys.optional("name", |name| Ok(name.text()?.to_owned()))?;
    let base_color = keys.optional("base_color", Value::bands)?;
    let (others, problem, hint): (&[&str], _, _) = match base_color {
        None => (
            &[&of_microfacets[..], &["metallic_roughness_texture"]].concat(),
            "is of a surface of microfacets, which has a base_color",
            "add base_color = 0.8, and remove kd, ks and shininess; or remove it",
        ),
        Some(_) => (
            &["kd", "ks", "shininess", "ks_texture", "shininess_texture"],
            "is of a Phong lobe, and base_color of a surface of microfacets",
            "remove it, or base_color",
        ),
    };
    for key in others {
        keys.refuse(key, problem, hint)?;
    }
    let kd = match base_color {
        Some(base_color) => base_color,
        None => keys.need("kd", "kd = 0.8 or kd = [r, g, b]")?.bands()?,
    };
    let mut material = Material::lambert(name.unwrap_or(key), kd);
    if base_color.is_some() {
        let mut microfacets = MetallicRoughness::DEFAULT;
        let rows: &mut dyn Parameters = &mut microfacets;
        rows.read(|parameter| value_of(parameter, &mut keys))?;
        material.microfacets = Some(microfacets);
    }
    material.ks = keys.optional("ks", Value::bands)?.unwrap_or_default();
    // A default exponent of 1 would silently give a very wide lobe.
    if material.microfacets.is_none() && material.is_specular() {
        let shininess = keys.need("shininess", "shininess = 20.0, the exponent of ks")?;
        material.shininess = shininess.number()?;
    } else if let Some(shininess) = keys.optional("shininess", Value::number)? {
        material.shininess = shininess;
    }
    if let Some(emission) = keys.optional("emission_w_sr_m2", Value::bands)? {
        material.emission_w_sr_m2 = emission;
    }
    if let Some(is_one_sided) = keys.optional("one_sided", Value::flag)? {
        material.is_one_sided = is_one_sided;
    }
    for (role, texture) in material.by_role_mut() {
        let value = keys.take(role.field());
        *texture = value.map(|value| lookup(value, textures)).transpose()?;
    }
    if let Some(cutoff) = keys.optional("alpha_cutoff", Value::number)? {
        material.alpha_cutoff = cutoff;
    }
    Ok(material)
}

/// The index of a texture, or a table with more.
fn lookup(value: Value, textures: usize) -> Result<TextureLookup> {
    let index = |value: &Value| match value.count()? as usize {
        index if index < textures => Ok(index),
        index => {
            let problem = format!("is {index}, and there are {textures} [[texture]] tables");
            Err(value.error(problem, "count from 0 in the order of this file"))
        }
    };
    let mut keys = match value.count() {
        Ok(_) => return Ok(index(&value)?.into()),
        Err(_) => value.table("the texture of a material")?,
    };
    keys.only(&["texture", "texcoord_set", "transform", "wrap", "filter"])?;
    let mut lookup = TextureLookup::from(index(&keys.need("texture", "texture = 0")?)?);
    if let Some(set) = keys.optional("texcoord_set", Value::count)? {
        lookup.texcoord_set = set;
    }
    if let Some(rows) = keys.take("transform") {
        lookup.transform = two(rows, |row| row.numbers())?;
    }
    if let Some(wraps) = keys.take("wrap") {
        lookup.wrap = two(wraps, |wrap| wrap.choice(&Wrap::ALL, Wrap::name))?;
    }
    if let Some(filter) = keys.take("filter") {
        lookup.filter = filter.choice(&Filter::ALL, Filter::name)?;
    }
    Ok(lookup)
}

/// The values along u and v.
fn two<T: Copy>(value: Value, read: impl Fn(&Value) -> Result<T>) -> Result<[T; 2]> {
    let at = value.at.clone();
    match &value.list()?[..] {
        [along_u, along_v] => Ok([read(along_u)?, read(along_v)?]),
        other => {
            let problem = format!("there are {} values", other.len());
            Err(Error::scene(at, problem, "give two: along u and along v"))
        }
    }
}
