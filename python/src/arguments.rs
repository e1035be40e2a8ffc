//! Arguments of functions, and what to say about wrong ones.

use std::path::Path;

use camlux::output::Layer;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyInt, PyString};

use crate::errors::{ArgumentError, ArgumentTypeError};

/// Whether a value is a bool of Python or numpy, which Python takes for the numbers 0 and 1.
pub fn is_bool(value: &Bound<'_, PyAny>) -> bool {
    let is_named = |name: Bound<'_, PyString>| name == "bool" || name == "bool_";
    value.is_instance_of::<PyBool>() || value.get_type().name().is_ok_and(is_named)
}

/// The start of a value's text for messages: that of its class, if its `repr` fails.
pub fn shown(value: &Bound<'_, PyAny>) -> String {
    let class = |_| value.get_type().to_string();
    let text = value.repr().map(|repr| repr.to_string_lossy().into_owned());
    text.unwrap_or_else(class).chars().take(200).collect()
}

/// A whole number of an argument.
pub fn count(value: &Bound<'_, PyAny>, name: &str) -> PyResult<u32> {
    if !is_bool(value)
        && let Ok(number) = value.extract()
    {
        return Ok(number);
    }
    let shown = shown(value);
    let problem = format!("{name} is {shown}; give a whole number from 0 to 4294967295");
    let is_whole = value.is_instance_of::<PyInt>() && !is_bool(value);
    Err(match is_whole {
        true => ArgumentError::new_err(problem),
        false => ArgumentTypeError::new_err(problem),
    })
}

/// A number of an argument.
pub fn number(value: &Bound<'_, PyAny>, name: &str, expected: &str) -> PyResult<f64> {
    if !is_bool(value)
        && let Ok(number) = value.extract()
    {
        return Ok(number);
    }
    let shown = shown(value);
    let problem = format!("{name} is {shown}; give {expected}");
    Err(ArgumentTypeError::new_err(problem))
}

/// An argument without which a function cannot be called. Python itself would name it first, and not the misspelt one.
pub fn needed<'py>(
    value: Option<Bound<'py, PyAny>>,
    function: &str,
    name: &str,
) -> PyResult<Bound<'py, PyAny>> {
    value.ok_or_else(|| ArgumentTypeError::new_err(format!("{function} needs the argument {name}")))
}

/// Refuses the arguments that a function of the package, such as `Renderer.render`, does not have; the message names the nearest.
pub fn refuse(function: &str, others: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
    if let Some(others) = others.filter(|others| !others.is_empty()) {
        let module = others.py().import("camlux._fields")?;
        module.call_method1("refuse_arguments", (function, others))?;
    }
    Ok(())
}

/// The layers of an argument, which is a name or a list of names.
pub fn layers(value: &Bound<'_, PyAny>) -> PyResult<Vec<Layer>> {
    let names = match value.cast::<PyString>() {
        Ok(name) => vec![name.to_string()],
        Err(_) => value.extract::<Vec<String>>().map_err(|_| {
            let is = value.get_type().to_string();
            ArgumentTypeError::new_err(format!(
                "layers is {is}; give a list of names, such as [\"radiance\"]"
            ))
        })?,
    };
    let named = |name: &String| {
        Layer::from_name(name).ok_or_else(|| {
            ArgumentError::new_err(format!(
                "there is no layer \"{name}\"; docs/output.md lists them"
            ))
        })
    };
    names.iter().map(named).collect()
}

/// Refuses a path of another kind of file than is written.
pub fn check_extension(path: &Path, extension: &str) -> PyResult<()> {
    if path
        .extension()
        .is_some_and(|is| is.eq_ignore_ascii_case(extension))
    {
        return Ok(());
    }
    Err(ArgumentError::new_err(format!(
        "{}: this method writes .{extension} files; end the path with .{extension}",
        path.display()
    )))
}
