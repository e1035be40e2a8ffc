//! A triangle mesh under construction.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DVec3};

/// Triangles of one material.
#[derive(Clone, Default)]
pub struct Mesh {
    /// Metres, unless the scene file scales the mesh.
    pub positions: Vec<DVec3>,
    /// One unit vector per position; empty: flat shading.
    pub normals: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Both meshes must have normals, or neither.
    pub fn append(&mut self, other: Mesh) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        let moved = other.triangles.iter().map(|t| t.map(|index| first + index));
        self.triangles.extend(moved);
    }

    pub fn joined(meshes: impl IntoIterator<Item = Mesh>) -> Mesh {
        let mut all = Mesh::default();
        for mesh in meshes {
            all.append(mesh);
        }
        all
    }

    pub fn transformed(mut self, transform: DAffine3) -> Mesh {
        for position in &mut self.positions {
            *position = transform.transform_point3(*position);
        }
        let for_normals: DMat3 = transform.matrix3.inverse().transpose();
        for normal in &mut self.normals {
            *normal = (for_normals * *normal).normalize();
        }
        if transform.matrix3.determinant() < 0.0 {
            for [_, b, c] in &mut self.triangles {
                std::mem::swap(b, c);
            }
        }
        self
    }

    pub fn moved(self, x: f64, y: f64, z: f64) -> Mesh {
        self.transformed(DAffine3::from_translation(DVec3::new(x, y, z)))
    }

    /// Adds shading normals: at each vertex, the mean of the adjacent triangles' normals, weighted by area. Drops unused vertices.
    pub fn smooth(mut self) -> Mesh {
        self.drop_lone_vertices();
        self.normals = vec![DVec3::ZERO; self.positions.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|index| self.positions[index as usize]);
            for index in triangle {
                self.normals[*index as usize] += (b - a).cross(c - a);
            }
        }
        for normal in &mut self.normals {
            *normal = normal.normalize();
        }
        self
    }

    fn drop_lone_vertices(&mut self) {
        let mut new_indices = HashMap::new();
        let mut kept = Vec::new();
        for index in self.triangles.iter_mut().flatten() {
            let old = *index as usize;
            *index = *new_indices.entry(old).or_insert_with(|| {
                kept.push(self.positions[old]);
                kept.len() as u32 - 1
            });
        }
        self.positions = kept;
    }
}
