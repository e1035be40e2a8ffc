//! What frames and image files have in common: they are mappings from the names of layers to arrays.

use std::sync::{Arc, Mutex};

use camlux::output::{self, Layer, LayerData, LayeredImage};
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::view;
use crate::errors::{ArgumentError, LayerError, not_copied};

/// Where a frame that is no longer used leaves its buffers for the next one.
pub type Returned = Arc<Mutex<Option<output::Frame>>>;

/// A mapping from the names of layers to arrays, (height, width) or (height, width, channels): a frame, or an OpenEXR image.
#[pyclass(module = "camlux", frozen, mapping, subclass)]
pub struct Layers(Source);

pub enum Source {
    Frame {
        /// Present until it is dropped.
        frame: Option<Box<output::Frame>>,
        returned: Option<Returned>,
    },
    Image(LayeredImage),
}

impl Layers {
    pub fn of_frame(frame: output::Frame, returned: Option<Returned>) -> Self {
        Layers(Source::Frame {
            frame: Some(frame.into()),
            returned,
        })
    }

    pub fn of_image(image: LayeredImage) -> Self {
        Layers(Source::Image(image))
    }

    pub fn frame(&self) -> PyResult<&output::Frame> {
        match &self.0 {
            Source::Frame {
                frame: Some(frame), ..
            } => Ok(frame),
            _ => Err(ArgumentError::new_err("the frame is gone")),
        }
    }

    /// The image of a file; `None` for a frame.
    pub fn image(&self) -> Option<&LayeredImage> {
        match &self.0 {
            Source::Image(image) => Some(image),
            Source::Frame { .. } => None,
        }
    }

    fn class(&self) -> &'static str {
        match &self.0 {
            Source::Frame { .. } => "frame",
            Source::Image(_) => "image",
        }
    }

    pub fn names(&self) -> PyResult<Vec<&str>> {
        Ok(match self.image() {
            Some(image) => image.layers().iter().map(|l| l.name.as_str()).collect(),
            None => {
                let layers = self.frame()?.layers.iter();
                layers.map(|(layer, _)| layer.name()).collect()
            }
        })
    }
}

impl Drop for Layers {
    fn drop(&mut self) {
        if let Source::Frame {
            frame,
            returned: Some(returned),
        } = &mut self.0
            && let Ok(mut returned) = returned.lock()
        {
            *returned = frame.take().map(|frame| *frame);
        }
    }
}

#[pymethods]
impl Layers {
    fn __getitem__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let layers = slf.get();
        let owner = || slf.clone().into_any();
        let (width, height) = layers.resolution_px()?;
        let shape = |channels: usize| {
            let pixels = [height as usize, width as usize];
            [&pixels[..], &[channels][..usize::from(channels > 1)]].concat()
        };
        if let Some(image) = layers.image() {
            if let Some(layer) = image.layer(name) {
                let shape = shape(layer.channel_names.len());
                if !Layer::from_name(name).is_some_and(Layer::is_id) {
                    return Ok(view(&layer.values, &shape, owner())?.into_any());
                }
                let ids = layer.values.iter().map(|&id| id as u32);
                let ids = ids.collect::<Vec<_>>().into_pyarray(slf.py());
                let ids = ids.reshape(shape)?;
                return Ok(ids.readwrite().make_nonwriteable().as_any().clone());
            }
        } else {
            let mut of_frame = layers.frame()?.layers.iter();
            if let Some((layer, data)) = of_frame.find(|(layer, _)| layer.name() == name) {
                let shape = shape(layer.channel_names().len());
                return Ok(match data {
                    LayerData::Float(values) => view(values, &shape, owner())?.into_any(),
                    LayerData::Id(ids) => view(ids, &shape, owner())?.into_any(),
                });
            }
        }
        Err(LayerError::new_err(format!(
            "the {} has no layer \"{name}\"; it has {}",
            layers.class(),
            layers.names()?.join(", ")
        )))
    }

    fn __contains__(&self, name: &str) -> PyResult<bool> {
        Ok(self.names()?.contains(&name))
    }

    fn __len__(&self) -> PyResult<usize> {
        Ok(self.names()?.len())
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let names = self.names()?.into_pyobject(py)?;
        Ok(names.try_iter()?.into_any())
    }

    /// The names of the layers.
    fn keys(&self) -> PyResult<Vec<&str>> {
        self.names()
    }

    /// Names and arrays of the layers.
    fn items<'py>(slf: &Bound<'py, Self>) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
        let names = slf.get().names()?.into_iter();
        let items = names.map(|name| Ok((name.to_owned(), Self::__getitem__(slf, name)?)));
        items.collect()
    }

    /// The arrays of the layers.
    fn values<'py>(slf: &Bound<'py, Self>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        let names = slf.get().names()?.into_iter();
        names.map(|name| Self::__getitem__(slf, name)).collect()
    }

    /// The array of a layer, or the default if there is no such layer.
    #[pyo3(signature = (name, default=None, /))]
    fn get<'py>(
        slf: &Bound<'py, Self>,
        name: &str,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        match slf.get().__contains__(name)? {
            true => Self::__getitem__(slf, name).map(Some),
            false => Ok(default),
        }
    }

    /// The unit of each layer: W/sr/m^2, m, J, px, or 1 for a plain number. An image file has it for the layers that its header names.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let units = PyDict::new(py);
        if let Some(image) = self.image() {
            for name in self.names()? {
                if let Some(unit) = image.attribute(&format!("camlux.unit.{name}")) {
                    units.set_item(name, unit)?;
                }
            }
        } else {
            let frame = self.frame()?;
            for (layer, _) in &frame.layers {
                units.set_item(layer.name(), layer.unit_by(frame.description.tof.as_ref()))?;
            }
        }
        Ok(units)
    }

    /// Width, height.
    #[getter]
    fn resolution_px(&self) -> PyResult<(u32, u32)> {
        Ok(match self.image() {
            Some(image) => image.resolution_px(),
            None => self.frame()?.resolution_px,
        }
        .into())
    }

    /// The surface points that the pixels show, with their colours: camlux.Points. It needs the layers P and radiance.
    fn points<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf, "points")
    }

    /// For notebooks: the radiance as a PNG file; None without that layer.
    fn _repr_png_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf, "png")
    }

    /// For notebooks: the picture, and a table of the layers and errors.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf, "html")
    }

    fn __repr__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_python(slf, "text")
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: Bound<'_, PyAny>) -> Py<Self> {
        slf
    }

    fn __reduce__(&self) -> PyResult<()> {
        let class = match &self.0 {
            Source::Frame { .. } => "Frame",
            Source::Image(_) => "Image",
        };
        Err(not_copied(
            class,
            "send its arrays, {name: array.copy() for name, array in frame.items()}, or save it",
        ))
    }
}

/// What data sets do alike: a function of `_layers.py`.
fn in_python<'py>(layers: &Bound<'py, Layers>, function: &str) -> PyResult<Bound<'py, PyAny>> {
    let module = layers.py().import("camlux._layers")?;
    module.call_method1(function, (layers,))
}
