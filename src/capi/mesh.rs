//! Meshes, read from the host's memory.

use std::ffi::c_char;

use glam::DVec3;

use super::*;
use crate::scene::Mesh;

/// Triangles in their own space, in metres. Initialise with CAMLUX_MESH_INIT: no triangles, 32-bit formats.
///
/// The arrays are read in place, with their strides, and copied. You can free them when camlux_scene_add_mesh returns.
/// For interleaved vertices, let the arrays begin at different members of the first vertex, and use its size as the stride. The
/// order of a triangle's corners does not matter: surfaces have two sides.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct camlux_mesh {
    /// Set by CAMLUX_MESH_INIT.
    pub struct_size: u32,
    /// The index of the material of all triangles, if triangle_materials has no data.
    pub material: u32,
    /// Number of elements of positions_m, normals and texcoords.
    pub vertex_count: usize,
    /// Number of elements of indices and triangle_materials.
    pub triangle_count: usize,
    /// x, y, z of each vertex, m; CAMLUX_FORMAT_F32 or CAMLUX_FORMAT_F64.
    pub positions_m: camlux_array,
    /// x, y, z of a normal for each vertex, of any length but zero; CAMLUX_FORMAT_F32 or CAMLUX_FORMAT_F64; data NULL: flat
    /// shading.
    pub normals: camlux_array,
    /// u, v for each vertex, v up; CAMLUX_FORMAT_F32 or CAMLUX_FORMAT_F64; data NULL: textures are not visible.
    pub texcoords: camlux_array,
    /// Three indices of vertices for each triangle; CAMLUX_FORMAT_U16 or CAMLUX_FORMAT_U32. The stride is from triangle to
    /// triangle.
    pub indices: camlux_array,
    /// The index of a material for each triangle; CAMLUX_FORMAT_U16 or CAMLUX_FORMAT_U32; data NULL: `material` for all.
    pub triangle_materials: camlux_array,
    /// Name for messages, UTF-8, copied; NULL: none.
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

/// Adds a mesh. It becomes visible when camlux_scene_add_instance places it. Its materials must exist already.
///
/// \param index receives its index; may be NULL.
/// \errors CAMLUX_ERROR_INVALID_HANDLE; CAMLUX_ERROR_INVALID_ARGUMENT; CAMLUX_ERROR_SCENE for values that are not finite or too
/// large, and for indices of vertices or materials that do not exist; CAMLUX_ERROR_OUT_OF_MEMORY.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_add_mesh(
    scene: *mut camlux_scene,
    mesh: *const camlux_mesh,
    index: *mut u32,
) -> camlux_status {
    ffi_guard("camlux_scene_add_mesh", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
        unsafe {
            let mesh = mesh_from_c(args::read(mesh)?)?;
            object.add(index, |state| {
                mesh.validate(state.meshes.len(), state.scene.materials.len())?;
                push(&mut state.meshes, UnplacedMesh::new(mesh.into()), "mesh")
            })
        }
    })
}

/// Replaces a mesh in all of its instances. Use it for bodies that deform. To free a mesh that is no longer needed, replace it by one without
/// triangles.
///
/// \param index of the mesh to replace.
/// \errors as camlux_scene_add_mesh, and CAMLUX_ERROR_SCENE if an instance's pose moves the new mesh too far out.
/// \threads any; calls on the same scene are serialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn camlux_scene_set_mesh(
    scene: *mut camlux_scene,
    index: u32,
    mesh: *const camlux_mesh,
) -> camlux_status {
    ffi_guard("camlux_scene_set_mesh", || {
        let object = handle::get(scene)?;
        // SAFETY: the caller guarantees it.
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
/// The arrays have the lengths that the mesh states; the name is null or a C string.
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
    let of_vertices = |value| Count {
        name: "vertex_count",
        value,
    };
    let of_triangles = Count {
        name: "triangle_count",
        value: triangles,
    };
    let normals = of_vertices(optional(&mesh.normals, vertices));
    let texcoords = of_vertices(optional(&mesh.texcoords, vertices));
    let vectors = |list: Vec<[f64; 3]>| list.into_iter().map(DVec3::from).collect();
    // SAFETY: the caller guarantees it for each array.
    unsafe {
        let materials = &mesh.triangle_materials;
        let triangle_materials = if materials.data.is_null() {
            let mut uniform = args::room_for(triangles, "triangle_materials")?;
            uniform.resize(triangles, mesh.material);
            uniform
        } else {
            wholes::<1>(materials, "triangle_materials", of_triangles)?.into_flattened()
        };
        Ok(Mesh {
            name: args::text(mesh.name, "camlux_mesh.name")?.unwrap_or_default(),
            positions_m: vectors(reals(
                &mesh.positions_m,
                "positions_m",
                of_vertices(vertices),
            )?),
            normals: vectors(reals(&mesh.normals, "normals", normals)?),
            texcoords: reals(&mesh.texcoords, "texcoords", texcoords)?,
            triangles: wholes(&mesh.indices, "indices", of_triangles)?,
            triangle_materials,
            ..Mesh::default()
        })
    }
}

/// How many elements an array has, and the member of `camlux_mesh` that says so.
#[derive(Clone, Copy)]
struct Count {
    name: &'static str,
    value: usize,
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn reals<const N: usize>(
    array: &camlux_array,
    name: &str,
    count: Count,
) -> Outcome<Vec<[f64; N]>> {
    let formats = args::choices![
        CAMLUX_FORMAT_F32 => converted::<f32, f64, N> as Reader<f64, N>,
        CAMLUX_FORMAT_F64 => converted::<f64, f64, N>,
    ];
    // SAFETY: the caller guarantees it.
    unsafe { elements(array, name, count, &formats) }
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn wholes<const N: usize>(
    array: &camlux_array,
    name: &str,
    count: Count,
) -> Outcome<Vec<[u32; N]>> {
    let formats = args::choices![
        CAMLUX_FORMAT_U16 => converted::<u16, u32, N> as Reader<u32, N>,
        CAMLUX_FORMAT_U32 => converted::<u32, u32, N>,
    ];
    // SAFETY: the caller guarantees it.
    unsafe { elements(array, name, count, &formats) }
}

/// Reads elements of one format.
type Reader<T, const N: usize> = unsafe fn(&Rows) -> Outcome<Vec<[T; N]>>;

/// # Safety
/// As for [`Rows::read`].
unsafe fn converted<C: Copy + Into<T>, T, const N: usize>(rows: &Rows) -> Outcome<Vec<[T; N]>> {
    // SAFETY: the caller guarantees it.
    unsafe { rows.read(|row: &[C]| std::array::from_fn(|i| row[i].into())) }
}

/// # Safety
/// As for [`Rows::read`].
unsafe fn elements<T, const N: usize>(
    array: &camlux_array,
    name: &str,
    count: Count,
    formats: &[(i32, &str, Reader<T, N>)],
) -> Outcome<Vec<[T; N]>> {
    if count.value == 0 {
        return Ok(Vec::new());
    }
    let name = &format!("camlux_mesh.{name}");
    let read = args::one_of(&format!("the format of {name}"), array.format, formats)?;
    args::reserved(name, array.reserved)?;
    let rows = Rows {
        name,
        count_name: count.name,
        data: array.data,
        stride_bytes: array.stride_bytes,
        count: count.value,
        length: N,
    };
    // SAFETY: the caller guarantees it.
    unsafe { read(&rows) }
}
