//! Surface reflectance.

use std::slice;

use super::{Bands, MetallicRoughness, Texels, TextureRole};

/// Modified Phong BRDF: f = k_d/π + k_s·(s+2)/(2π)·max(0, r·v)^s. Or, if `microfacets` are given, a metallic-roughness surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    /// k_d, diffuse reflectance per band, 0 to 1. With microfacets, the base colour. Multiplied by the texture where there is one.
    pub kd: Bands,
    /// k_s, specular reflectance per band, 0 to 1.
    pub ks: Bands,
    /// s, the Phong exponent.
    pub shininess: f64,
    /// A surface of microfacets, which has no k_s and no exponent.
    pub microfacets: Option<MetallicRoughness>,
    /// Radiance that the surface emits in every direction, W/(sr·m²): a light. On both sides, or on the front of a one-sided surface.
    pub emission_w_sr_m2: Bands,
    /// Whether the camera looks through the surface where it sees it from behind. The front is the side on which the corners of a triangle
    /// turn counterclockwise. Light meets both sides.
    pub is_one_sided: bool,
    /// Multiplies k_d. [`TextureSource`](super::TextureSource) makes textures for any role.
    pub kd_texture: Option<TextureLookup>,
    /// Multiplies k_s.
    pub ks_texture: Option<TextureLookup>,
    /// Its red value multiplies s. Linear, as those below are.
    pub shininess_texture: Option<TextureLookup>,
    /// Its green value multiplies the roughness of microfacets, its blue value their metallic.
    pub metallic_roughness_texture: Option<TextureLookup>,
    /// Multiplies the emission. Its colours are decoded as those of k_d are.
    pub emission_texture: Option<TextureLookup>,
    /// A normal map. Red, green and blue from 0 to 1 encode components of the shading normal from −1 to 1: along the direction in
    /// which u grows, along the one in which v grows, and along the mesh's normal.
    pub normal_texture: Option<TextureLookup>,
    /// Where the red value of this texture is below `alpha_cutoff`, the surface is cut out, on both sides. The texels count to 8 bits.
    pub alpha_texture: Option<TextureLookup>,
    /// 0 to 1; 0.5 for most files.
    pub alpha_cutoff: f64,
}

/// Numbers of a material's BRDF: one, or one for each band.
pub(crate) struct Reflectance<'m> {
    /// The field of [`Material`], and the key in files.
    pub name: &'static str,
    pub values: &'m [f64],
    /// The largest value; the least is 0.
    pub most: f64,
    /// What to do about a value out of range.
    pub hint: &'static str,
}

/// The largest Phong exponent. Beyond it, a lobe is narrower than f32 directions can express.
const SHARPEST: f64 = 1e9;

/// A texture of a material, and how it is looked up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureLookup {
    /// Index in [`Scene::textures`](super::Scene::textures).
    pub texture: usize,
    /// 0: by [`Mesh::texcoords`](super::Mesh::texcoords); 1: by [`Mesh::texcoords_1`](super::Mesh::texcoords_1).
    pub texcoord_set: u32,
    /// The rows of the affine transform from (u, v, 1) of the mesh to (u, v) of the texture.
    pub transform: [[f64; 3]; 2],
    /// What is beyond 0 and 1, along u and v.
    pub wrap: [Wrap; 2],
    pub filter: Filter,
}

/// What a texture shows beyond its edges.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Wrap {
    #[default]
    Repeat,
    /// Repeats, every second time mirrored.
    Mirror,
    /// The texels at the edge.
    Clamp,
}

/// How a value between texels is found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Filter {
    #[default]
    Bilinear,
    Nearest,
}

impl Wrap {
    pub const ALL: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

    /// The name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Wrap::Repeat => "repeat",
            Wrap::Mirror => "mirror",
            Wrap::Clamp => "clamp",
        }
    }
}

impl Filter {
    pub const ALL: [Filter; 2] = [Filter::Bilinear, Filter::Nearest];

    /// The name in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Filter::Bilinear => "bilinear",
            Filter::Nearest => "nearest",
        }
    }
}

impl TextureLookup {
    pub const IDENTITY: [[f64; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    /// Whether it is by the mesh's first texture coordinates as they are.
    pub fn is_direct(&self) -> bool {
        self.texcoord_set == 0 && self.transform == TextureLookup::IDENTITY
    }

    /// The texture's coordinates for those of the mesh.
    pub fn texcoord(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.transform.map(|[a, b, c]| a * u + b * v + c)
    }
}

impl From<usize> for TextureLookup {
    /// The texture of this index, repeated and bilinear.
    fn from(texture: usize) -> Self {
        TextureLookup {
            texture,
            texcoord_set: 0,
            transform: TextureLookup::IDENTITY,
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Bilinear,
        }
    }
}

impl Material {
    /// A purely diffuse material.
    pub fn lambert(name: impl Into<String>, kd: Bands) -> Self {
        Material {
            name: name.into(),
            kd,
            ks: [0.0; 3],
            shininess: 1.0,
            microfacets: None,
            emission_w_sr_m2: [0.0; 3],
            is_one_sided: false,
            kd_texture: None,
            ks_texture: None,
            shininess_texture: None,
            metallic_roughness_texture: None,
            emission_texture: None,
            normal_texture: None,
            alpha_texture: None,
            alpha_cutoff: 0.5,
        }
    }

    /// All textures of the material, with their roles.
    pub fn textures(&self) -> impl Iterator<Item = (TextureRole, TextureLookup)> + use<> {
        let given = |(role, lookup): (_, Option<_>)| Some((role, lookup?));
        self.by_role().into_iter().filter_map(given)
    }

    /// The texture of each role.
    pub fn by_role(&self) -> [(TextureRole, Option<TextureLookup>); 7] {
        [
            (TextureRole::Kd, self.kd_texture),
            (TextureRole::Ks, self.ks_texture),
            (TextureRole::Shininess, self.shininess_texture),
            (
                TextureRole::MetallicRoughness,
                self.metallic_roughness_texture,
            ),
            (TextureRole::Emission, self.emission_texture),
            (TextureRole::Normal, self.normal_texture),
            (TextureRole::Alpha, self.alpha_texture),
        ]
    }

    pub fn by_role_mut(&mut self) -> [(TextureRole, &mut Option<TextureLookup>); 7] {
        [
            (TextureRole::Kd, &mut self.kd_texture),
            (TextureRole::Ks, &mut self.ks_texture),
            (TextureRole::Shininess, &mut self.shininess_texture),
            (
                TextureRole::MetallicRoughness,
                &mut self.metallic_roughness_texture,
            ),
            (TextureRole::Emission, &mut self.emission_texture),
            (TextureRole::Normal, &mut self.normal_texture),
            (TextureRole::Alpha, &mut self.alpha_texture),
        ]
    }

    /// The numbers of the BRDF, in the order of files.
    pub(crate) fn reflectance(&self) -> [Reflectance<'_>; 3] {
        // Without `..`: hashes and files of scenes have what is here, the microfacets, the emission, the side, the textures, and the cutoff.
        let Material {
            name: _,
            kd,
            ks,
            shininess,
            microfacets: _,
            emission_w_sr_m2: _,
            is_one_sided: _,
            kd_texture: _,
            ks_texture: _,
            shininess_texture: _,
            metallic_roughness_texture: _,
            emission_texture: _,
            normal_texture: _,
            alpha_texture: _,
            alpha_cutoff: _,
        } = self;
        let reflectance = |name, values| Reflectance {
            name,
            values,
            most: 1.0,
            hint: "give reflectances from 0 to 1",
        };
        [
            reflectance("kd", kd),
            reflectance("ks", ks),
            Reflectance {
                name: "shininess",
                values: slice::from_ref(shininess),
                most: SHARPEST,
                hint: "give a Phong exponent of 0 or more, up to 1e9",
            },
        ]
    }

    /// Whether the material has a texture of any kind.
    pub fn has_texture(&self) -> bool {
        self.textures().next().is_some()
    }

    /// Whether the material emits light.
    pub fn is_emissive(&self) -> bool {
        self.emission_w_sr_m2 != [0.0; 3]
    }

    /// Whether the material has a specular lobe.
    pub fn is_specular(&self) -> bool {
        self.microfacets.is_some() || self.ks.iter().any(|&ks| ks > 0.0)
    }
}

/// An image of values of surfaces. It has no mip levels: pixels are point samples, as in the reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    pub name: String,
    /// Width, height.
    pub size_px: [u32; 2],
    /// Row by row from the top (v = 1 − row/height, the OBJ convention); width × height texels.
    pub texels: Texels,
}
