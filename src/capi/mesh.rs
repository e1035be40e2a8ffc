//! Meshes, as they lie in the host's memory.

use std::ffi::c_char;

use glam::DVec3;

use super::*;
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

c_struct!(
    camlux_mesh, 152,
    positions_m: camlux_array::none(CAMLUX_FORMAT_F32),
    normals: camlux_array::none(CAMLUX_FORMAT_F32),
    texcoords: camlux_array::none(CAMLUX_FORMAT_F32),
    indices: camlux_array::none(CAMLUX_FORMAT_U32),
    triangle_materials: camlux_array::none(CAMLUX_FORMAT_U32),
);

/// Adds a mesh. It is seen once camlux_scene_add_instance has placed it. Its materials have to be there before it.
///
/// \param index receives its index; may be NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values that are not finite or too
/// large, and indices of vertices or materials that are not there; CAMLUX_ERROR_OUT_OF_MEMORY.
/// \threads any; calls for one scene take turns.
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

/// Puts another mesh in the place of one, for all of its instances: for bodies that deform, and to free what is no longer needed, by a mesh
/// without triangles.
///
/// \param index of the mesh that it replaces.
/// \errors as camlux_scene_add_mesh, and CAMLUX_ERROR_SCENE where an instance's pose takes the new mesh too far out.
/// \threads any; calls for one scene take turns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_mesh(
    scene: *mut camlux_scene,
    index: u32,
    mesh: *const camlux_mesh,
) -> camlux_status {
    ffi_guard("camlux_scene_set_mesh", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller's word.
        let mesh = unsafe { mesh_from_c(args::read(mesh)?) }?;
        let mut state = object.lock_to_change();
        part(&mut state.meshes, index, "mesh")?;
        mesh.validate(index as usize, state.scene.materials.len())?;
        let unplaced = UnplacedMesh::new(mesh.into());
        let instances = state.instances.iter().enumerate();
        for (place, instance) in instances.filter(|(_, i)| i.mesh == index as usize) {
            unplaced.validate(instance, place)?;
        }
        state.meshes[index as usize] = unplaced;
        Ok(())
    })
}

/// # Safety
/// The arrays are as long as the mesh says; the name is null or a C string.
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
    let normals = optional(&mesh.normals, vertices);
    let texcoords = optional(&mesh.texcoords, vertices);
    let vectors = |list: Vec<[f64; 3]>| list.into_iter().map(DVec3::from).collect();
    // SAFETY: the caller's word, for each of them.
    unsafe {
        let materials = &mesh.triangle_materials;
        let triangle_materials = if materials.data.is_null() {
            let mut uniform = args::room_for(triangles, "triangle_materials")?;
            uniform.resize(triangles, mesh.material);
            uniform
        } else {
            wholes::<1>(materials, "triangle_materials", triangles)?.into_flattened()
        };
        Ok(Mesh {
            name: args::text(mesh.name, "name")?.unwrap_or_default(),
            positions_m: vectors(reals(&mesh.positions_m, "positions_m", vertices)?),
            normals: vectors(reals(&mesh.normals, "normals", normals)?),
            texcoords: reals(&mesh.texcoords, "texcoords", texcoords)?,
            triangles: wholes(&mesh.indices, "indices", triangles)?,
            triangle_materials,
        })
    }
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn reals<const N: usize>(
    array: &camlux_array,
    name: &str,
    count: usize,
) -> Outcome<Vec<[f64; N]>> {
    let formats = args::choices![
        CAMLUX_FORMAT_F32 => converted::<f32, f64, N> as Reader<f64, N>,
        CAMLUX_FORMAT_F64 => converted::<f64, f64, N>,
    ];
    // SAFETY: the caller's word.
    unsafe { elements(array, name, count, &formats) }
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn wholes<const N: usize>(
    array: &camlux_array,
    name: &str,
    count: usize,
) -> Outcome<Vec<[u32; N]>> {
    let formats = args::choices![
        CAMLUX_FORMAT_U16 => converted::<u16, u32, N> as Reader<u32, N>,
        CAMLUX_FORMAT_U32 => converted::<u32, u32, N>,
    ];
    // SAFETY: the caller's word.
    unsafe { elements(array, name, count, &formats) }
}

/// Reads elements of one format.
type Reader<T, const N: usize> = unsafe fn(&Rows) -> Outcome<Vec<[T; N]>>;

/// # Safety
/// As for [`Rows::read`].
unsafe fn converted<C: Copy + Into<T>, T, const N: usize>(rows: &Rows) -> Outcome<Vec<[T; N]>> {
    // SAFETY: the caller's word.
    unsafe { rows.read(|row: &[C]| std::array::from_fn(|i| row[i].into())) }
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn elements<T, const N: usize>(
    array: &camlux_array,
    name: &str,
    count: usize,
    formats: &[(i32, &str, Reader<T, N>)],
) -> Outcome<Vec<[T; N]>> {
    if count == 0 {
        return Ok(Vec::new());
    }
    let read = args::one_of(&format!("the format of {name}"), array.format, formats)?;
    args::reserved(name, array.reserved)?;
    let rows = Rows {
        name,
        data: array.data,
        stride_bytes: array.stride_bytes,
        count,
        length: N,
    };
    // SAFETY: the caller's word.
    unsafe { read(&rows) }
}
