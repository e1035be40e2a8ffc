//! Assembles one mesh from a checked OBJ file.

use std::path::Path;

use glam::DVec3;

use super::assets::{MeshRequest, Transform};
use super::obj_check::CheckedObj;
use crate::scene::{Mesh, unit_normal};
use crate::{Error, Result};

/// Assembles the whole file into one world-space mesh. Triangles keep the order of the file.
///
/// If some faces have normals and others have none, the others get separate vertices with the face normal, so that they stay flat.
/// `material_of_run` gives the material of each run of the file.
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
    let no_materials = |_: &Path| Ok(Default::default());
    let read = tobj::load_obj_buf(&mut checked.text.as_bytes(), &options, no_materials);
    let (models, _) = read.map_err(|error| {
        let problem = format!("not a mesh: {error}");
        Error::scene(
            request.path.display().to_string(),
            problem,
            "export it again",
        )
    })?;

    let Transform { rotation, .. } = request.transform;
    let any_normals = checked.runs.iter().any(|run| run.form.normals);
    let any_texcoords = checked.runs.iter().any(|run| run.form.texcoords);
    let mut mesh = Mesh {
        name: request.name.clone(),
        ..Mesh::default()
    };
    // Every run is one group with at least one face, and `tobj` keeps their order.
    let groups = models.iter().map(|model| &model.mesh);
    let groups = groups.filter(|group| !group.indices.is_empty());
    for ((group, run), &material) in groups.zip(&checked.runs).zip(material_of_run) {
        let is_flat = any_normals && !run.form.normals;
        let first = mesh.positions_m.len() as u32;
        let in_order = |count: usize| (0..count as u32).collect::<Vec<_>>();
        let (vertices, indices) = if is_flat {
            (group.indices.clone(), in_order(group.indices.len()))
        } else {
            (in_order(group.positions.len() / 3), group.indices.clone())
        };
        for vertex in vertices.into_iter().map(|vertex| vertex as usize) {
            let position = DVec3::from_slice(&group.positions[3 * vertex..]);
            mesh.positions_m.push(request.transform.place(position));
            if any_texcoords {
                // Faces without texture coordinates have an untextured material here, so the value is never read.
                let texcoord = group.texcoords.get(2 * vertex..2 * vertex + 2);
                let texcoord = texcoord.map_or([0.0; 2], |t| [t[0], t[1]]);
                mesh.texcoords.push(texcoord);
            }
        }
        let normals = group.normals.chunks_exact(3);
        let normals = normals.map(|normal| unit_normal(rotation, DVec3::from_slice(normal)));
        mesh.normals.extend(normals);
        for triangle in indices.chunks_exact(3) {
            let triangle = [0, 1, 2].map(|corner| first + triangle[corner]);
            if is_flat {
                let [a, b, c] = triangle.map(|vertex| mesh.positions_m[vertex as usize]);
                // A triangle without area is never seen, so any unit normal will do.
                let normal = (b - a).cross(c - a).try_normalize().unwrap_or(DVec3::Z);
                mesh.normals.extend([normal; 3]);
            }
            mesh.triangles.push(triangle);
            mesh.triangle_materials.push(material);
        }
    }
    Ok(mesh)
}
