//! Assembles one mesh from a checked OBJ file.

use glam::{DMat3, DVec3};

use super::Mesh;
use super::assets::{MeshRequest, Transform};
use super::obj_check::{CheckedObj, FaceGroup};
use crate::{Error, Result};

/// The whole file as one world-space mesh, triangles in the order of the file.
///
/// Where some faces have normals and others have none, the others get vertices of their own with the face normal, so that
/// they stay flat. `material_of_run` gives a material per run of the file.
pub(super) fn assemble(
    checked: &CheckedObj,
    material_of_run: &[u32],
    request: &MeshRequest,
) -> Result<Mesh> {
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ..tobj::LoadOptions::default()
    };
    let (models, _) = tobj::load_obj_buf(&mut checked.text.as_bytes(), &options, |_| {
        Ok(Default::default())
    })
    .map_err(|error| {
        Error::scene(
            request.path.display().to_string(),
            format!("not a mesh: {error}"),
            "export it again",
        )
    })?;

    let mut mesh = MeshBuilder {
        mesh: Mesh {
            name: request.name.clone(),
            ..Mesh::default()
        },
        transform: &request.transform,
        normals: checked.runs.iter().any(|run| run.form.normals),
        texcoords: checked.runs.iter().any(|run| run.form.texcoords),
    };
    // Every run is one group with at least one face, and `tobj` keeps their order.
    let groups = models.iter().filter(|model| !model.mesh.indices.is_empty());
    for ((group, run), &material) in groups.zip(&checked.runs).zip(material_of_run) {
        mesh.add(&group.mesh, run, material);
    }
    Ok(mesh.mesh)
}

struct MeshBuilder<'a> {
    mesh: Mesh,
    transform: &'a Transform,
    /// Whether any face of the mesh has normals, or texture coordinates.
    normals: bool,
    texcoords: bool,
}

impl MeshBuilder<'_> {
    fn add(&mut self, group: &tobj::Mesh, run: &FaceGroup, material: u32) {
        if self.normals && !run.form.normals {
            self.add_flat(group);
        } else {
            self.add_shared(group);
        }
        let triangles = self.mesh.triangles.len();
        self.mesh.triangle_materials.resize(triangles, material);
    }

    fn add_shared(&mut self, group: &tobj::Mesh) {
        let offset = self.mesh.positions_m.len() as u32;
        for vertex in 0..group.positions.len() / 3 {
            self.push_vertex(group, vertex);
        }
        let normals = group.normals.chunks_exact(3);
        self.mesh
            .normals
            .extend(normals.map(|n| unit_normal(self.transform.rotation, DVec3::from_slice(n))));
        let triangles = group.indices.chunks_exact(3);
        self.mesh
            .triangles
            .extend(triangles.map(|t| [t[0] + offset, t[1] + offset, t[2] + offset]));
    }

    fn add_flat(&mut self, group: &tobj::Mesh) {
        for triangle in group.indices.chunks_exact(3) {
            let first = self.mesh.positions_m.len();
            for &vertex in triangle {
                self.push_vertex(group, vertex as usize);
            }
            let [a, b, c] = [0, 1, 2].map(|i| self.mesh.positions_m[first + i]);
            // A triangle without area is never seen, so any unit normal will do.
            let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z);
            self.mesh.normals.extend([normal; 3]);
            self.mesh
                .triangles
                .push([0, 1, 2].map(|i| first as u32 + i));
        }
    }

    fn push_vertex(&mut self, group: &tobj::Mesh, vertex: usize) {
        let position = DVec3::from_slice(&group.positions[3 * vertex..]);
        let Transform {
            scale,
            rotation,
            translation_m,
        } = *self.transform;
        self.mesh
            .positions_m
            .push(rotation * (scale * position) + translation_m);
        if self.texcoords {
            // Faces without texture coordinates have an untextured material here, so the value is never read.
            let texcoord = group.texcoords.get(2 * vertex..2 * vertex + 2);
            let [u, v] = texcoord.map_or([0.0; 2], |t| [t[0], t[1]]);
            self.mesh.texcoords.push([u, v]);
        }
    }
}

/// Scaling is uniform and positive, so a normal only turns. Any length but zero becomes 1.
fn unit_normal(rotation: DMat3, normal: DVec3) -> DVec3 {
    // Without the division the square of a very short or long normal would leave the range of f64.
    (rotation * (normal / normal.abs().max_element())).normalize()
}
