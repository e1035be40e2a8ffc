//! Triangle meshes.

use glam::DVec3;

use super::TextureLookup;

/// A triangle mesh in world space.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    pub name: String,
    /// World positions, metres.
    pub positions_m: Vec<DVec3>,
    /// One shading normal per position, any length but zero; empty: flat shading.
    pub normals: Vec<DVec3>,
    /// One (u, v) per position, v up; empty: the mesh shows no texture.
    pub texcoords: Vec<[f64; 2]>,
    /// A second set of texture coordinates, for textures that [`TextureLookup::texcoord_set`](super::TextureLookup::texcoord_set) has
    /// there; empty: none.
    pub texcoords_1: Vec<[f64; 2]>,
    /// One linear R, G, B per position, 0 to 1, which multiplies k_d and is interpolated; empty: white.
    pub colors: Vec<[f32; 3]>,
    /// One direction in which u grows per position, for normal maps, and 1 or −1: the sign of normal × tangent along v. Empty: they follow
    /// from the texture coordinates of the map.
    pub tangents: Vec<[f32; 4]>,
    /// Three indices into `positions_m` per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// One index into [`Scene::materials`](super::Scene::materials) per triangle.
    pub triangle_materials: Vec<u32>,
}

impl Mesh {
    /// A flat-shaded mesh of one material.
    pub fn from_slices(
        name: impl Into<String>,
        positions_m: &[[f64; 3]],
        triangles: &[[u32; 3]],
        material: u32,
    ) -> Self {
        Mesh {
            name: name.into(),
            positions_m: positions_m.iter().copied().map(DVec3::from).collect(),
            triangles: triangles.to_vec(),
            triangle_materials: vec![material; triangles.len()],
            ..Mesh::default()
        }
    }

    /// Whether the mesh has the texture coordinates of a lookup.
    pub fn shows(&self, lookup: &TextureLookup) -> bool {
        match lookup.texcoord_set {
            0 => !self.texcoords.is_empty(),
            _ => !self.texcoords_1.is_empty(),
        }
    }

    /// The texture coordinates of a lookup, for a vertex of a mesh that has them.
    pub fn texcoord(&self, lookup: &TextureLookup, vertex: u32) -> [f64; 2] {
        lookup.texcoord(match lookup.texcoord_set {
            0 => self.texcoords[vertex as usize],
            _ => self.texcoords_1[vertex as usize],
        })
    }

    /// The corners of each triangle. The mesh must belong to a validated scene.
    pub(super) fn corners_m(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let position_m = |vertex| self.positions_m[vertex as usize];
        self.triangles.iter().map(move |t| t.map(position_m))
    }
}
