//! Errors as Python exceptions and warnings.

use std::ops::ControlFlow;

use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyUserWarning};
use pyo3::prelude::*;

create_exception!(
    camlux,
    Error,
    PyException,
    "The base class of all camlux errors. The message says what is wrong, where, and how to mend it."
);
create_exception!(
    camlux,
    SceneError,
    Error,
    "A scene, or a file that it names, cannot be used."
);
create_exception!(
    camlux,
    DeviceError,
    Error,
    "There is no such device, its memory or a limit is too small, or a Vulkan call failed."
);
create_exception!(
    camlux,
    DeviceLostError,
    DeviceError,
    "The driver lost the device: open it again."
);
create_exception!(
    camlux,
    FileError,
    Error,
    "An image cannot be read or compared, or a file cannot be written."
);
create_exception!(
    camlux,
    Cancelled,
    Error,
    "The progress callback returned False."
);
create_exception!(
    camlux,
    CamluxWarning,
    PyUserWarning,
    "A probable mistake that does not prevent rendering."
);

/// The exception for an error of the engine.
pub fn raised(error: camlux::Error) -> PyErr {
    use camlux::Error as E;
    let text = error.to_string();
    match error {
        E::Scene { .. } => SceneError::new_err(text),
        E::DeviceLost { .. } => DeviceLostError::new_err(text),
        E::NoDevice { .. } | E::DeviceLimit { .. } | E::Memory { .. } | E::Vulkan { .. } => {
            DeviceError::new_err(text)
        }
        E::Input { .. } | E::Output { .. } => FileError::new_err(text),
        E::Cancelled => Cancelled::new_err(text),
        _ => Error::new_err(text),
    }
}

/// Shows each text as a [`CamluxWarning`] at the caller's line.
pub fn warn(py: Python, texts: &[String]) -> PyResult<()> {
    for text in texts {
        let text = std::ffi::CString::new(text.as_str())?;
        PyErr::warn(py, &py.get_type::<CamluxWarning>(), &text, 1)?;
    }
    Ok(())
}

/// Asks Python, between two steps of work without the GIL, whether to continue: no signal has arrived, and the callback has not returned
/// False.
pub struct Watch {
    callback: Option<Py<PyAny>>,
    /// The exception that was raised meanwhile.
    raised: Option<PyErr>,
}

impl Watch {
    pub fn new(callback: Option<Py<PyAny>>) -> Watch {
        Watch {
            callback,
            raised: None,
        }
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

    /// The result of the work, or the exception that was raised meanwhile.
    pub fn outcome<T>(self, result: camlux::Result<T>) -> PyResult<T> {
        match (result, self.raised) {
            (Err(camlux::Error::Cancelled), Some(error)) => Err(error),
            (result, _) => result.map_err(raised),
        }
    }
}
