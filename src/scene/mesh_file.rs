//! The content of a mesh file.

use super::{Instance, Light, Material, Shared, Texture};

/// The meshes of a file and what their triangles use. [`MeshFile::load`] reads it.
#[derive(Debug, Clone)]
pub struct MeshFile {
    pub meshes: Vec<Instance>,
    /// Their textures are indices into `textures`.
    pub materials: Vec<Material>,
    pub textures: Vec<Shared<Texture>>,
    /// Of a glTF file.
    pub lights: Vec<Light>,
    /// Features of the file that are not modelled, one sentence each.
    pub left_out: Vec<String>,
}

/// How a mesh file is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshOptions {
    /// Multiplies all lengths.
    pub scale: f64,
    /// Ignores the normals of the file.
    pub flat: bool,
    /// The material of every triangle. `None`: those of the file.
    pub material: Option<u32>,
    /// The number of the file's first material in [`Mesh::triangle_materials`](super::Mesh::triangle_materials).
    pub first_material: u32,
}

impl Default for MeshOptions {
    /// In metres, with the file's normals and materials.
    fn default() -> Self {
        MeshOptions {
            scale: 1.0,
            flat: false,
            material: None,
            first_material: 0,
        }
    }
}
