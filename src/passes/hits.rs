//! What rays find on the scene's triangles, on the device: shading normals, texture coordinates and materials.

use crate::{
    Plan, Result, Scene,
    vulkan::{Buffer, Device, Resource, shaders::Material},
};

/// The buffers of `shaders/hits.wgsl`.
pub(crate) struct HitSurfaces {
    /// Sixteen words a triangle, in the order of the scene: three normals (0: flat), three texture coordinates, the material.
    triangles: Buffer,
    materials: Buffer,
    texels: Buffer,
}

impl HitSurfaces {
    /// Copies what a valid scene's surfaces are like.
    pub fn upload(device: &Device, scene: &Scene, plan: &Plan) -> Result<HitSurfaces> {
        let mut texels: Vec<[f32; 4]> = Vec::new();
        let mut first_texels = Vec::new();
        for texture in scene.textures.iter().filter(|_| plan.is_textured) {
            first_texels.push(texels.len() as u32);
            texels.extend(texture.linear_rgb.iter().map(|&[r, g, b]| [r, g, b, 1.0]));
        }
        let materials: Vec<Material> = scene
            .materials
            .iter()
            .map(|material| {
                let texture = material.kd_texture.filter(|_| plan.is_textured);
                let [width, height] = texture.map_or([0, 0], |i| scene.textures[i].size_px);
                Material {
                    kd: material.kd.map(|kd| kd as f32),
                    shininess: material.shininess as f32,
                    ks: material.ks.map(|ks| ks as f32),
                    first_texel: texture.map_or(0, |index| first_texels[index]),
                    width,
                    height,
                    ..Material::default()
                }
            })
            .collect();
        // A mesh without texture coordinates shows its materials plain.
        let plain = materials.iter().map(|material| Material {
            width: 0,
            ..*material
        });
        let materials: Vec<Material> = materials.iter().copied().chain(plain).collect();
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
                words[15] = f32::from_bits(material + plain);
                triangles.push(words);
            }
        }
        Ok(HitSurfaces {
            triangles: Buffer::upload(device, "shading of triangles", &triangles)?,
            materials: Buffer::upload(device, "materials", &materials)?,
            texels: Buffer::upload(device, "texels", &texels)?,
        })
    }

    /// The buffers under the names that the shaders give them.
    pub fn resources(&self) -> [(&'static str, Resource<'_>); 3] {
        [
            ("triangle_shading", Resource::Buffer(&self.triangles)),
            ("materials", Resource::Buffer(&self.materials)),
            ("texels", Resource::Buffer(&self.texels)),
        ]
    }
}
