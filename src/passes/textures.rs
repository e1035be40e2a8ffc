//! The scene's textures on the device, stored once for the rasteriser and for rays.

use crate::{
    Result, Scene,
    scene::{Filter, Texels, Texture, TextureLookup, TextureRole, Wrap},
    vulkan::{CommandPool, Declarations, Resource, WordList, shaders},
};

/// Flags of `shaders/shared/texels.wgsl`. A mirror's flag is followed by that of a clamp.
const SRGB: u32 = 1;
const MIRROR_U: u32 = 2;
const MIRROR_V: u32 = 8;
const NEAREST: u32 = 32;
const SECOND_SET: u32 = 64;
const TRANSFORMED: u32 = 128;

/// All texels of a scene, as `texels` of `shaders/shared/texels.wgsl`: at the precision of their source, and alpha at 8 bits.
#[derive(Default)]
pub(crate) struct Textures {
    /// `None` if no surface shows a texture.
    texels: Option<WordList>,
    places: Vec<shaders::Texture>,
    /// Places of the same textures as alpha.
    alpha_places: Vec<shaders::Texture>,
}

/// Declares the memory for a scene's textures.
pub(crate) fn declare(declarations: &Declarations, scene: &Scene) -> Result<()> {
    let uses = scene.textures.iter().zip(uses_of(scene));
    let words = uses.map(|(texture, used)| used.word_count(texture)).sum();
    // Words are counted with 32 bits.
    declarations.check("words of textures", words, |_| u32::MAX.into())?;
    WordList::declare(declarations, "textures", words)
}

/// What a texture is used for.
#[derive(Clone, Copy, Default, PartialEq)]
pub(crate) struct TextureUses {
    has_bands: bool,
    has_alpha: bool,
}

/// The uses of each texture.
pub(crate) fn uses_of(scene: &Scene) -> Vec<TextureUses> {
    let mut uses = vec![TextureUses::default(); scene.textures.len()];
    for material in &scene.materials {
        for (role, lookup) in material.textures() {
            let used = &mut uses[lookup.texture];
            match role {
                TextureRole::Alpha => used.has_alpha = true,
                _ => used.has_bands = true,
            }
        }
    }
    uses
}

impl TextureUses {
    fn word_count(self, texture: &Texture) -> u64 {
        let texels = texture.texels.len() as u64;
        let words_of_bands = words_per_texel(&texture.texels) * texels;
        u64::from(self.has_bands) * words_of_bands + u64::from(self.has_alpha) * texels
    }
}

impl Textures {
    /// Copies the textures that materials name to the device.
    pub fn upload(commands: &CommandPool, scene: &Scene) -> Result<Textures> {
        let mut first_word = 0;
        let mut places = Vec::new();
        let mut alpha_places = Vec::new();
        let uses = uses_of(scene);
        for (texture, used) in scene.textures.iter().zip(&uses) {
            let mut place = |is_used: bool, words: u64, is_srgb: bool| {
                if !is_used {
                    return shaders::Texture::default();
                }
                let place = shaders::Texture {
                    size: texture.size_px,
                    // The plan has checked that this fits.
                    first_word: first_word as u32,
                    words: words as u32,
                    flags: SRGB * u32::from(is_srgb),
                    ..shaders::Texture::default()
                };
                first_word += words * texture.texels.len() as u64;
                place
            };
            let words = words_per_texel(&texture.texels);
            places.push(place(used.has_bands, words, texture.texels.is_srgb()));
            alpha_places.push(place(used.has_alpha, 1, false));
        }
        let textures = scene.textures.iter().zip(&uses);
        let words = textures.flat_map(|(texture, used)| {
            let bands = used.has_bands.then(|| words(&texture.texels));
            let alpha = used.has_alpha.then(|| alpha_words(texture));
            bands
                .into_iter()
                .flatten()
                .chain(alpha.into_iter().flatten())
        });
        Ok(Textures {
            texels: Some(WordList::new(commands, "textures", words, first_word)?),
            places,
            alpha_places,
        })
    }

    /// The place of a material's texture in the list of texels, and how it is looked up. It has no columns if the material has no texture.
    pub fn place_of(&self, texture: Option<TextureLookup>) -> shaders::Texture {
        looked_up(&self.places, texture)
    }

    /// The same for an alpha texture.
    pub fn alpha_place_of(&self, texture: Option<TextureLookup>) -> shaders::Texture {
        looked_up(&self.alpha_places, texture)
    }

    /// The list with its name in the shaders.
    pub fn resource(&self) -> Option<(&'static str, Resource<'_>)> {
        let texels = self.texels.as_ref()?;
        Some(("texels", texels.resource()))
    }
}

fn looked_up(places: &[shaders::Texture], texture: Option<TextureLookup>) -> shaders::Texture {
    let place = texture.and_then(|lookup| Some((lookup, *places.get(lookup.texture)?)));
    place.map_or(shaders::Texture::default(), |(lookup, place)| {
        shaders::Texture {
            flags: place.flags | flags_of(&lookup),
            ..place
        }
    })
}

/// The flags of `shaders/shared/texels.wgsl`.
fn flags_of(lookup: &TextureLookup) -> u32 {
    let [along_u, along_v] = lookup.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    let is_nearest = lookup.filter == Filter::Nearest;
    let is_transformed = lookup.transform != TextureLookup::IDENTITY;
    along_u * MIRROR_U
        + along_v * MIRROR_V
        + u32::from(is_nearest) * NEAREST
        + lookup.texcoord_set * SECOND_SET
        + u32::from(is_transformed) * TRANSFORMED
}

/// The two numbers from which `word_index` of `shaders/shared/texels.wgsl` computes a texture's first word.
pub(crate) fn halves_of_first_word(texture: shaders::Texture) -> [f32; 2] {
    [texture.first_word >> 16, texture.first_word & 0xffff].map(|half| half as f32)
}

fn words_per_texel(texels: &Texels) -> u64 {
    match texels {
        Texels::U8(..) => 1,
        Texels::U16(..) => 2,
        Texels::F32(_) => 3,
    }
}

/// The alpha of each texel and of those to its right, below, and right below, as the bytes of a word. These four are interpolated.
fn alpha_words(texture: &Texture) -> impl Iterator<Item = u32> {
    let [width, height] = texture.size_px.map(|size| size as usize);
    let alpha = move |column: usize, row: usize| {
        let index = row % height * width + column % width;
        let [alpha, ..] = texture.texels.reflectance(index);
        (255.0 * alpha).round() as u8
    };
    (0..width * height).map(move |i| {
        let (column, row) = (i % width, i / width);
        u32::from_le_bytes([
            alpha(column, row),
            alpha(column + 1, row),
            alpha(column, row + 1),
            alpha(column + 1, row + 1),
        ])
    })
}

/// The words of a texture, texel by texel.
fn words(texels: &Texels) -> Box<dyn Iterator<Item = u32> + '_> {
    match texels {
        Texels::U8(texels, _) => Box::new(
            texels
                .iter()
                .map(|&[r, g, b]| u32::from_le_bytes([r, g, b, 0])),
        ),
        Texels::U16(texels, _) => Box::new(texels.iter().flat_map(|&texel| {
            let [r, g, b] = texel.map(u32::from);
            [r | g << 16, b]
        })),
        Texels::F32(texels) => Box::new(texels.iter().flat_map(|texel| texel.map(f32::to_bits))),
    }
}
