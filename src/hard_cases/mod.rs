//! Hard cases: scenes on which naive implementations go wrong, and the engine's error on each.
//!
//! A [`Case`] builds its scenes in code, renders them and measures an error. It compares with a closed form, the [kernels in
//! f64](crate::internals::f64_kernels) or the path-sampled [reference](crate::reference); the source of each bound justifies it. The same
//! cases are the tests in `tests/hard`, the command `camlux doctor` and the tables of `docs/hard-cases.md`.

mod examiner;
pub mod geometry;
pub mod lights;
pub mod material;
mod measurement;
mod meshes;
pub mod scale;
pub mod scenes;
pub mod sums;
pub mod time_of_flight;
pub mod torture;
mod torture_rows;
pub mod transport;

pub use examiner::Examiner;
pub use measurement::{Measurement, Part};

use crate::Result;

/// All cases, under the headings of their tables.
pub const GROUPS: [(&str, &[Case]); 8] = [
    ("Geometry", geometry::CASES),
    ("Lights", lights::CASES),
    ("Scale", scale::CASES),
    ("Transport", transport::CASES),
    ("Material", material::CASES),
    ("Sums", sums::CASES),
    ("Time of flight", time_of_flight::CASES),
    ("Torture", torture::CASES),
];

/// A hard case.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Words joined by underscores: the name of its test.
    pub name: &'static str,
    /// One sentence: what breaks a naive implementation.
    pub hazard: &'static str,
    /// One sentence: what the engine does.
    pub remedy: &'static str,
    /// Whether `camlux doctor` runs it by default, without `--all`.
    pub is_short: bool,
    /// One sentence: why the case misses its bound, if it does.
    pub known_issue: Option<&'static str>,
    run: Checks,
}

/// Renders the scenes of a case and records what it measures.
type Checks = fn(&mut Examiner) -> Result<()>;

impl Case {
    /// A short case: its name, hazard and remedy, as in the tables.
    const fn new(
        name: &'static str,
        hazard: &'static str,
        remedy: &'static str,
        run: Checks,
    ) -> Case {
        Case {
            name,
            hazard,
            remedy,
            is_short: true,
            known_issue: None,
            run,
        }
    }

    const fn long(self) -> Case {
        Case {
            is_short: false,
            ..self
        }
    }

    const fn with_known_issue(self, issue: &'static str) -> Case {
        Case {
            known_issue: Some(issue),
            ..self
        }
    }
}
