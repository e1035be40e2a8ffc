//! Surface reflectance: modified Phong with an optional diffuse texture.

use super::Bands;
use super::Texels;

/// Modified Phong BRDF: f = k_d/π + k_s·(s+2)/(2π)·max(0, r·v)^s.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    /// k_d, diffuse reflectance per band, 0 to 1. Multiplied by the texture where there is one.
    pub kd: Bands,
    /// k_s, specular reflectance per band, 0 to 1.
    pub ks: Bands,
    /// s, the Phong exponent.
    pub shininess: f64,
    /// Index of the diffuse texture in [`Scene::textures`](super::Scene::textures).
    pub kd_texture: Option<usize>,
    /// Index of a normal map. Red, green and blue from 0 to 1 encode components of the shading normal from −1 to 1: along the direction in
    /// which u grows, along the one in which v grows, and along the mesh's normal.
    pub normal_texture: Option<usize>,
    /// Index of an alpha texture. Where its red value is below 0.5, the surface is cut out, on both sides. The value counts to 8 bits.
    pub alpha_texture: Option<usize>,
}

impl Material {
    /// A purely diffuse material.
    pub fn lambert(name: impl Into<String>, kd: Bands) -> Self {
        Material {
            name: name.into(),
            kd,
            ks: [0.0; 3],
            shininess: 1.0,
            kd_texture: None,
            normal_texture: None,
            alpha_texture: None,
        }
    }

    /// Whether the material has a texture of any kind.
    pub fn has_texture(&self) -> bool {
        let textures = [self.kd_texture, self.normal_texture, self.alpha_texture];
        textures.iter().any(Option::is_some)
    }

    /// Whether the material has a specular term.
    pub fn is_specular(&self) -> bool {
        self.ks.iter().any(|&ks| ks > 0.0)
    }
}

/// A texture of k_d, normals or alpha. It is sampled bilinearly, with repetition and without mip levels: pixels are point samples, as in
/// the reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    pub name: String,
    /// Width, height.
    pub size_px: [u32; 2],
    /// Row by row from the top (v = 1 − row/height, the OBJ convention); width × height texels.
    pub texels: Texels,
}
