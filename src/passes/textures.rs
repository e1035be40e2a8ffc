//! The scene's textures on the device, once for the rasteriser and for rays.

use crate::{
    Plan, Result, Scene,
    scene::{Encoding, Texels},
    vulkan::{CommandPool, Declarations, Resource, WordList, shaders},
};

/// All texels of a scene, at the precision of their source: `texels` of `shaders/texels.wgsl`.
#[derive(Default)]
pub(crate) struct Textures {
    /// `None`: no surface shows one.
    texels: Option<WordList>,
    places: Vec<shaders::Texture>,
}

/// What a scene's textures take.
pub(crate) fn declare(declarations: &Declarations, scene: &Scene) -> Result<()> {
    let words = word_count(scene);
    // They are counted by 32 bits.
    declarations.check("words of textures", words, |_| u32::MAX.into())?;
    WordList::declare(declarations, "textures", words)
}

impl Textures {
    /// Copies them to the device.
    pub fn upload(commands: &CommandPool, scene: &Scene, plan: &Plan) -> Result<Textures> {
        if !plan.is_textured {
            return Ok(Textures::default());
        }
        let mut first_word = 0;
        let mut places = Vec::new();
        for texture in &scene.textures {
            let is_srgb = match texture.texels {
                Texels::U8(_, encoding) | Texels::U16(_, encoding) => encoding == Encoding::Srgb,
                Texels::F32(_) => false,
            };
            places.push(shaders::Texture {
                size: texture.size_px,
                // The plan has checked that it is that small.
                first_word: first_word as u32,
                words: words_per_texel(&texture.texels) as u32,
                is_srgb: is_srgb.into(),
                ..shaders::Texture::default()
            });
            first_word += words_of(&texture.texels);
        }
        let textures = scene.textures.iter();
        let words = textures.flat_map(|texture| words(&texture.texels));
        Ok(Textures {
            texels: Some(WordList::new(commands, "textures", words, first_word)?),
            places,
        })
    }

    /// Where the texels of a texture of a material lie; of no columns where it has none.
    pub fn place_of(&self, texture: Option<usize>) -> shaders::Texture {
        let place = texture.and_then(|index| self.places.get(index));
        place.copied().unwrap_or_default()
    }

    /// Under the name that the shaders give it.
    pub fn resource(&self) -> Option<(&'static str, Resource<'_>)> {
        let texels = self.texels.as_ref()?;
        Some(("texels", texels.resource()))
    }
}

fn word_count(scene: &Scene) -> u64 {
    scene
        .textures
        .iter()
        .map(|texture| words_of(&texture.texels))
        .sum()
}

fn words_of(texels: &Texels) -> u64 {
    words_per_texel(texels) * texels.len() as u64
}

fn words_per_texel(texels: &Texels) -> u64 {
    match texels {
        Texels::U8(..) => 1,
        Texels::U16(..) => 2,
        Texels::F32(_) => 3,
    }
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
