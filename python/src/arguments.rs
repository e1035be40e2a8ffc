//! Arguments of functions, and what to say about wrong ones.

use std::path::Path;

use camlux::output::Layer;
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::errors::ArgumentError;

/// A whole number of an argument.
pub fn count(value: &Bound<'_, PyAny>, name: &str) -> PyResult<u32> {
    value.extract().map_err(|_| {
        let shown = value
            .repr()
            .map_or_else(|_| "?".into(), |repr| repr.to_string());
        ArgumentError::new_err(format!(
            "{name} is {shown}; give a whole number from 0 to 4294967295"
        ))
    })
}

/// The layers of an argument, which is a name or a list of names.
pub fn layers(value: &Bound<'_, PyAny>) -> PyResult<Vec<Layer>> {
    let names = match value.cast::<PyString>() {
        Ok(name) => vec![name.to_string()],
        Err(_) => value.extract::<Vec<String>>().map_err(|_| {
            let is = value.get_type().to_string();
            ArgumentError::new_err(format!(
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
