//! The program `camlux`.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the program with these arguments, the first of which is its name. Returns its exit code.
#[pyfunction]
pub fn run_program(py: Python, arguments: Vec<OsString>) -> u8 {
    py.detach(|| camlux_program::run(arguments))
}
