//! Reads the attributes of scene.py's objects; each error names the part of the scene.

use camlux::scene::{Parameter, ParameterKind, ParameterValue, Parameters};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyType};

use crate::arguments::{is_bool, shown};
use crate::errors::{SceneError, SceneTypeError};

/// An object, and its name in messages: `light 0`.
pub struct Part<'py> {
    pub object: Bound<'py, PyAny>,
    pub at: String,
}

impl<'py> Part<'py> {
    pub fn new(object: Bound<'py, PyAny>, at: impl Into<String>) -> PyResult<Self> {
        let part = Part {
            object,
            at: at.into(),
        };
        // It has attributes of the right names, without values.
        if let Ok(class) = part.object.cast::<PyType>() {
            let name = class.name()?;
            let hint = format!("give an object of it: {name}(...)");
            return Err(part.type_error(format_args!("is the class {name}"), &hint));
        }
        Ok(part)
    }

    pub fn error(&self, problem: impl std::fmt::Display, hint: &str) -> PyErr {
        SceneError::new_err(format!("{}: {problem}; {hint}", self.at))
    }

    pub fn type_error(&self, problem: impl std::fmt::Display, hint: &str) -> PyErr {
        SceneTypeError::new_err(format!("{}: {problem}; {hint}", self.at))
    }

    fn get(&self, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.object.getattr(name).map_err(|_| {
            let is = self.object.get_type().to_string();
            self.type_error(
                format_args!("{is} has no {name}"),
                "give an object of a class of camlux.scene",
            )
        })
    }

    fn extract<T>(&self, name: &str, value: Bound<'py, PyAny>, expected: &str) -> PyResult<T>
    where
        T: for<'a> FromPyObject<'a, 'py>,
    {
        if is_bool(&value) {
            return Err(self.type_error(format_args!("{name} is {}", shown(&value)), expected));
        }
        value
            .extract()
            .map_err(|_| self.error(format_args!("{name} is {}", shown(&value)), expected))
    }

    pub fn need<T>(&self, name: &str, expected: &str) -> PyResult<T>
    where
        T: for<'a> FromPyObject<'a, 'py>,
    {
        self.extract(name, self.get(name)?, expected)
    }

    pub fn optional<T>(&self, name: &str, expected: &str) -> PyResult<Option<T>>
    where
        T: for<'a> FromPyObject<'a, 'py>,
    {
        let value = self.get(name)?;
        if value.is_none() {
            return Ok(None);
        }
        self.extract(name, value, expected).map(Some)
    }

    pub fn number(&self, name: &str) -> PyResult<f64> {
        self.need(name, "give a number")
    }

    pub fn optional_number(&self, name: &str) -> PyResult<Option<f64>> {
        self.optional(name, "give a number, or None")
    }

    pub fn count(&self, name: &str) -> PyResult<u32> {
        self.need(name, "give a whole number from 0 to 4294967295")
    }

    pub fn flag(&self, name: &str) -> PyResult<bool> {
        let value = self.get(name)?;
        let problem = || format!("{name} is {}", shown(&value));
        let flag = value.extract();
        flag.map_err(|_| self.type_error(problem(), "give True or False"))
    }

    pub fn text(&self, name: &str) -> PyResult<String> {
        self.need(name, "give a string")
    }

    /// x, y, z.
    pub fn vector<V: From<[f64; 3]>>(&self, name: &str) -> PyResult<V> {
        let numbers: [f64; 3] = self.need(name, "give three numbers")?;
        Ok(numbers.into())
    }

    /// One number for all bands, or one per band.
    pub fn bands(&self, name: &str) -> PyResult<[f64; 3]> {
        let value = self.get(name)?;
        if !is_bool(&value)
            && let Ok(one) = value.extract()
        {
            return Ok([one; 3]);
        }
        self.extract(
            name,
            value,
            "give a number, or one for each of red, green and blue",
        )
    }

    pub fn choice<T: Copy>(
        &self,
        name: &str,
        choices: &[T],
        name_of: fn(T) -> &'static str,
    ) -> PyResult<Option<T>> {
        let Some(word) = self.optional::<String>(name, "give a string")? else {
            return Ok(None);
        };
        let chosen = choices.iter().find(|&&choice| name_of(choice) == word);
        match chosen {
            Some(&chosen) => Ok(Some(chosen)),
            None => {
                let names: Vec<_> = choices.iter().map(|&choice| name_of(choice)).collect();
                let hint = format!("give one of: {}", names.join(", "));
                Err(self.error(format_args!("{name} is \"{word}\""), &hint))
            }
        }
    }

    /// The value of a parameter; `None`: an optional one that is None.
    fn parameter(&self, parameter: &Parameter) -> PyResult<Option<ParameterValue>> {
        let Parameter {
            name, is_optional, ..
        } = *parameter;
        if is_optional && self.get(name)?.is_none() {
            return Ok(None);
        }
        let or_none = if is_optional { ", or None" } else { "" };
        Ok(Some(match parameter.kind {
            ParameterKind::Number => {
                ParameterValue::Number(self.need(name, &format!("give a number{or_none}"))?)
            }
            ParameterKind::Pair => {
                ParameterValue::Pair(self.need(name, "give width and height, micrometres")?)
            }
            ParameterKind::Bands => ParameterValue::Bands(self.bands(name)?),
            ParameterKind::Coefficients => ParameterValue::Coefficients(
                self.need(name, &format!("give k1, k2 and k3{or_none}"))?,
            ),
            ParameterKind::Count if is_optional => {
                let count: u32 = self.need(name, "give a whole number, or None")?;
                ParameterValue::Count(count.into())
            }
            ParameterKind::Count => ParameterValue::Count(self.count(name)?.into()),
            ParameterKind::LargeCount => {
                let range = if is_optional {
                    or_none
                } else {
                    " of 0 or more"
                };
                ParameterValue::Count(self.need(name, &format!("give a whole number{range}"))?)
            }
            ParameterKind::Flag => ParameterValue::Flag(self.flag(name)?),
            ParameterKind::Name(names) => {
                let chosen = self.choice(name, names, |name| name)?;
                return Ok(chosen.map(ParameterValue::Name));
            }
        }))
    }

    /// Sets parameters to the attributes of their names.
    pub fn read(&self, into: &mut dyn Parameters) -> PyResult<()> {
        into.read(|parameter| self.parameter(parameter))
    }

    /// Those of the object of that name, unless it is None; it has all of them.
    pub fn parameters<T: Parameters>(&self, name: &str, mut into: T) -> PyResult<Option<T>> {
        let part = self.part(name)?;
        part.map(|part| part.read(&mut into).map(|()| into))
            .transpose()
    }

    /// The object of that name, unless it is None.
    pub fn part(&self, name: &str) -> PyResult<Option<Part<'py>>> {
        let value = self.get(name)?;
        let part = (!value.is_none()).then(|| Part::new(value, name));
        part.transpose()
    }

    /// The objects of a list, named `one` and their index.
    pub fn parts(&self, name: &str, one: &str) -> PyResult<Vec<Part<'py>>> {
        let value = self.get(name)?;
        let listed = value.try_iter().and_then(|items| {
            let items: PyResult<Vec<_>> = items.collect();
            PyList::new(value.py(), items?)
        });
        let list = listed.map_err(|_| {
            let is = value.get_type().to_string();
            self.type_error(format_args!("{name} is {is}"), "give a list")
        })?;
        let numbered = list.iter().enumerate();
        let parts = numbered.map(|(index, object)| Part::new(object, format!("{one} {index}")));
        parts.collect()
    }
}
