//! What scenes share: meshes, textures, and the patterns of lights. They never change once made.

use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::OnceLock;

use camlux::glam::{DQuat, DVec3};
use camlux::scene::{self, Component, Encoding, Instance, Intrinsics, Shared, TextureSource};
use numpy::{PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{as_array, list, numbers, rows, view};
use crate::errors::{SceneError, raised, warn};

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
}

impl From<Instance> for Mesh {
    fn from(instance: Instance) -> Self {
        let placed = OnceLock::new();
        Mesh { instance, placed }
    }
}

impl Mesh {
    fn placed(&self) -> &scene::Mesh {
        self.placed.get_or_init(|| self.instance.placed())
    }
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (
        name, positions_m, triangles, material=None, *,
        normals=None, texcoords=None, texcoords_1=None, colors=None, tangents=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "Python's keywords")]
    fn new(
        name: String,
        positions_m: Bound<'_, PyAny>,
        triangles: Bound<'_, PyAny>,
        material: Option<Bound<'_, PyAny>>,
        normals: Option<Bound<'_, PyAny>>,
        texcoords: Option<Bound<'_, PyAny>>,
        texcoords_1: Option<Bound<'_, PyAny>>,
        colors: Option<Bound<'_, PyAny>>,
        tangents: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Mesh> {
        let at = |array: &str| format!("mesh \"{name}\": {array}");
        let vectors = |value: &Bound<'_, PyAny>, array: &str| -> PyResult<Vec<DVec3>> {
            let rows = rows::<f64, 3>(value, &at(array), NUMBERS)?;
            Ok(rows.into_iter().map(DVec3::from).collect())
        };
        let triangles = rows::<u32, 3>(&triangles, &at("triangles"), INDICES)?;
        let triangle_materials = match &material {
            None => vec![0; triangles.len()],
            Some(material) => match material.extract() {
                Ok(one) => vec![one; triangles.len()],
                Err(_) => list(material, &at("material"), INDICES)?,
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

    #[getter]
    fn name(&self) -> &str {
        &self.instance.name
    }

    #[getter]
    fn vertex_count(&self) -> usize {
        self.instance.positions_m.len()
    }

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
    #[pyo3(signature = (position_m=[0.0; 3], orientation_xyzw=[0.0, 0.0, 0.0, 1.0]))]
    fn posed(&self, position_m: [f64; 3], orientation_xyzw: [f64; 4]) -> PyResult<Mesh> {
        let orientation = DQuat::from_array(orientation_xyzw);
        let length = orientation.length();
        // A larger deviation is not a rounding error.
        if length.is_nan() || (length - 1.0).abs() > 1e-3 {
            return Err(SceneError::new_err(format!(
                "orientation_xyzw is {orientation_xyzw:?}, of length {length}; give a unit quaternion, x y z w"
            )));
        }
        let orientation = orientation.normalize();
        Ok(self.instance.posed(orientation, position_m.into()).into())
    }

    fn __repr__(&self) -> String {
        let (triangles, name) = (self.triangle_count(), &self.instance.name);
        format!("<camlux.Mesh {name:?}, {triangles} triangles>")
    }
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

/// An image for surfaces: (height, width) or (height, width, 1, 3 or 4), top row first. uint8, uint16, or floats from 0 to 1.
///
/// What a material uses it for decides how it is read. As `kd_texture` and `ks_texture`, integers are sRGB. As `normal_texture`,
/// `shininess_texture` and `alpha_texture` they are linear, as floats always are. `encoding` says otherwise: "linear", or "srgb", which is an
/// error where values are linear.
///
/// A fourth channel is alpha. It is linear, and only `alpha_texture` uses it.
#[pyclass(module = "camlux", frozen)]
pub struct Texture(pub TextureSource);

#[pymethods]
impl Texture {
    #[new]
    #[pyo3(signature = (name, pixels, *, encoding=None))]
    fn new(name: String, pixels: Bound<'_, PyAny>, encoding: Option<&str>) -> PyResult<Texture> {
        let wrong = |problem: String| SceneError::new_err(format!("texture \"{name}\": {problem}"));
        let array = as_array(&pixels)?;
        let pixels = match array.ndim() {
            2 => array.call_method1("reshape", ((array.shape()[0], array.shape()[1], 1),))?,
            _ => array.clone().into_any(),
        };
        let named = |encoding| encoding_named(encoding, &format!("texture \"{name}\""));
        let encoding = encoding.map(named).transpose()?;
        let shape = as_array(&pixels)?.shape().to_vec();
        let &[height, width, 1 | 3 | 4] = &shape[..] else {
            return Err(wrong(format!(
                "pixels has the shape {shape:?}; give (height, width), (height, width, 3), or (height, width, 4) with alpha"
            )));
        };
        let of = (name.clone(), [width as u32, height as u32], encoding);
        if let Ok(pixels) = pixels.extract::<PyReadonlyArray3<u8>>() {
            return source(of, &pixels);
        }
        if let Ok(pixels) = pixels.extract::<PyReadonlyArray3<u16>>() {
            return source(of, &pixels);
        }
        let kind = array.dtype().to_string();
        let pixels = pixels.call_method1("astype", ("float32",))?;
        match pixels.extract::<PyReadonlyArray3<f32>>() {
            Ok(pixels) if kind.starts_with("float") => source(of, &pixels),
            _ => Err(wrong(format!(
                "pixels is an array of {kind}; give uint8, uint16 or floats"
            ))),
        }
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.colors().name
    }

    /// Width, height.
    #[getter]
    fn size_px(&self) -> (u32, u32) {
        self.0.colors().size_px.into()
    }

    fn __repr__(&self) -> String {
        let ([width, height], name) = (self.0.colors().size_px, &self.0.colors().name);
        format!("<camlux.Texture {name:?}, {width} x {height}>")
    }
}

fn source<C: Component + numpy::Element>(
    (name, size_px, encoding): (String, [u32; 2], Option<Encoding>),
    pixels: &PyReadonlyArray3<C>,
) -> PyResult<Texture> {
    let channels = pixels.shape()[2];
    let pixels: Vec<C> = pixels.as_array().iter().copied().collect();
    let source = TextureSource::from_pixels(name, size_px, (&pixels, channels), encoding);
    Ok(Texture(source.map_err(raised)?))
}

/// How integers encode values; `at`: the name of the object, for messages.
fn encoding_named(name: &str, at: &str) -> PyResult<Encoding> {
    match name {
        "srgb" => Ok(Encoding::Srgb),
        "linear" => Ok(Encoding::Linear),
        other => Err(SceneError::new_err(format!(
            "{at}: encoding is \"{other}\"; give \"srgb\" or \"linear\""
        ))),
    }
}

/// The measured radiant intensity of a lamp over all directions, in the C-γ system of the CIE.
///
/// Shape, unit:
///     gammas_deg: (n,), increasing, 0 to 180: angles from the direction of the lamp's axis.
///     planes_deg: (m,), increasing from 0 to 360; the intensities of 0 and 360 are the same.
///     intensities: (m, n), 0 or more; only their ratios matter.
#[pyclass(module = "camlux", frozen)]
pub struct Pattern(pub Shared<scene::Pattern>);

#[pymethods]
impl Pattern {
    #[new]
    fn new(
        gammas_deg: Bound<'_, PyAny>,
        planes_deg: Bound<'_, PyAny>,
        intensities: Bound<'_, PyAny>,
    ) -> PyResult<Pattern> {
        let gammas: Vec<f64> = list(&gammas_deg, "gammas_deg", NUMBERS)?;
        let planes: Vec<f64> = list(&planes_deg, "planes_deg", NUMBERS)?;
        let intensities = as_array(&intensities)?;
        if intensities.shape() != [planes.len(), gammas.len()] {
            let shape = intensities.shape();
            let due = [planes.len(), gammas.len()];
            return Err(SceneError::new_err(format!(
                "intensities has the shape {shape:?}; give (planes, gammas), which is {due:?}"
            )));
        }
        let intensities: Vec<f64> = numbers(&intensities, "intensities", NUMBERS)?;
        let peak = intensities.iter().copied().fold(0.0, f64::max);
        let radians = |degrees: Vec<f64>| degrees.into_iter().map(f64::to_radians).collect();
        let is_whole = planes.last() == Some(&360.0);
        let mut planes_rad: Vec<f64> = radians(planes);
        if is_whole && let Some(last) = planes_rad.last_mut() {
            *last = TAU;
        }
        let pattern = scene::Pattern {
            gammas_rad: radians(gammas),
            planes_rad,
            intensities: intensities.into_iter().map(|value| value / peak).collect(),
            peak,
        };
        Ok(Pattern(pattern.into()))
    }

    /// Reads an IES (.ies) or EULUMDAT (.ldt) file, or a map of all directions (.png, .exr).
    #[staticmethod]
    #[pyo3(signature = (path, *, encoding="srgb"))]
    fn load(py: Python<'_>, path: PathBuf, encoding: &str) -> PyResult<Pattern> {
        let at = path.display().to_string();
        let encoding = encoding_named(encoding, &at)?;
        let (pattern, warning) = scene::Pattern::load(&path, encoding, &at).map_err(raised)?;
        warn(py, warning.as_slice())?;
        Ok(Pattern(pattern.into()))
    }
}

/// The image of a projector: (height, width), 0 to 1, relative irradiance of a screen perpendicular to its axis.
///
/// The lens is a camera lens: focal lengths and principal point, pixels.
#[pyclass(module = "camlux", frozen)]
pub struct ProjectedImage(pub Shared<scene::ProjectedImage>);

#[pymethods]
impl ProjectedImage {
    #[new]
    #[pyo3(signature = (values, *, fx, fy, cx, cy))]
    fn new(values: Bound<'_, PyAny>, fx: f64, fy: f64, cx: f64, cy: f64) -> PyResult<Self> {
        let array = as_array(&values)?;
        let &[height, width] = array.shape() else {
            let shape = array.shape();
            return Err(SceneError::new_err(format!(
                "values has the shape {shape:?}; give (height, width)"
            )));
        };
        let values: Vec<f64> = numbers(&array, "values", NUMBERS)?;
        let image = scene::ProjectedImage {
            size_px: [width as u32, height as u32],
            intrinsics: Intrinsics { fx, fy, cx, cy },
            values: values.into_iter().map(|value| value as f32).collect(),
        };
        Ok(ProjectedImage(image.into()))
    }
}
