//! What rays find on the scene's triangles, on the device: shading normals, texture coordinates and materials.

use std::sync::Arc;

use super::{materials::Materials, rays::RayTriangles, textures::Textures};
use crate::{
    Result, Scene,
    geometry::{Geometry, GeometrySize, PlacedMesh},
    vulkan::{Allocate, Buffer, CommandPool, Resource, TexelList},
};

/// The lists of `shaders/shared/hits.wgsl`.
pub(crate) struct HitSurfaces {
    /// Sixteen words per triangle, in the order of the geometry: three normals (0: flat), three texture coordinates, the entry of the material.
    triangles: TexelList,
    materials: Arc<Materials>,
    textures: Arc<Textures>,
    /// For each mesh in the scene's space: the number of triangles up to its end, and its instance id.
    mesh_ends: Arc<Buffer>,
    placed_count: u32,
}

/// The triangles that rays hit, and their shading.
#[derive(Clone, Copy)]
pub(crate) struct HitScene<'s> {
    pub tree: &'s RayTriangles,
    pub surfaces: &'s HitSurfaces,
}

impl<'s> HitScene<'s> {
    /// All lists with their names in the shaders.
    pub fn resources(self) -> Vec<(&'static str, Resource<'s>)> {
        let mut resources = self.tree.resources();
        resources.extend(self.surfaces.resources());
        resources
    }
}

/// Declares the memory for a scene's triangles and materials.
pub(crate) fn declare(allocate: &impl Allocate, scene: &Scene) -> Result<()> {
    let size = GeometrySize::of(scene);
    allocate.uploaded_buffer("ends of meshes", 8 * size.meshes)?;
    TexelList::declare(allocate, "shading of triangles", 4 * size.triangles)
}

impl HitSurfaces {
    /// Copies the shading data of a scene's surfaces to the device.
    pub fn upload(
        commands: &CommandPool,
        geometry: &Geometry,
        textures: &Arc<Textures>,
        materials: &Arc<Materials>,
    ) -> Result<HitSurfaces> {
        let mut triangles: Vec<[f32; 16]> = Vec::new();
        for (index, mesh) in geometry.meshes().enumerate() {
            for (corners, &material) in mesh.triangles.iter().zip(&mesh.triangle_materials) {
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
                words[15] = materials.entry(index, material) as f32;
                triangles.push(words);
            }
        }
        let mut end = 0;
        let mesh_ends = geometry
            .placed
            .iter()
            .map(|PlacedMesh { index, mesh, .. }| {
                end += mesh.triangles.len() as u32;
                [end, 1 + *index as u32]
            });
        let mesh_ends: Vec<[u32; 2]> = mesh_ends.collect();
        let words = triangles.as_flattened();
        let triangles = words.as_chunks().0.to_vec();
        Ok(HitSurfaces {
            textures: textures.clone(),
            placed_count: mesh_ends.len() as u32,
            mesh_ends: commands.upload("ends of meshes", &mesh_ends)?,
            triangles: TexelList::new(commands, "shading of triangles", triangles)?,
            materials: materials.clone(),
        })
    }

    /// The list that gives the mesh of a triangle in the scene's space, and its length.
    pub fn mesh_ends(&self) -> (Resource<'_>, u32) {
        (Resource::Buffer(&self.mesh_ends), self.placed_count)
    }

    /// The images with their names in the shaders.
    pub fn resources(&self) -> Vec<(&'static str, Resource<'_>)> {
        let mut resources = vec![("triangle_shading", self.triangles.resource())];
        resources.extend(self.materials.resources());
        resources.extend(self.textures.resource());
        resources
    }
}
