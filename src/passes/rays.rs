//! The scene's triangles on the device for rays.

use glam::Vec3;

use super::surface::SurfaceLists;
use crate::{
    Plan, Result,
    bvh::Bvh,
    scene::Scene,
    vulkan::{Buffer, Device, Resource, shaders::Material},
};

/// The tree of boxes and its triangles.
pub(crate) struct RayTriangles {
    nodes: Buffer,
    triangles: Buffer,
    pub node_count: u32,
    /// Where rays bring back what they hit.
    shading: Option<RayShading>,
}

/// What a ray finds on a triangle.
struct RayShading {
    /// Sixteen words a triangle, in the order of the leaves: normals, texture coordinates, material.
    triangles: Buffer,
    materials: Buffer,
    texels: Buffer,
}

impl RayTriangles {
    /// Builds the tree; `None` where nothing casts rays.
    pub fn for_plan(
        device: &Device,
        scene: &Scene,
        plan: &Plan,
        lists: &SurfaceLists,
    ) -> Result<Option<RayTriangles>> {
        if !plan.has_rays() {
            return Ok(None);
        }
        let corner = |&index: &u32| {
            let [x, y, z, _] = lists.positions[index as usize];
            Vec3::new(x, y, z)
        };
        let (triangles, _) = lists.indices.as_chunks::<3>();
        let corners: Vec<[Vec3; 3]> = triangles
            .iter()
            .map(|corners| corners.each_ref().map(corner))
            .collect();
        let bvh = Bvh::over(&corners);
        let shading = (plan.bounce().is_some())
            .then(|| RayShading::upload(device, scene, plan, lists, &bvh.sources))
            .transpose()?;
        Ok(Some(RayTriangles {
            nodes: Buffer::upload(device, "tree of boxes", &bvh.nodes)?,
            triangles: Buffer::upload(device, "triangles for rays", &bvh.triangles)?,
            node_count: bvh.nodes.len() as u32,
            shading,
        }))
    }

    /// The buffers under the names that the shaders give them.
    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![
            ("nodes", Resource::Buffer(&self.nodes)),
            ("ray_triangles", Resource::Buffer(&self.triangles)),
        ];
        if let Some(shading) = &self.shading {
            resources.extend([
                ("triangle_shading", Resource::Buffer(&shading.triangles)),
                ("materials", Resource::Buffer(&shading.materials)),
                ("texels", Resource::Buffer(&shading.texels)),
            ]);
        }
        resources
    }
}

impl RayShading {
    fn upload(
        device: &Device,
        scene: &Scene,
        plan: &Plan,
        lists: &SurfaceLists,
        sources: &[u32],
    ) -> Result<RayShading> {
        let mut first_texels = Vec::new();
        let mut texels: Vec<[f32; 4]> = Vec::new();
        for texture in scene.textures.iter().filter(|_| plan.is_textured) {
            first_texels.push(texels.len() as u32);
            texels.extend(texture.linear_rgb.iter().map(|&[r, g, b]| [r, g, b, 1.0]));
        }
        let materials: Vec<Material> = lists
            .ranges
            .iter()
            .map(|range| {
                let texture = range.texture.map(|index| {
                    let [width, height] = scene.textures[index].size_px;
                    [first_texels[index], width, height]
                });
                let [first_texel, width, height] = texture.unwrap_or_default();
                Material {
                    kd: range.draw.kd,
                    shininess: range.draw.shininess,
                    ks: range.draw.ks,
                    first_texel,
                    width,
                    height,
                    ..Material::default()
                }
            })
            .collect();
        let mut material_of: Vec<u32> = Vec::new();
        for (index, range) in lists.ranges.iter().enumerate() {
            material_of.extend((0..range.triangle_count).map(|_| index as u32));
        }
        let triangles: Vec<[f32; 16]> = sources
            .iter()
            .map(|&triangle| {
                let mut words = [0.0; 16];
                for corner in 0..3 {
                    let vertex = lists.indices[3 * triangle as usize + corner] as usize;
                    if let Some(normal) = lists.normals.get(vertex) {
                        words[3 * corner..3 * corner + 3].copy_from_slice(&normal[..3]);
                    }
                    if let Some(texcoord) = lists.texcoords.get(vertex) {
                        words[9 + 2 * corner..11 + 2 * corner].copy_from_slice(texcoord);
                    }
                }
                words[15] = f32::from_bits(material_of[triangle as usize]);
                words
            })
            .collect();
        Ok(RayShading {
            triangles: Buffer::upload(device, "shading of triangles", &triangles)?,
            materials: Buffer::upload(device, "materials", &materials)?,
            texels: Buffer::upload(device, "texels", &texels)?,
        })
    }
}
