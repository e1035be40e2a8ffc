//! Scenes on which naive implementations go wrong, and how far the engine is from the truth on each.
//!
//! A [`Case`] builds its scenes in code, renders them and measures an error against a closed form, the f64
//! [kernels in f64](crate::internals::f64_kernels) or the path-sampled [reference](crate::reference), with a bound that its source
//! justifies. The same cases are the tests in `tests/hard`, the command `camlux doctor` and the tables of `docs/hard-cases.md`.

mod cones;
mod examiner;
mod geometry;
mod lights;
mod material;
mod measurement;
mod meshes;
mod scale;
pub mod scenes;
mod sums;
mod transport;

pub use examiner::Examiner;
pub use measurement::{Measurement, Part};

use crate::Result;

/// What a case is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    Geometry,
    Lights,
    Scale,
    Transport,
    Material,
    Sums,
}

impl Group {
    /// Every group, in the order of the documentation.
    pub const ALL: [Group; 6] = [
        Group::Geometry,
        Group::Lights,
        Group::Scale,
        Group::Transport,
        Group::Material,
        Group::Sums,
    ];

    /// The heading of its table.
    pub fn name(self) -> &'static str {
        match self {
            Group::Geometry => "Geometry",
            Group::Lights => "Lights",
            Group::Scale => "Scale",
            Group::Transport => "Transport",
            Group::Material => "Material",
            Group::Sums => "Sums",
        }
    }

    /// The cases of the group.
    pub fn cases(self) -> &'static [Case] {
        match self {
            Group::Geometry => geometry::CASES,
            Group::Lights => lights::CASES,
            Group::Scale => scale::CASES,
            Group::Transport => transport::CASES,
            Group::Material => material::CASES,
            Group::Sums => sums::CASES,
        }
    }
}

/// A hard case.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Words joined by underscores: the name of its test.
    pub name: &'static str,
    /// What breaks a naive implementation, a sentence.
    pub hazard: &'static str,
    /// What the engine does, a sentence.
    pub remedy: &'static str,
    /// Whether `camlux doctor` runs it without being asked for all.
    pub is_short: bool,
    /// Why the bound is not met, where it is not: a sentence.
    pub known_issue: Option<&'static str>,
    run: fn(&mut Examiner) -> Result<Measurement>,
}

impl Case {
    /// Renders the scenes of the case and measures.
    ///
    /// # Errors
    /// As [`Renderer::render`](crate::Renderer::render).
    pub fn run(&self, examiner: &mut Examiner) -> Result<Measurement> {
        (self.run)(examiner)
    }
}
