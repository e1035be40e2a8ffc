//! Meshes as binary PLY files, bit by bit.

use std::collections::BTreeSet;

use crate::scene::Mesh;

/// The materials of a mesh, which its file numbers from 0.
pub(super) fn materials(mesh: &Mesh) -> Vec<u32> {
    let distinct: BTreeSet<u32> = mesh.triangle_materials.iter().copied().collect();
    distinct.into_iter().collect()
}

/// The file. Positions, normals and texture coordinates are f64, colours and tangents f32, as in memory.
pub(super) fn bytes(mesh: &Mesh, materials: &[u32]) -> Vec<u8> {
    // Destructured, so that no field is forgotten.
    let Mesh {
        name: _,
        positions_m,
        normals,
        texcoords,
        texcoords_1,
        colors,
        tangents,
        triangles,
        triangle_materials,
    } = mesh;
    let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
    let vertex_count = positions_m.len();
    header += &format!("element vertex {vertex_count}\n");
    for (names, kind, is_there) in [
        (&["x", "y", "z"][..], "double", true),
        (&["nx", "ny", "nz"], "double", !normals.is_empty()),
        (&["u", "v"], "double", !texcoords.is_empty()),
        (&["u2", "v2"], "double", !texcoords_1.is_empty()),
        (&["red", "green", "blue"], "float", !colors.is_empty()),
        (&["tx", "ty", "tz", "tw"], "float", !tangents.is_empty()),
    ] {
        for name in names.iter().filter(|_| is_there) {
            header += &format!("property {kind} {name}\n");
        }
    }
    header += &format!("element face {}\n", triangles.len());
    header += "property list uchar uint vertex_indices\nproperty uint material_index\nend_header\n";
    let mut bytes = header.into_bytes();
    let mut put = |values: &[u8]| bytes.extend_from_slice(values);
    for (vertex, position_m) in positions_m.iter().enumerate() {
        let mut doubles = |values: Option<&[f64]>| {
            let values = values.into_iter().flatten();
            values.for_each(|value| put(&value.to_le_bytes()));
        };
        doubles(Some(&position_m.to_array()));
        doubles(
            normals
                .get(vertex)
                .map(|n| n.to_array())
                .as_ref()
                .map(|n| &n[..]),
        );
        doubles(texcoords.get(vertex).map(|uv| &uv[..]));
        doubles(texcoords_1.get(vertex).map(|uv| &uv[..]));
        let mut floats = |values: Option<&[f32]>| {
            let values = values.into_iter().flatten();
            values.for_each(|value| put(&value.to_le_bytes()));
        };
        floats(colors.get(vertex).map(|color| &color[..]));
        floats(tangents.get(vertex).map(|tangent| &tangent[..]));
    }
    for (triangle, material) in triangles.iter().zip(triangle_materials) {
        put(&[3]);
        triangle.iter().for_each(|index| put(&index.to_le_bytes()));
        // Sorted, and every material is among them.
        let number = materials.binary_search(material).unwrap_or_default() as u32;
        put(&number.to_le_bytes());
    }
    bytes
}
