//! The texels of textures, stored at the precision of their source, and their reflectances.

use std::sync::OnceLock;

/// Red, green and blue of each texel, in one of three precisions.
#[derive(Debug, Clone, PartialEq)]
pub enum Texels {
    /// 255 stands for a reflectance of 1.
    U8(Vec<[u8; 3]>, Encoding),
    /// 65 535 stands for a reflectance of 1.
    U16(Vec<[u16; 3]>, Encoding),
    /// Reflectances, 0 to 1.
    F32(Vec<[f32; 3]>),
}

/// How integers encode reflectances.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Linear,
    Srgb,
}

impl Texels {
    pub fn len(&self) -> usize {
        match self {
            Texels::U8(texels, _) => texels.len(),
            Texels::U16(texels, _) => texels.len(),
            Texels::F32(texels) => texels.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The reflectances of a texel.
    ///
    /// # Panics
    /// If there is no texel of this index.
    pub fn reflectance(&self, index: usize) -> [f32; 3] {
        match self {
            Texels::U8(texels, encoding) => {
                let decoded = encoding.decoded_u8();
                texels[index].map(|value| decoded[usize::from(value)])
            }
            Texels::U16(texels, encoding) => {
                let decoded = encoding.decoded_u16();
                texels[index].map(|value| decoded[usize::from(value)])
            }
            Texels::F32(texels) => texels[index],
        }
    }

    /// Whether they are integers encoded as sRGB.
    pub(crate) fn is_srgb(&self) -> bool {
        match self {
            Texels::U8(_, encoding) | Texels::U16(_, encoding) => *encoding == Encoding::Srgb,
            Texels::F32(_) => false,
        }
    }

    /// Whether red, green and blue are equal everywhere.
    pub(crate) fn are_grey(&self) -> bool {
        fn are_equal<T: PartialEq>(texels: &[[T; 3]]) -> bool {
            texels.iter().all(|[r, g, b]| r == g && g == b)
        }
        match self {
            Texels::U8(texels, _) => are_equal(texels),
            Texels::U16(texels, _) => are_equal(texels),
            Texels::F32(texels) => are_equal(texels),
        }
    }

    /// The same integers, read with another encoding.
    pub(crate) fn encoded_as(self, encoding: Encoding) -> Texels {
        match self {
            Texels::U8(texels, _) => Texels::U8(texels, encoding),
            Texels::U16(texels, _) => Texels::U16(texels, encoding),
            Texels::F32(texels) => Texels::F32(texels),
        }
    }

    /// The reflectances of all texels.
    pub fn reflectances(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.len()).map(|index| self.reflectance(index))
    }
}

impl Encoding {
    pub const ALL: [Encoding; 2] = [Encoding::Linear, Encoding::Srgb];

    /// The name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Encoding::Linear => "linear",
            Encoding::Srgb => "srgb",
        }
    }

    /// The reflectance that each 8-bit value stands for.
    pub(crate) fn decoded_u8(self) -> &'static [f32] {
        static DECODED: [OnceLock<Vec<f32>>; 2] = [const { OnceLock::new() }; 2];
        DECODED[self as usize].get_or_init(|| self.decoded(u8::MAX.into()))
    }

    /// The reflectance that each 16-bit value stands for.
    pub(crate) fn decoded_u16(self) -> &'static [f32] {
        static DECODED: [OnceLock<Vec<f32>>; 2] = [const { OnceLock::new() }; 2];
        DECODED[self as usize].get_or_init(|| self.decoded(u16::MAX))
    }

    fn decoded(self, last: u16) -> Vec<f32> {
        let values = (0..=last).map(|value| f64::from(value) / f64::from(last));
        values.map(|value| self.decode(value)).collect()
    }

    /// Decodes a value from 0 to 1.
    pub(crate) fn decode(self, encoded: f64) -> f32 {
        match self {
            Encoding::Linear => encoded as f32,
            Encoding::Srgb => linear_from_srgb(encoded) as f32,
        }
    }
}

/// The sRGB transfer function, IEC 61966-2-1: encoded value 0 to 1 to linear value 0 to 1.
fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}
