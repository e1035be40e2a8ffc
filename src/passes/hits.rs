//! What rays find on the scene's triangles, on the device: shading normals, texture coordinates and materials.

use super::surface::brdf_texels;
use crate::{
    Plan, Result, Scene,
    scene::{Shared, Texture},
    vulkan::{Allocate, CommandPool, Resource, TexelList},
};

/// The lists of `shaders/hits.wgsl`.
pub(crate) struct HitSurfaces {
    /// Sixteen words a triangle, in the order of the scene: three normals (0: flat), three texture coordinates, the material.
    triangles: TexelList,
    materials: TexelList,
    texels: TexelList,
}

/// What a scene's triangles and materials take.
pub(crate) fn declare(allocate: &impl Allocate, scene: &Scene) -> Result<()> {
    TexelList::declare(allocate, "shading of triangles", 4 * scene.triangle_count())?;
    // Each material with and without its texture, in three texels.
    TexelList::declare(allocate, "materials", 6 * scene.materials.len() as u64)
}

/// What a scene's textures take, all together.
pub(crate) fn declare_textures(allocate: &impl Allocate, scene: &Scene, plan: &Plan) -> Result<()> {
    let texels = |texture: &Shared<Texture>| {
        let [width, height] = texture.size_px.map(u64::from);
        width * height
    };
    let texels = scene.textures.iter().map(texels).sum();
    let texels = if plan.is_textured { texels } else { 0 };
    TexelList::declare(allocate, "textures that rays hit", texels)
}

impl HitSurfaces {
    /// Copies what a valid scene's surfaces are like.
    pub fn upload(commands: &CommandPool, scene: &Scene, plan: &Plan) -> Result<HitSurfaces> {
        let mut texels: Vec<[f32; 4]> = Vec::new();
        let mut first_texels = Vec::new();
        for texture in scene.textures.iter().filter(|_| plan.is_textured) {
            first_texels.push(texels.len() as u32);
            texels.extend(texture.linear_rgb.iter().map(|&[r, g, b]| [r, g, b, 1.0]));
        }
        let mut materials: Vec<[[f32; 4]; 3]> = scene
            .materials
            .iter()
            .map(|material| {
                let texture = material.kd_texture.filter(|_| plan.is_textured);
                let [width, height] = texture.map_or([0, 0], |i| scene.textures[i].size_px);
                let first_texel = texture.map_or(0, |index| first_texels[index]);
                let (kd, [kr, kg, kb, shininess]) = brdf_texels(material);
                [
                    [kd[0], kd[1], kd[2], shininess],
                    [kr, kg, kb, first_texel as f32],
                    [width as f32, height as f32, 0.0, 0.0],
                ]
            })
            .collect();
        // A mesh without texture coordinates shows its materials plain.
        let plain = materials.clone();
        materials.extend(plain.iter().map(|&[kd, ks, _]| [kd, ks, [0.0; 4]]));
        let mut triangles: Vec<[f32; 16]> = Vec::new();
        for mesh in &scene.meshes {
            let plain = if mesh.texcoords.is_empty() {
                scene.materials.len() as u32
            } else {
                0
            };
            for (corners, material) in mesh.triangles.iter().zip(&mesh.triangle_materials) {
                let mut words = [0.0; 16];
                for (i, &corner) in corners.iter().enumerate() {
                    if let Some(normal) = mesh.normals.get(corner as usize) {
                        let normal = normal.normalize_or_zero().as_vec3();
                        words[3 * i..3 * i + 3].copy_from_slice(&normal.to_array());
                    }
                    if let Some(texcoord) = mesh.texcoords.get(corner as usize) {
                        words[9 + 2 * i..11 + 2 * i].copy_from_slice(&texcoord.map(|c| c as f32));
                    }
                }
                words[15] = (material + plain) as f32;
                triangles.push(words);
            }
        }
        let words = triangles.as_flattened();
        let triangles = words.as_chunks().0.to_vec();
        Ok(HitSurfaces {
            triangles: TexelList::new(commands, "shading of triangles", triangles)?,
            materials: TexelList::new(commands, "materials", materials.into_flattened())?,
            texels: TexelList::new(commands, "textures that rays hit", texels)?,
        })
    }

    /// The images under the names that the shaders give them.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 3] {
        [
            ("triangle_shading", self.triangles.resource()),
            ("materials", self.materials.resource()),
            ("texels", self.texels.resource()),
        ]
    }
}
