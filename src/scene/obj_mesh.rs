//! Assembles one mesh from an OBJ file.

use std::collections::HashMap;

use glam::{DMat3, DVec3};

use super::Mesh;
use super::assets::{MeshRequest, Transform};
use super::obj::{Corner, FaceGroup, Obj};

/// The whole file as one world-space mesh, triangles in the order of the file.
///
/// Where some faces have normals and others have none, the others get vertices of their own with the face normal, so that
/// they stay flat. `material_of_group` gives a material per group of the file.
pub(super) fn assemble(obj: &Obj, material_of_group: &[u32], request: &MeshRequest) -> Mesh {
    let mut builder = MeshBuilder {
        mesh: Mesh {
            name: request.name.clone(),
            ..Mesh::default()
        },
        obj,
        transform: &request.transform,
        has_normals: obj.groups.iter().any(|group| group.form.normals),
        has_texcoords: obj.groups.iter().any(|group| group.form.texcoords),
    };
    for (group, &material) in obj.groups.iter().zip(material_of_group) {
        builder.add(group);
        let triangles = builder.mesh.triangles.len();
        builder.mesh.triangle_materials.resize(triangles, material);
    }
    builder.mesh
}

struct MeshBuilder<'a> {
    mesh: Mesh,
    obj: &'a Obj,
    transform: &'a Transform,
    /// Whether any face of the mesh has normals, or texture coordinates.
    has_normals: bool,
    has_texcoords: bool,
}

impl MeshBuilder<'_> {
    fn add(&mut self, group: &FaceGroup) {
        if self.has_normals && !group.form.normals {
            for triangle in &group.triangles {
                let vertices = triangle.map(|corner| self.push_vertex(corner));
                let [a, b, c] = vertices.map(|vertex| self.mesh.positions_m[vertex as usize]);
                // A triangle without area is never seen, so any unit normal will do.
                let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z);
                self.mesh.normals.extend([normal; 3]);
                self.mesh.triangles.push(vertices);
            }
            return;
        }
        let mut vertex_of_corner = HashMap::new();
        for triangle in &group.triangles {
            let vertices = triangle.map(|corner| {
                let vertex = vertex_of_corner.entry(corner);
                *vertex.or_insert_with(|| self.push_vertex(corner))
            });
            self.mesh.triangles.push(vertices);
        }
    }

    fn push_vertex(&mut self, corner: Corner) -> u32 {
        let Transform {
            scale,
            rotation,
            translation_m,
        } = *self.transform;
        let position = self.obj.positions[corner.position as usize];
        let vertex = self.mesh.positions_m.len() as u32;
        self.mesh
            .positions_m
            .push(rotation * (scale * position) + translation_m);
        if let Some(normal) = corner.normal {
            let normal = self.obj.normals[normal as usize];
            self.mesh.normals.push(unit_normal(rotation, normal));
        }
        if self.has_texcoords {
            // Faces without texture coordinates have an untextured material here, so the value is never read.
            let texcoord = corner.texcoord.map(|t| self.obj.texcoords[t as usize]);
            self.mesh.texcoords.push(texcoord.unwrap_or_default());
        }
        vertex
    }
}

/// Scaling is uniform and positive, so a normal only turns. Any length but zero becomes 1.
fn unit_normal(rotation: DMat3, normal: DVec3) -> DVec3 {
    // Without the division the square of a very short or long normal would leave the range of f64.
    (rotation * (normal / normal.abs().max_element())).normalize()
}
