//! Errors as Python exceptions and warnings. `errors.py` defines their classes, because a class with two bases cannot be defined here.

use std::ops::ControlFlow;

use pyo3::import_exception;
use pyo3::prelude::*;

import_exception!(camlux.errors, Error);
import_exception!(camlux.errors, ArgumentError);
import_exception!(camlux.errors, ArgumentTypeError);
import_exception!(camlux.errors, Cancelled);
import_exception!(camlux.errors, DeviceError);
import_exception!(camlux.errors, DeviceLostError);
import_exception!(camlux.errors, FileError);
import_exception!(camlux.errors, LayerError);
import_exception!(camlux.errors, MissingFileError);
import_exception!(camlux.errors, MissingSceneFileError);
import_exception!(camlux.errors, SceneError);
import_exception!(camlux.errors, SceneTypeError);
import_exception!(camlux.errors, UnsupportedError);
import_exception!(camlux.errors, CamluxWarning);

/// The exception for an error of the engine.
pub fn raised(error: camlux::Error) -> PyErr {
    raised_within("", error)
}

/// The same; its message begins with what failed.
fn raised_within(what: &str, error: camlux::Error) -> PyErr {
    use camlux::Error as E;
    // An option of other interfaces.
    let text = format!("{what}{error}");
    let text = text.replace("set a shorter submission_target or ", "");
    let is_missing = match &error {
        // The number of ENOENT, with which std ends the text of its error.
        E::Scene { problem, .. } => problem.contains("(os error 2)"),
        E::Input { problem, .. } => problem.contains("there is no such file"),
        E::Output { path, .. } => {
            let mut folder = path.parent().into_iter();
            folder.any(|folder| !folder.as_os_str().is_empty() && !folder.exists())
        }
        _ => false,
    };
    match error {
        E::Scene { .. } if is_missing => MissingSceneFileError::new_err(text),
        E::Scene { .. } => SceneError::new_err(text),
        E::DeviceLost { .. } => DeviceLostError::new_err(text),
        E::NoDevice { .. } | E::DeviceLimit { .. } | E::Memory { .. } | E::Vulkan { .. } => {
            DeviceError::new_err(text)
        }
        E::Input { .. } | E::Output { .. } if is_missing => MissingFileError::new_err(text),
        E::Input { .. } | E::Output { .. } => FileError::new_err(text),
        E::Cancelled => Cancelled::new_err(text),
        _ => Error::new_err(text),
    }
}

/// What an object that cannot be copied or pickled says.
pub fn not_copied(class: &str, instead: &str) -> PyErr {
    UnsupportedError::new_err(format!(
        "a {class} cannot be copied, or sent to another process; {instead}"
    ))
}

/// Shows each text as a [`CamluxWarning`] at the caller's line.
pub fn warn(py: Python, texts: &[String]) -> PyResult<()> {
    warn_above(py, texts, 0)
}

/// Does so where functions of the package, as many as `levels`, are between the caller and this module.
pub fn warn_above(py: Python, texts: &[String], levels: i32) -> PyResult<()> {
    for text in texts {
        let text = std::ffi::CString::new(text.as_str())?;
        PyErr::warn(py, &py.get_type::<CamluxWarning>(), &text, 1 + levels)?;
    }
    Ok(())
}

/// Asks Python, between two steps of work without the GIL, whether to continue: no signal has arrived, and the callback has not returned
/// False.
pub struct Watch {
    callback: Option<Py<PyAny>>,
    /// Whether the callback is a bar, which is closed in the end.
    is_bar: bool,
    /// The exception that was raised meanwhile.
    raised: Option<PyErr>,
}

impl Watch {
    /// `progress`: a function, or True for a bar.
    pub fn new(py: Python, progress: Option<Bound<'_, PyAny>>) -> PyResult<Watch> {
        let flag = progress
            .as_ref()
            .and_then(|progress| progress.extract().ok());
        let callback = match flag {
            Some(true) => Some(py.import("camlux._progress")?.call_method0("Bar")?),
            Some(false) => None,
            None => progress,
        };
        if let Some(callback) = &callback
            && !callback.is_callable()
        {
            let is = callback.get_type().to_string();
            return Err(ArgumentTypeError::new_err(format!(
                "progress is {is}; give a function, or True for a bar"
            )));
        }
        Ok(Watch {
            callback: callback.map(Bound::unbind),
            is_bar: flag == Some(true),
            raised: None,
        })
    }

    /// `arguments`: of the callback.
    pub fn goes_on<'py, A>(&mut self, arguments: impl FnOnce() -> A) -> ControlFlow<()>
    where
        A: for<'a> pyo3::call::PyCallArgs<'a>,
    {
        let asked = Python::attach(|py| -> PyResult<bool> {
            py.check_signals()?;
            let Some(callback) = &self.callback else {
                return Ok(true);
            };
            let answer = callback.bind(py).call1(arguments())?;
            // None continues; a function without a return statement returns it.
            Ok(!answer.is_exact_instance_of::<pyo3::types::PyBool>() || answer.is_truthy()?)
        });
        match asked {
            Ok(true) => ControlFlow::Continue(()),
            Ok(false) => ControlFlow::Break(()),
            Err(error) => {
                self.raised = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    /// The result of the work, or the exception that was raised meanwhile. `what`: how the message of an error begins.
    pub fn outcome<T>(self, py: Python, what: &str, result: camlux::Result<T>) -> PyResult<T> {
        if let (true, Some(bar)) = (self.is_bar, &self.callback) {
            bar.call_method1(py, "close", (result.is_ok(),))?;
        }
        match (result, self.raised) {
            // A render may keep what it has.
            (Err(camlux::Error::Cancelled) | Ok(_), Some(error)) => Err(error),
            (result, _) => result.map_err(|error| raised_within(what, error)),
        }
    }
}
