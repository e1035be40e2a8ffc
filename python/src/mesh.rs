//! Meshes. They never change once made.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::OnceLock;

use camlux::glam::{DAffine3, DQuat, DVec3};
use camlux::scene::{self, Instance, MeshFile, MeshOptions, Shared};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arguments::{count, is_bool, needed, number, refuse, shown};
use crate::arrays::{list, rows, view};
use crate::errors::{SceneError, raised, warn};
use crate::objects::materials;
use crate::parts::{made_by_new, name_of};

const NUMBERS: &str = "numbers";
const INDICES: &str = "whole numbers from 0 to 4294967295";

/// A triangle mesh in world space. It never changes: `posed` returns a new mesh that shares its data.
///
/// Shape, unit:
///     positions_m: (vertices, 3), m.
///     triangles: (triangles, 3), indices of vertices. Surfaces have two sides. The winding matters only to normal maps on a mesh without
///         normals: their front is the side on which the corners turn counterclockwise.
///     material: the index of a scene's material for all triangles, or (triangles,), one index for each.
///     normals: (vertices, 3), of any length except zero; None: flat shading.
///     texcoords: (vertices, 2), u and v, v up; None: the mesh shows no textures.
///     texcoords_1: (vertices, 2), a second set, for `TextureLookup.texcoord_set`; None: none.
///     colors: (vertices, 3), linear, 0 to 1, which multiply kd and are interpolated; None: white.
///     tangents: (vertices, 4), a unit vector along u for normal maps, and 1 or -1: the sign of normal x tangent along v; None: they follow
///         from the texture coordinates.
#[pyclass(module = "camlux", frozen)]
pub struct Mesh {
    pub instance: Instance,
    /// Created on the first access to its arrays.
    placed: OnceLock<Shared<scene::Mesh>>,
    /// The mesh in its own space: one object for all meshes that share their arrays, so that a pickle has the arrays once.
    own: OnceLock<Py<Mesh>>,
}

impl From<Instance> for Mesh {
    fn from(instance: Instance) -> Self {
        Mesh {
            instance,
            placed: OnceLock::new(),
            own: OnceLock::new(),
        }
    }
}

/// The objects for instances, which know which of them share their arrays.
pub fn meshes<'py>(py: Python<'py>, instances: &[Instance]) -> PyResult<Vec<Bound<'py, Mesh>>> {
    let mut owns: HashMap<usize, Py<Mesh>> = HashMap::new();
    let one = |instance: &Instance| {
        let mesh = Bound::new(py, Mesh::from(instance.clone()))?;
        let address = std::ptr::from_ref::<scene::Mesh>(&instance.mesh).addr();
        match owns.get(&address) {
            Some(own) => {
                // Just made, and so without one.
                let _ = mesh.get().own.set(own.clone_ref(py));
            }
            None => {
                owns.insert(address, Mesh::own(&mesh)?);
            }
        }
        Ok(mesh)
    };
    instances.iter().map(one).collect()
}

impl Mesh {
    fn placed(&self) -> &scene::Mesh {
        self.placed.get_or_init(|| self.instance.placed())
    }

    /// Whether the mesh is where its arrays say, under the name that they have.
    fn is_own(&self) -> bool {
        self.instance.is_in_world_space() && self.instance.name == self.instance.mesh.name
    }

    fn own(slf: &Bound<'_, Mesh>) -> PyResult<Py<Mesh>> {
        let mesh = slf.get();
        if let Some(own) = mesh.own.get() {
            return Ok(own.clone_ref(slf.py()));
        }
        if mesh.is_own() {
            return Ok(slf.clone().unbind());
        }
        let own = Mesh::from(Instance::from(mesh.instance.mesh.clone()));
        let own = Py::new(slf.py(), own)?;
        Ok(mesh.own.get_or_init(|| own).clone_ref(slf.py()))
    }
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(
        signature = (
            name=None, positions_m=None, triangles=None, material=None, *,
            normals=None, texcoords=None, texcoords_1=None, colors=None, tangents=None, **others
        ),
        text_signature = "(name, positions_m, triangles, material=None, *, \
            normals=None, texcoords=None, texcoords_1=None, colors=None, tangents=None)"
    )]
    #[expect(clippy::too_many_arguments, reason = "Python's keywords")]
    fn new(
        name: Option<Bound<'_, PyAny>>,
        positions_m: Option<Bound<'_, PyAny>>,
        triangles: Option<Bound<'_, PyAny>>,
        material: Option<Bound<'_, PyAny>>,
        normals: Option<Bound<'_, PyAny>>,
        texcoords: Option<Bound<'_, PyAny>>,
        texcoords_1: Option<Bound<'_, PyAny>>,
        colors: Option<Bound<'_, PyAny>>,
        tangents: Option<Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Mesh> {
        refuse("Mesh", others)?;
        let name: String = name_of("Mesh", name)?;
        let positions_m = needed(positions_m, "Mesh", "positions_m")?;
        let triangles = needed(triangles, "Mesh", "triangles")?;
        let at = |array: &str| format!("mesh \"{name}\": {array}");
        let vectors = |value: &Bound<'_, PyAny>, array: &str| -> PyResult<Vec<DVec3>> {
            let rows = rows::<f64, 3>(value, &at(array), NUMBERS)?;
            Ok(rows.into_iter().map(DVec3::from).collect())
        };
        let triangles = rows::<u32, 3>(&triangles, &at("triangles"), INDICES)?;
        let triangle_materials = match &material {
            None => vec![0; triangles.len()],
            Some(material) => match material.extract() {
                Ok(one) if !is_bool(material) => vec![one; triangles.len()],
                _ => list(material, &at("material"), INDICES)?,
            },
        };
        let normals = normals.map(|value| vectors(&value, "normals"));
        let texcoords = texcoords.map(|value| rows(&value, &at("texcoords"), NUMBERS));
        let texcoords_1 = texcoords_1.map(|value| rows(&value, &at("texcoords_1"), NUMBERS));
        let colors = colors.map(|value| rows(&value, &at("colors"), NUMBERS));
        let tangents = tangents.map(|value| rows(&value, &at("tangents"), NUMBERS));
        let mesh = scene::Mesh {
            positions_m: vectors(&positions_m, "positions_m")?,
            normals: normals.transpose()?.unwrap_or_default(),
            texcoords: texcoords.transpose()?.unwrap_or_default(),
            texcoords_1: texcoords_1.transpose()?.unwrap_or_default(),
            colors: colors.transpose()?.unwrap_or_default(),
            tangents: tangents.transpose()?.unwrap_or_default(),
            triangles,
            triangle_materials,
            name,
        };
        Ok(Instance::from(mesh).into())
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.instance.name
    }

    /// Number of vertices.
    #[getter]
    fn vertex_count(&self) -> usize {
        self.instance.positions_m.len()
    }

    /// Number of triangles.
    #[getter]
    fn triangle_count(&self) -> usize {
        self.instance.triangles.len()
    }

    /// World positions, (vertices, 3), m.
    #[getter]
    fn positions_m<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        vectors(slf, &slf.get().placed().positions_m)
    }

    /// Shading normals, (vertices, 3); (0, 3): flat shading.
    #[getter]
    fn normals<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        vectors(slf, &slf.get().placed().normals)
    }

    /// u and v, (vertices, 2); (0, 2): the mesh has none.
    #[getter]
    fn texcoords<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        elements(slf, slf.get().placed().texcoords.as_flattened(), 2)
    }

    /// The second u and v, (vertices, 2); (0, 2): the mesh has none.
    #[getter]
    fn texcoords_1<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        elements(slf, slf.get().placed().texcoords_1.as_flattened(), 2)
    }

    /// Red, green and blue, which multiply kd, (vertices, 3); (0, 3): white.
    #[getter]
    fn colors<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        elements(slf, slf.get().placed().colors.as_flattened(), 3)
    }

    /// Tangents and signs, (vertices, 4); (0, 4): the mesh has none.
    #[getter]
    fn tangents<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        elements(slf, slf.get().placed().tangents.as_flattened(), 4)
    }

    /// Indices of vertices, (triangles, 3).
    #[getter]
    fn triangles<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        elements(slf, slf.get().placed().triangles.as_flattened(), 3)
    }

    /// The index of each triangle's material, (triangles,).
    #[getter]
    fn triangle_materials<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let materials = &slf.get().placed().triangle_materials;
        Ok(view(materials, &[materials.len()], slf.clone().into_any())?.into_any())
    }

    /// The mesh rotated about the world's origin by the unit quaternion x, y, z, w, and then moved.
    #[pyo3(
        signature = (position_m=None, orientation_xyzw=None, **others),
        text_signature = "($self, position_m=(0, 0, 0), orientation_xyzw=(0, 0, 0, 1))"
    )]
    fn posed<'py>(
        slf: &Bound<'py, Self>,
        position_m: Option<Bound<'py, PyAny>>,
        orientation_xyzw: Option<Bound<'py, PyAny>>,
        others: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, Mesh>> {
        refuse("Mesh.posed", others)?;
        fn numbers<const N: usize>(value: &Bound<'_, PyAny>, name: &str) -> PyResult<[f64; N]> {
            value.extract().map_err(|_| {
                SceneError::new_err(format!("{name} is {}; give {N} numbers", shown(value)))
            })
        }
        let position_m = position_m.map(|value| numbers::<3>(&value, "position_m"));
        let position_m = position_m.transpose()?.unwrap_or_default();
        let orientation = orientation_xyzw.map(|value| numbers::<4>(&value, "orientation_xyzw"));
        let orientation_xyzw = orientation.transpose()?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let orientation = DQuat::from_array(orientation_xyzw);
        let length = orientation.length();
        // A larger deviation is not a rounding error.
        if length.is_nan() || (length - 1.0).abs() > 1e-3 {
            return Err(SceneError::new_err(format!(
                "orientation_xyzw is {orientation_xyzw:?}, of length {length}; give a unit quaternion, x y z w"
            )));
        }
        let orientation = orientation.normalize();
        let instance = &slf.get().instance;
        let posed = Mesh::from(instance.posed(orientation, position_m.into()));
        // Just made, and so without one.
        let _ = posed.own.set(Mesh::own(slf)?);
        Bound::new(slf.py(), posed)
    }

    /// Reads a glTF, OBJ, PLY or STL file: the meshes (of a glTF file one for each node), and the materials that they use.
    ///
    /// material: the index of a scene's material for all triangles, which PLY and STL files need; None: those of the file, and the first of
    /// them has the index first_material. scale: multiplies all lengths. flat: ignores the file's normals.
    ///
    /// Raises SceneError with file and line. Shows a CamluxWarning for what is left out, such as lights.
    #[staticmethod]
    #[pyo3(signature = (path, material=None, *, first_material=None, scale=None, flat=false, **others),
           text_signature = "(path, material=None, *, first_material=0, scale=1.0, flat=False)")]
    fn load<'py>(
        py: Python<'py>,
        path: PathBuf,
        material: Option<Bound<'py, PyAny>>,
        first_material: Option<Bound<'py, PyAny>>,
        scale: Option<Bound<'py, PyAny>>,
        flat: bool,
        others: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Vec<Bound<'py, Mesh>>, Bound<'py, PyAny>)> {
        refuse("Mesh.load", others)?;
        let index = |value: Option<Bound<'_, PyAny>>, name| {
            value.map(|value| count(&value, name)).transpose()
        };
        let scale = scale.map(|scale| number(&scale, "scale", "a number"));
        let options = MeshOptions {
            scale: scale.transpose()?.unwrap_or(1.0),
            flat,
            material: index(material, "material")?,
            first_material: index(first_material, "first_material")?.unwrap_or_default(),
        };
        let file = py
            .detach(|| MeshFile::load(&path, options))
            .map_err(raised)?;
        let mut left_out = file.left_out;
        if !file.lights.is_empty() {
            left_out.push(format!(
                "{}: its lights are left out; a scene file that names the mesh has them",
                path.display()
            ));
        }
        warn(py, &left_out)?;
        let materials = materials(py, &file.materials, file.textures)?;
        Ok((meshes(py, &file.meshes)?, materials.into_any()))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let mesh = slf.get();
        let own = Self::own(slf)?;
        if !own.is(slf) {
            let place = py.import("camlux._camlux")?.getattr("place_mesh")?;
            let to_world = mesh.instance.to_world.to_cols_array();
            let arguments = (own, mesh.name(), to_world.to_vec());
            return (place, arguments).into_pyobject(py);
        }
        let arguments = (
            mesh.name(),
            Self::positions_m(slf)?,
            Self::triangles(slf)?,
            Self::triangle_materials(slf)?,
        );
        let keywords = PyDict::new(py);
        for (name, array) in [
            ("normals", Self::normals(slf)?),
            ("texcoords", Self::texcoords(slf)?),
            ("texcoords_1", Self::texcoords_1(slf)?),
            ("colors", Self::colors(slf)?),
            ("tangents", Self::tangents(slf)?),
        ] {
            if array.len()? > 0 {
                keywords.set_item(name, array)?;
            }
        }
        made_by_new(slf.as_any(), arguments, keywords)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let other = other.cast::<Mesh>();
        other.is_ok_and(|other| self.instance == other.get().instance)
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (self.name(), self.vertex_count(), self.triangle_count()).hash(&mut hasher);
        hasher.finish()
    }

    fn __repr__(&self) -> String {
        let (triangles, name) = (self.triangle_count(), &self.instance.name);
        format!("<camlux.Mesh {name:?}, {triangles} triangles>")
    }
}

/// For the pickle of a mesh: places a mesh of its own space by the columns of a 3 x 4 matrix.
#[pyfunction]
pub fn place_mesh(own: &Bound<'_, Mesh>, name: String, to_world: [f64; 12]) -> PyResult<Mesh> {
    let placed = Mesh::from(Instance {
        name,
        mesh: own.get().instance.mesh.clone(),
        to_world: DAffine3::from_cols_array(&to_world),
    });
    // Just made, and so without one.
    let _ = placed.own.set(own.clone().unbind());
    Ok(placed)
}

/// An array that reads a mesh's own memory.
fn elements<'py, T: numpy::Element>(
    mesh: &Bound<'py, Mesh>,
    values: &[T],
    length: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let shape = [values.len() / length, length];
    Ok(view(values, &shape, mesh.clone().into_any())?.into_any())
}

fn vectors<'py>(mesh: &Bound<'py, Mesh>, values: &[DVec3]) -> PyResult<Bound<'py, PyAny>> {
    // Three numbers without padding.
    elements::<f64>(mesh, bytemuck::cast_slice(values), 3)
}
