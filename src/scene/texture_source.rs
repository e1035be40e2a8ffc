//! Textures as callers give them. What a material uses one for decides how it is read.

use std::sync::OnceLock;

use super::validate::Part;
use super::{Encoding, Material, Shared, Texels, Texture};
use crate::{Error, Result};

/// What a material uses a texture for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextureRole {
    Kd,
    Ks,
    Shininess,
    MetallicRoughness,
    Emission,
    Normal,
    Alpha,
}

/// A texture before its role is known: red, green and blue as the caller gave them, and alpha.
#[derive(Debug)]
pub struct TextureSource {
    /// As k_d and k_s read it, but floating-point texels that are sRGB are not decoded.
    colors: Shared<Texture>,
    /// Of each texel; 255 stands for 1.
    alpha: Option<Vec<u8>>,
    /// Whether the caller has said that the colours are sRGB, so that they are nothing else.
    is_named_srgb: bool,
    /// Whether it is linear, and a scene has it as it is: every role reads it so.
    is_final: bool,
    // What roles read, made when one does.
    decoded: OnceLock<Shared<Texture>>,
    linear: OnceLock<Shared<Texture>>,
    brightness: OnceLock<Shared<Texture>>,
    grey_alpha: OnceLock<Shared<Texture>>,
}

impl TextureRole {
    /// The field of [`Material`] that has it.
    pub(crate) fn field(self) -> &'static str {
        match self {
            TextureRole::Kd => "kd_texture",
            TextureRole::Ks => "ks_texture",
            TextureRole::Shininess => "shininess_texture",
            TextureRole::MetallicRoughness => "metallic_roughness_texture",
            TextureRole::Emission => "emission_texture",
            TextureRole::Normal => "normal_texture",
            TextureRole::Alpha => "alpha_texture",
        }
    }

    /// Whether the texture may be encoded as sRGB.
    pub(crate) fn may_be_srgb(self) -> bool {
        matches!(
            self,
            TextureRole::Kd | TextureRole::Ks | TextureRole::Emission
        )
    }
}

/// A component of a pixel: u8 and u16 from 0, f32 from 0 to 1.
pub trait Component: Copy + std::fmt::Debug {
    fn texels(texels: Vec<[Self; 3]>) -> Texels;

    /// To 8 bits; `None` if it is out of range.
    fn to_u8(self) -> Option<u8>;
}

impl Component for u8 {
    fn texels(texels: Vec<[u8; 3]>) -> Texels {
        Texels::U8(texels, Encoding::Srgb)
    }

    fn to_u8(self) -> Option<u8> {
        Some(self)
    }
}

impl Component for u16 {
    fn texels(texels: Vec<[u16; 3]>) -> Texels {
        Texels::U16(texels, Encoding::Srgb)
    }

    fn to_u8(self) -> Option<u8> {
        Some(((u32::from(self) + 128) / 257) as u8)
    }
}

impl Component for f32 {
    fn texels(texels: Vec<[f32; 3]>) -> Texels {
        Texels::F32(texels)
    }

    fn to_u8(self) -> Option<u8> {
        let is_in_range = (0.0..=1.0).contains(&self);
        is_in_range.then(|| (255.0 * self).round() as u8)
    }
}

impl TextureSource {
    /// A texture of pixels with 1 (grey), 3 (R, G, B) or 4 components (R, G, B, alpha), row by row from the top. The caller names the
    /// encoding of R, G and B, or leaves it to the role. Alpha is linear.
    ///
    /// # Errors
    /// Returns an error if there are no pixels or values are out of range.
    pub fn from_pixels<C: Component>(
        name: String,
        size_px: [u32; 2],
        pixels: &[C],
        channels: usize,
        encoding: Option<Encoding>,
    ) -> Result<Self> {
        let pixels = pixels.chunks_exact(channels);
        let colors = pixels.clone().map(|pixel| match *pixel {
            [r, g, b, ..] => [r, g, b],
            _ => [pixel[0]; 3],
        });
        let alpha = pixels.enumerate().map(|(index, pixel)| {
            pixel[3].to_u8().ok_or_else(|| {
                let at = format!("texture \"{name}\"");
                let problem = format!("alpha of texel {index} is {:?}", pixel[3]);
                Error::scene(at, problem, "give values from 0 to 1")
            })
        });
        let alpha = (channels == 4).then(|| alpha.collect::<Result<_>>());
        let (texels, alpha) = (C::texels(colors.collect()), alpha.transpose()?);
        let texture = Texture {
            name,
            size_px,
            texels,
        };
        let source = TextureSource::new(texture, encoding, alpha);
        let part = Part(format!("texture \"{}\"", source.colors.name));
        source.colors.validate_as(&part)?;
        Ok(source)
    }

    /// The encoding in the texels does not count.
    pub(crate) fn new(
        mut texture: Texture,
        encoding: Option<Encoding>,
        alpha: Option<Vec<u8>>,
    ) -> Self {
        texture.texels = texture
            .texels
            .encoded_as(encoding.unwrap_or(Encoding::Srgb));
        TextureSource {
            alpha,
            is_named_srgb: encoding == Some(Encoding::Srgb),
            is_final: false,
            ..Shared::from(texture).into()
        }
    }

    /// Red, green and blue as they were given.
    pub fn colors(&self) -> &Shared<Texture> {
        &self.colors
    }

    /// The alpha of each texel, 255 for 1; `None` if there is none.
    pub fn alpha(&self) -> Option<&[u8]> {
        self.alpha.as_deref()
    }

    /// The encoding, if it does not depend on the role.
    pub fn encoding(&self) -> Option<Encoding> {
        match self.colors.texels {
            _ if self.is_named_srgb => Some(Encoding::Srgb),
            Texels::U8(_, encoding) | Texels::U16(_, encoding) if encoding == Encoding::Linear => {
                Some(encoding)
            }
            _ => None,
        }
    }

    /// Whether the caller has named an encoding that contradicts the role.
    pub fn contradicts(&self, role: TextureRole) -> bool {
        let is_alpha_channel = role == TextureRole::Alpha && self.alpha.is_some();
        self.is_named_srgb && !role.may_be_srgb() && !is_alpha_channel
    }

    /// The texture that a material uses in this role, made once.
    pub fn in_role(&self, role: TextureRole) -> Shared<Texture> {
        let texture = match role {
            TextureRole::Kd | TextureRole::Ks | TextureRole::Emission => self.reflectance(),
            TextureRole::Normal | TextureRole::MetallicRoughness => self.linear(),
            TextureRole::Shininess => self.brightness(),
            TextureRole::Alpha => self.grey_alpha(),
        };
        texture.clone()
    }

    fn reflectance(&self) -> &Shared<Texture> {
        let Texels::F32(texels) = &self.colors.texels else {
            return &self.colors;
        };
        if !self.is_named_srgb {
            return &self.colors;
        }
        self.decoded.get_or_init(|| {
            let decode = |value: f32| Encoding::Srgb.decode(value.into());
            let texels = texels.iter().map(|texel| texel.map(decode)).collect();
            self.with_texels(Texels::F32(texels))
        })
    }

    fn linear(&self) -> &Shared<Texture> {
        if self.is_named_srgb || !self.colors.texels.is_srgb() {
            return &self.colors;
        }
        let linear = || Texture::clone(&self.colors).into_linear().into();
        self.linear.get_or_init(linear)
    }

    /// The alpha channel, or else the brightness, with 8 bits.
    fn grey_alpha(&self) -> &Shared<Texture> {
        if self.alpha.is_none() {
            let brightness = self.brightness();
            let is_u8 = matches!(brightness.texels, Texels::U8(..));
            if self.is_named_srgb || self.is_final || is_u8 {
                return brightness;
            }
        }
        self.grey_alpha.get_or_init(|| {
            let channel = self.alpha.clone();
            let values = channel.unwrap_or_else(|| self.brightness().red_in_8_bits());
            let texels = values.into_iter().map(|value| [value; 3]).collect();
            self.with_texels(Texels::U8(texels, Encoding::Linear))
        })
    }

    fn with_texels(&self, texels: Texels) -> Shared<Texture> {
        let texture = Texture {
            name: self.colors.name.clone(),
            size_px: self.colors.size_px,
            texels,
        };
        texture.into()
    }

    fn brightness(&self) -> &Shared<Texture> {
        let linear = self.linear();
        self.brightness.get_or_init(|| {
            if self.is_named_srgb || self.is_final || linear.texels.are_grey() {
                return linear.clone();
            }
            Texture::clone(linear).into_brightness().into()
        })
    }
}

impl PartialEq for TextureSource {
    fn eq(&self, other: &Self) -> bool {
        // The rest follows from these.
        self.colors == other.colors
            && self.alpha == other.alpha
            && self.is_named_srgb == other.is_named_srgb
    }
}

impl From<Shared<Texture>> for TextureSource {
    /// A texture of a scene. In the role that it has there it stays the same.
    fn from(colors: Shared<Texture>) -> Self {
        TextureSource {
            is_final: !colors.texels.is_srgb(),
            colors,
            alpha: None,
            is_named_srgb: false,
            decoded: OnceLock::new(),
            linear: OnceLock::new(),
            brightness: OnceLock::new(),
            grey_alpha: OnceLock::new(),
        }
    }
}

/// The textures of a scene whose materials name `sources` by index. The materials name the returned textures afterwards. A source that
/// has two roles may become two textures, and one without a role stays as its colours.
pub fn in_their_roles<'s, S>(sources: S, materials: &mut [Material]) -> Vec<Shared<Texture>>
where
    S: IntoIterator<Item = &'s TextureSource>,
{
    let sources: Vec<&TextureSource> = sources.into_iter().collect();
    let mut of_source: Vec<Vec<Shared<Texture>>> = vec![Vec::new(); sources.len()];
    // Its place among the textures of its source.
    let mut places = Vec::new();
    for (role, lookup) in materials.iter().flat_map(Material::textures) {
        let texture = sources[lookup.texture].in_role(role);
        let textures = &mut of_source[lookup.texture];
        let known = textures.iter().position(|known| known.ptr_eq(&texture));
        places.push(known.unwrap_or(textures.len()));
        if known.is_none() {
            textures.push(texture);
        }
    }
    let mut first = Vec::with_capacity(sources.len());
    let mut all = Vec::new();
    for (source, textures) in sources.iter().zip(of_source) {
        first.push(all.len());
        match textures.is_empty() {
            true => all.push(source.reflectance().clone()),
            false => all.extend(textures),
        }
    }
    let lookups = materials.iter_mut().flat_map(Material::by_role_mut);
    let lookups = lookups.filter_map(|(_, lookup)| lookup.as_mut());
    for (lookup, place) in lookups.zip(places) {
        lookup.texture = first[lookup.texture] + place;
    }
    all
}

impl Texture {
    /// The same values, not decoded.
    pub(crate) fn into_linear(mut self) -> Texture {
        self.texels = self.texels.encoded_as(Encoding::Linear);
        self
    }

    /// The red values, 255 for 1.
    pub(crate) fn red_in_8_bits(&self) -> Vec<u8> {
        let texels = self.texels.reflectances();
        texels.map(|[r, ..]| (255.0 * r).round() as u8).collect()
    }

    /// The brightness of each texel, not decoded, in all bands.
    pub(crate) fn into_brightness(self) -> Texture {
        let mut texture = self.into_linear();
        if !texture.texels.are_grey() {
            // Luma of BT.709.
            let luma = |[r, g, b]: [f32; 3]| [0.2126 * r + 0.7152 * g + 0.0722 * b; 3];
            texture.texels = Texels::F32(texture.texels.reflectances().map(luma).collect());
        }
        texture
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use TextureRole::*;

    const ROLES: [TextureRole; 7] = [
        Kd,
        Ks,
        Emission,
        Shininess,
        MetallicRoughness,
        Normal,
        Alpha,
    ];

    fn source(texels: Texels, encoding: Option<Encoding>, alpha: Option<Vec<u8>>) -> TextureSource {
        let texture = Texture {
            name: "t".into(),
            size_px: [texels.len() as u32, 1],
            texels,
        };
        TextureSource::new(texture, encoding, alpha)
    }

    #[test]
    fn a_role_decides_the_encoding_unless_it_is_named() {
        let texels = || Texels::U8(vec![[10, 20, 30]; 2], Encoding::Srgb);
        let encodings = |encoding| {
            let source = source(texels(), encoding, Some(vec![7, 9]));
            ROLES.map(|role| source.in_role(role).texels.is_srgb())
        };
        assert_eq!(
            encodings(None),
            [true, true, true, false, false, false, false]
        );
        assert_eq!(encodings(Some(Encoding::Linear)), [false; 7]);
        // What is refused stays sRGB. Alpha is linear whatever the colours are.
        let half = source(Texels::F32(vec![[0.5; 3]]), Some(Encoding::Srgb), None);
        let refused = ROLES.map(|role| half.contradicts(role));
        assert_eq!(refused, [false, false, false, true, true, true, true]);
        let named = encodings(Some(Encoding::Srgb));
        assert_eq!(named, [true, true, true, true, true, true, false]);
    }

    #[test]
    fn shininess_is_brightness_and_alpha_is_the_channel_or_brightness() {
        let texels = |texels: &[[u8; 3]]| Texels::U8(texels.to_vec(), Encoding::Srgb);
        let red = |source: &TextureSource, role| {
            let texels = &source.in_role(role).texels;
            texels.reflectances().map(|[r, ..]| r).collect::<Vec<_>>()
        };
        let colored = [[255, 0, 0], [0, 255, 0]];
        let with_alpha = source(texels(&colored), None, Some(vec![0, 255]));
        assert_eq!(red(&with_alpha, Shininess), [0.2126, 0.7152]);
        assert_eq!(red(&with_alpha, Alpha), [0.0, 1.0]);
        let without = source(texels(&colored), None, None);
        let eight_bits = |value: f32| value / 255.0;
        assert_eq!(red(&without, Alpha), [54.0, 182.0].map(eight_bits));
        let grey = source(texels(&[[51; 3], [102; 3]]), None, None);
        assert_eq!(red(&grey, Alpha), [0.2, 0.4]);
        // Floating-point texels are linear unless they are named.
        let half = || Texels::F32(vec![[0.5; 3]]);
        assert_eq!(red(&source(half(), None, None), Kd), [0.5]);
        let decoded = red(&source(half(), Some(Encoding::Srgb), None), Kd)[0];
        assert!((decoded - 0.21404).abs() < 1e-5);
    }

    #[test]
    fn textures_of_a_scene_stay_the_same_in_their_roles() {
        let texture = |texels: Texels| {
            let colors = source(texels, None, None).colors;
            Texture::clone(&colors)
        };
        let of_colors = || texture(Texels::U8(vec![[1, 2, 3]], Encoding::Srgb));
        let scene = [
            Shared::from(of_colors()),
            Shared::from(of_colors().into_linear()),
            Shared::from(texture(Texels::U8(vec![[9; 3]], Encoding::Srgb)).into_linear()),
            Shared::from(of_colors()),
        ];
        let sources = scene.clone().map(TextureSource::from);
        let mut materials = [Material::lambert("first", [0.5; 3])];
        materials[0].kd_texture = Some(0.into());
        materials[0].normal_texture = Some(1.into());
        materials[0].alpha_texture = Some(2.into());
        let before = materials.clone();
        let textures = in_their_roles(&sources, &mut materials);
        assert_eq!(materials, before);
        assert!(scene.iter().zip(&textures).all(|(a, b)| a.ptr_eq(b)));

        // The first one in three roles: two textures.
        materials[0].ks_texture = Some(0.into());
        materials[0].normal_texture = Some(0.into());
        let textures = in_their_roles(&sources, &mut materials);
        let indices: Vec<usize> = materials[0].textures().map(|(_, l)| l.texture).collect();
        assert_eq!((indices, textures.len()), (vec![0, 0, 1, 3], 5));
        assert!(textures[0].texels.is_srgb() && !textures[1].texels.is_srgb());
        // They are made once.
        assert!(textures[1].ptr_eq(&sources[0].in_role(Normal)));
    }
}
