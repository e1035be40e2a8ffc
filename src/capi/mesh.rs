//! Meshes, as they lie in the host's memory.

use std::{ffi::c_char, ptr};

use glam::DVec3;

use super::{
    abi::c_struct,
    args::{
        self, CAMLUX_FORMAT_F32, CAMLUX_FORMAT_F64, CAMLUX_FORMAT_U16, CAMLUX_FORMAT_U32,
        Component, Rows, camlux_array,
    },
    handle::{self, camlux_scene},
    instances::UnplacedMesh,
    scene::push,
    status::{Failure, Outcome, camlux_status, ffi_guard},
};
use crate::scene::Mesh;

/// Triangles in a space of their own, in metres. Begin with CAMLUX_MESH_INIT: no triangles, 32-bit formats.
///
/// The arrays are read where they lie, with their strides, and copied: they can be freed when camlux_scene_add_mesh returns.
/// Interleaved vertices are arrays that begin at different members of the first vertex and have its size as stride. Which way
/// round a triangle's corners go does not matter: surfaces have two sides.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_mesh {
    /// sizeof(camlux_mesh)
    pub struct_size: u32,
    /// The index of the material of all triangles, where triangle_materials has no data.
    pub material: u32,
    /// Elements of positions_m, normals and texcoords.
    pub vertex_count: usize,
    /// Elements of indices and triangle_materials.
    pub triangle_count: usize,
    /// x, y, z of each vertex, m; CAMLUX_FORMAT_F32 or CAMLUX_FORMAT_F64.
    pub positions_m: camlux_array,
    /// x, y, z of a normal for each vertex, of any length but zero; CAMLUX_FORMAT_F32 or CAMLUX_FORMAT_F64; data NULL: flat
    /// shading.
    pub normals: camlux_array,
    /// u, v for each vertex, v up; CAMLUX_FORMAT_F32 or CAMLUX_FORMAT_F64; data NULL: no texture can be seen.
    pub texcoords: camlux_array,
    /// Three indices of vertices for each triangle; CAMLUX_FORMAT_U16 or CAMLUX_FORMAT_U32. The stride is from triangle to
    /// triangle.
    pub indices: camlux_array,
    /// The index of a material for each triangle; CAMLUX_FORMAT_U16 or CAMLUX_FORMAT_U32; data NULL: `material` for all.
    pub triangle_materials: camlux_array,
    /// For messages, UTF-8; copied; NULL: none.
    pub name: *const c_char,
}

c_struct! { camlux_mesh, 152, {
    material: 0,
    vertex_count: 0,
    triangle_count: 0,
    positions_m: camlux_array::none(CAMLUX_FORMAT_F32),
    normals: camlux_array::none(CAMLUX_FORMAT_F32),
    texcoords: camlux_array::none(CAMLUX_FORMAT_F32),
    indices: camlux_array::none(CAMLUX_FORMAT_U32),
    triangle_materials: camlux_array::none(CAMLUX_FORMAT_U32),
    name: ptr::null(),
} }

/// Adds a mesh. It is seen once camlux_scene_add_instance has placed it. Its materials have to be there before it.
///
/// \param index receives its index; may be NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values that are not finite or too
/// large, and indices of vertices or materials that are not there; CAMLUX_ERROR_OUT_OF_MEMORY.
/// \threads any; calls for one scene take turns.
///
/// # Safety
/// `mesh` is NULL or points to as many bytes as its struct_size says; its arrays are as long as it says; its name is NULL or a
/// string that ends with a 0; `index` is NULL or points to a writable uint32_t.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_add_mesh(
    scene: *mut camlux_scene,
    mesh: *const camlux_mesh,
    index: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_scene_add_mesh", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller's word.
        unsafe {
            let mesh = mesh_from_c(args::read(mesh)?)?;
            object.add(index, |state| {
                mesh.validate(state.meshes.len(), state.scene.materials.len())?;
                push(&mut state.meshes, UnplacedMesh::new(mesh.into()), "mesh")
            })
        }
    })
}

/// # Safety
/// As for `camlux_scene_add_mesh`.
unsafe fn mesh_from_c(mesh: camlux_mesh) -> Outcome<Mesh> {
    let [vertices, triangles] = [mesh.vertex_count, mesh.triangle_count];
    for (what, count) in [("vertex_count", vertices), ("triangle_count", triangles)] {
        if count > u32::MAX as usize {
            return Err(Failure::argument(format!(
                "{what} is {count}, more than 32-bit indices can tell apart; split the mesh"
            )));
        }
    }
    let optional = |array: &camlux_array, count| if array.data.is_null() { 0 } else { count };
    let vectors = |list: Vec<[f64; 3]>| list.into_iter().map(DVec3::from).collect();
    let materials = &mesh.triangle_materials;
    // SAFETY: the caller's word, for each of them.
    unsafe {
        let materials: Vec<[u32; 1]> = wholes(
            materials,
            "triangle_materials",
            optional(materials, triangles),
        )?;
        Ok(Mesh {
            name: args::text(mesh.name, "name")?.unwrap_or_default(),
            positions_m: vectors(reals(&mesh.positions_m, "positions_m", vertices)?),
            normals: vectors(reals(
                &mesh.normals,
                "normals",
                optional(&mesh.normals, vertices),
            )?),
            texcoords: reals(
                &mesh.texcoords,
                "texcoords",
                optional(&mesh.texcoords, vertices),
            )?,
            triangles: wholes(&mesh.indices, "indices", triangles)?,
            triangle_materials: match mesh.triangle_materials.data.is_null() {
                true => uniform(mesh.material, triangles)?,
                false => materials.concat(),
            },
        })
    }
}

fn uniform(material: u32, count: usize) -> Outcome<Vec<u32>> {
    let mut materials = Vec::new();
    let room = materials.try_reserve_exact(count);
    room.map_err(|_| Failure::memory("triangle_materials", count))?;
    materials.resize(count, material);
    Ok(materials)
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn reals<const N: usize>(
    array: &camlux_array,
    name: &str,
    count: usize,
) -> Outcome<Vec<[f64; N]>> {
    if count == 0 {
        return Ok(Vec::new());
    }
    let formats = args::choices![
        CAMLUX_FORMAT_F32 => false,
        CAMLUX_FORMAT_F64 => true,
    ];
    let format = args::one_of(&format!("the format of {name}"), array.format, &formats)?;
    // SAFETY: the caller's word.
    unsafe {
        match format {
            false => elements(array, name, count, |value: f32| f64::from(value)),
            true => elements(array, name, count, |value: f64| value),
        }
    }
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn wholes<const N: usize>(
    array: &camlux_array,
    name: &str,
    count: usize,
) -> Outcome<Vec<[u32; N]>> {
    if count == 0 {
        return Ok(Vec::new());
    }
    let formats = args::choices![
        CAMLUX_FORMAT_U16 => false,
        CAMLUX_FORMAT_U32 => true,
    ];
    let format = args::one_of(&format!("the format of {name}"), array.format, &formats)?;
    // SAFETY: the caller's word.
    unsafe {
        match format {
            false => elements(array, name, count, |value: u16| u32::from(value)),
            true => elements(array, name, count, |value: u32| value),
        }
    }
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn elements<C: Component, T, const N: usize>(
    array: &camlux_array,
    name: &str,
    count: usize,
    convert: impl Fn(C) -> T,
) -> Outcome<Vec<[T; N]>> {
    args::reserved(name, array.reserved)?;
    let rows = Rows {
        name,
        data: array.data,
        stride_bytes: array.stride_bytes,
        count,
        length: N,
    };
    // SAFETY: the caller's word.
    unsafe { rows.read(|row: &[C]| std::array::from_fn(|i| convert(row[i]))) }
}
