//! What scenes share, beside meshes: textures, and the patterns of lights. They never change once made.

use std::f64::consts::TAU;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

use camlux::scene::{self, Component, Encoding, Intrinsics, Shared, Texels, TextureSource};
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::BoundObject;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arguments::{needed, number, refuse, shown};
use crate::arrays::{as_array, list, numbers};
use crate::errors::{ArgumentTypeError, SceneError, SceneTypeError, raised, warn};

const NUMBERS: &str = "numbers";

/// For `__reduce__`: the object is made by its class from these arguments.
pub fn made_by_new<'py>(
    object: &Bound<'py, PyAny>,
    arguments: impl IntoPyObject<'py, Target = PyTuple, Error = PyErr>,
    keywords: Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyTuple>> {
    let py = object.py();
    let make = py.import("copyreg")?.getattr("__newobj_ex__")?;
    let arguments = arguments.into_pyobject(py)?.into_bound();
    let arguments = (object.get_type(), arguments, keywords).into_pyobject(py)?;
    (make, arguments).into_pyobject(py)
}

/// The name of an object that is made.
pub fn name_of(class: &str, name: Option<Bound<'_, PyAny>>) -> PyResult<String> {
    let name = needed(name, class, "name")?;
    name.extract().map_err(|_| {
        let shown = shown(&name);
        ArgumentTypeError::new_err(format!("{class}: name is {shown}; give a string"))
    })
}

fn hash_of(value: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

/// An array of this shape from its values.
pub fn array<'py, T: numpy::Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    Ok(values.into_pyarray(py).reshape(shape)?.into_any())
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
    #[pyo3(
        signature = (name=None, pixels=None, *, encoding=None, **others),
        text_signature = "(name, pixels, *, encoding=None)"
    )]
    fn new(
        name: Option<Bound<'_, PyAny>>,
        pixels: Option<Bound<'_, PyAny>>,
        encoding: Option<&str>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Texture> {
        refuse("Texture", others)?;
        let name = name_of("Texture", name)?;
        let pixels = needed(pixels, "Texture", "pixels")?;
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
            _ => Err(SceneTypeError::new_err(format!(
                "texture \"{name}\": pixels is an array of {kind}; give uint8, uint16 or floats"
            ))),
        }
    }

    /// Its name.
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

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let source = &slf.get().0;
        let texture = source.colors();
        let [width, height] = texture.size_px.map(|px| px as usize);
        let alpha = source.alpha();
        let shape = [height, width, if alpha.is_some() { 4 } else { 3 }];
        let pixels = match &texture.texels {
            Texels::U8(texels, _) => array(py, with_alpha(texels, alpha, |alpha| alpha), &shape)?,
            Texels::U16(texels, _) => {
                let alpha_of = |alpha| 257 * u16::from(alpha);
                array(py, with_alpha(texels, alpha, alpha_of), &shape)?
            }
            Texels::F32(texels) => {
                let alpha_of = |alpha| f32::from(alpha) / 255.0;
                array(py, with_alpha(texels, alpha, alpha_of), &shape)?
            }
        };
        let keywords = PyDict::new(py);
        if let Some(encoding) = source.encoding() {
            keywords.set_item("encoding", encoding.name())?;
        }
        made_by_new(slf.as_any(), (&texture.name, pixels), keywords)
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let other = other.cast::<Self>();
        other.is_ok_and(|other| self.0 == other.get().0)
    }

    fn __hash__(&self) -> u64 {
        let colors = self.0.colors();
        hash_of((&colors.name, colors.size_px))
    }
}

/// The components of pixels, with alpha if there is one.
fn with_alpha<C: Copy>(
    texels: &[[C; 3]],
    alpha: Option<&[u8]>,
    component: impl Fn(u8) -> C,
) -> Vec<C> {
    let Some(alpha) = alpha else {
        return texels.as_flattened().to_vec();
    };
    let pixels = texels.iter().zip(alpha);
    let pixels = pixels.map(|(&[r, g, b], &alpha)| [r, g, b, component(alpha)]);
    pixels.flatten().collect()
}

fn source<C: Component + numpy::Element>(
    (name, size_px, encoding): (String, [u32; 2], Option<Encoding>),
    pixels: &PyReadonlyArray3<C>,
) -> PyResult<Texture> {
    let channels = pixels.shape()[2];
    let pixels: Vec<C> = pixels.as_array().iter().copied().collect();
    let source = TextureSource::from_pixels(name, size_px, &pixels, channels, encoding);
    Ok(Texture(source.map_err(raised)?))
}

/// How integers encode values; `at`: the name of the object, for messages.
fn encoding_named(name: &str, at: &str) -> PyResult<Encoding> {
    let known = Encoding::ALL.into_iter().find(|known| known.name() == name);
    known.ok_or_else(|| {
        let problem = format!("{at}: encoding is \"{name}\"");
        SceneError::new_err(format!("{problem}; give \"srgb\" or \"linear\""))
    })
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
    #[pyo3(
        signature = (gammas_deg=None, planes_deg=None, intensities=None, **others),
        text_signature = "(gammas_deg, planes_deg, intensities)"
    )]
    fn new(
        gammas_deg: Option<Bound<'_, PyAny>>,
        planes_deg: Option<Bound<'_, PyAny>>,
        intensities: Option<Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Pattern> {
        refuse("Pattern", others)?;
        let needed = |value, name| needed(value, "Pattern", name);
        let angles = |value, name| list::<f64>(&needed(value, name)?, name, NUMBERS);
        let gammas = angles(gammas_deg, "gammas_deg")?;
        let planes = angles(planes_deg, "planes_deg")?;
        let intensities = as_array(&needed(intensities, "intensities")?)?;
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
    #[pyo3(
        signature = (path, *, encoding="srgb", **others),
        text_signature = "(path, *, encoding=\"srgb\")"
    )]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        encoding: &str,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Pattern> {
        refuse("Pattern.load", others)?;
        let at = path.display().to_string();
        let encoding = encoding_named(encoding, &at)?;
        let (pattern, warning) = scene::Pattern::load(&path, encoding, &at).map_err(raised)?;
        warn(py, warning.as_slice())?;
        Ok(Pattern(pattern.into()))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        // In radians, because degrees would round.
        let restore = py.import("camlux._camlux")?.getattr("restore_pattern")?;
        let scene::Pattern {
            gammas_rad,
            planes_rad,
            intensities,
            peak,
        } = &*slf.get().0;
        let [gammas, planes, intensities] =
            [gammas_rad, planes_rad, intensities].map(|values| values.clone().into_pyarray(py));
        (restore, (gammas, planes, intensities, *peak)).into_pyobject(py)
    }

    fn __repr__(&self) -> String {
        let (planes, gammas) = (self.0.planes_rad.len(), self.0.gammas_rad.len());
        format!("<camlux.Pattern {planes} planes x {gammas} angles>")
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let other = other.cast::<Self>();
        other.is_ok_and(|other| self.0 == other.get().0)
    }

    fn __hash__(&self) -> u64 {
        hash_of((self.0.planes_rad.len(), self.0.gammas_rad.len()))
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
    #[pyo3(
        signature = (values=None, *, fx=None, fy=None, cx=None, cy=None, **others),
        text_signature = "(values, *, fx, fy, cx, cy)"
    )]
    fn new(
        values: Option<Bound<'_, PyAny>>,
        fx: Option<Bound<'_, PyAny>>,
        fy: Option<Bound<'_, PyAny>>,
        cx: Option<Bound<'_, PyAny>>,
        cy: Option<Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        refuse("ProjectedImage", others)?;
        let needed = |value, name| needed(value, "ProjectedImage", name);
        let length = |value, name| number(&needed(value, name)?, name, "a number of pixels");
        let intrinsics = Intrinsics {
            fx: length(fx, "fx")?,
            fy: length(fy, "fy")?,
            cx: length(cx, "cx")?,
            cy: length(cy, "cy")?,
            skew: 0.0,
        };
        let array = as_array(&needed(values, "values")?)?;
        let &[height, width] = array.shape() else {
            let shape = array.shape();
            return Err(SceneError::new_err(format!(
                "values has the shape {shape:?}; give (height, width)"
            )));
        };
        let values: Vec<f64> = numbers(&array, "values", NUMBERS)?;
        let image = scene::ProjectedImage {
            size_px: [width as u32, height as u32],
            intrinsics,
            values: values.into_iter().map(|value| value as f32).collect(),
        };
        Ok(ProjectedImage(image.into()))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let image = &slf.get().0;
        let [width, height] = image.size_px.map(|px| px as usize);
        let values = array(py, image.values.clone(), &[height, width])?;
        let keywords = PyDict::new(py);
        let Intrinsics { fx, fy, cx, cy, .. } = image.intrinsics;
        for (name, value) in [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)] {
            keywords.set_item(name, value)?;
        }
        made_by_new(slf.as_any(), (values,), keywords)
    }

    fn __repr__(&self) -> String {
        let [width, height] = self.0.size_px;
        format!("<camlux.ProjectedImage {width} x {height}>")
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        let other = other.cast::<Self>();
        other.is_ok_and(|other| self.0 == other.get().0)
    }

    fn __hash__(&self) -> u64 {
        hash_of(self.0.size_px)
    }
}

/// For the pickle of a pattern.
#[pyfunction]
pub fn restore_pattern(
    gammas_rad: Vec<f64>,
    planes_rad: Vec<f64>,
    intensities: Vec<f64>,
    peak: f64,
) -> Pattern {
    let pattern = scene::Pattern {
        gammas_rad,
        planes_rad,
        intensities,
        peak,
    };
    Pattern(pattern.into())
}
