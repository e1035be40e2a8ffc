//! The error type of the library. Each message says what is wrong, where, and how to fix it.

use std::path::PathBuf;

/// Result of every fallible call of this library.
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong. The text of each variant is complete: you can show it to a user as it is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene, or a file that a scene names, is not usable.
    #[error("{at}: {problem}; {hint}")]
    Scene {
        /// File and line, or the part of the scene: `scene.toml:12`, `mesh 2 ("floor")`.
        at: String,
        /// What is wrong, with the offending value.
        problem: String,
        /// What the user can do about it.
        hint: String,
    },

    /// The scene needs more than the device has. Raised before any work starts.
    #[error("{what} is {requested}, over the limit of {limit} of {device}; {hint}")]
    DeviceLimit {
        what: String,
        requested: u64,
        limit: u64,
        device: String,
        hint: String,
    },

    /// No Vulkan driver, or no device that camlux can use.
    #[error("no usable Vulkan device: {problem}; {hint}")]
    NoDevice { problem: String, hint: String },

    /// A Vulkan call failed.
    #[error("Vulkan: {call} failed with {result}; {hint}")]
    Vulkan {
        call: &'static str,
        result: ash::vk::Result,
        hint: &'static str,
    },

    /// The device is lost. Everything made from it is unusable, and every later call returns this error at once.
    #[error(
        "the device is lost ({call}), and {pass} was the last pass to begin: the driver probably reset the device because a submission took too long; open the device again, and if it is lost again, set a shorter submission_target or render a smaller image or RSM"
    )]
    DeviceLost {
        /// The last pass that is known to have begun; "none" before the first one.
        pass: &'static str,
        /// The Vulkan function that reported it.
        call: &'static str,
    },

    /// Device memory ran out or could not be bound.
    #[error(
        "memory for {what} ({bytes} bytes): {problem}; render a smaller image or RSM, or choose another device"
    )]
    Memory {
        what: String,
        bytes: u64,
        problem: String,
    },

    /// An image to compare is not usable.
    #[error("{at}: {problem}; {hint}")]
    Input {
        /// The file, or a description of the values.
        at: String,
        problem: String,
        hint: String,
    },

    /// An output file could not be written. Nothing is left under its final name.
    #[error("{}: cannot write: {problem}; {hint}", path.display())]
    Output {
        path: PathBuf,
        problem: String,
        hint: String,
    },

    /// An internal check of camlux failed.
    #[error("internal error: {problem}; this is a bug in camlux, please report it with the scene")]
    Internal { problem: String },

    /// The caller's progress callback requested a stop.
    #[error("cancelled by the caller; all objects can be used again")]
    Cancelled,
}

impl Error {
    pub(crate) fn scene(
        at: impl Into<String>,
        problem: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Error::Scene {
            at: one_line(at.into()),
            problem: shortened(one_line(problem.into())),
            hint: shortened(one_line(hint.into())),
        }
    }

    pub(crate) fn input(
        at: impl Into<String>,
        problem: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Error::Input {
            at: one_line(at.into()),
            problem: shortened(one_line(problem.into())),
            hint: shortened(one_line(hint.into())),
        }
    }

    pub(crate) fn internal(problem: impl Into<String>) -> Self {
        Error::Internal {
            problem: problem.into(),
        }
    }
}

/// Makes a message one line, whatever name a file has: a control character could even control the terminal.
fn one_line(text: String) -> String {
    if !text.contains(char::is_control) {
        return text;
    }
    let escaped = |character: char| {
        if character.is_control() {
            character.escape_default().to_string()
        } else {
            character.into()
        }
    };
    text.chars().map(escaped).collect()
}

/// Keeps a message readable: a long file name, or a list of a thousand names, shows only its beginning and its end.
fn shortened(text: String) -> String {
    const BEGINNING: usize = 800;
    const END: usize = 200;
    let count = text.chars().count();
    if count <= BEGINNING + END {
        return text;
    }
    let beginning: String = text.chars().take(BEGINNING).collect();
    let end: String = text.chars().skip(count - END).collect();
    format!("{beginning} ... {end}")
}
