//! Stores each measurement in its own file as soon as it is made. An interrupted report continues from these files.
//!
//! As in the manifest of a batch, `inputs` is a hash over everything that a measurement depends on. If a file has another hash or is
//! damaged, its measurement is repeated.

use std::cell::Cell;
use std::fmt::Debug;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use camlux::engine_hash;
use camlux::output::OutputFile;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::machine::Machine;
use crate::Failure;
use crate::output::create_folder;

/// The measurements of a report.
pub struct Measured {
    folder: PathBuf,
    inputs: blake3::Hasher,
    counts: Cell<Counts>,
}

/// Number of measurements in a report.
#[derive(Serialize, Clone, Copy, Default)]
pub struct Counts {
    pub all: usize,
    /// Measurements from an earlier run.
    pub of_earlier_run: usize,
}

impl Counts {
    /// A note if measurements come from an earlier run.
    pub fn note(self) -> Option<String> {
        let Counts {
            all,
            of_earlier_run,
        } = self;
        (of_earlier_run > 0)
            .then(|| format!("{of_earlier_run} of {all} measurements are from an earlier run"))
    }
}

/// The measurements of one scene, or of the torture set.
pub struct Group<'a> {
    measured: &'a Measured,
    folder: PathBuf,
    inputs: blake3::Hasher,
}

/// The contents of a measurement file.
#[derive(Serialize, Deserialize)]
struct Kept<T> {
    inputs: String,
    measured: T,
}

impl Measured {
    pub fn new(folder: PathBuf, machine: &Machine) -> Measured {
        let mut inputs = blake3::Hasher::new();
        inputs.update(program_hash().as_bytes());
        inputs.update(machine.identity().as_bytes());
        Measured {
            folder,
            inputs,
            counts: Cell::default(),
        }
    }

    /// The group in this folder, below the folder of all measurements. `inputs`: what its measurements depend on, besides the program and
    /// the machine.
    pub fn group(&self, folder: &str, inputs: impl Debug) -> Group<'_> {
        Group {
            measured: self,
            folder: self.folder.join(folder),
            inputs: with(&self.inputs, inputs),
        }
    }

    pub fn counts(&self) -> Counts {
        self.counts.get()
    }
}

impl Group<'_> {
    /// Returns the measurement of an earlier run, or measures and stores it.
    ///
    /// # Errors
    /// Errors of measuring and writing.
    pub fn obtain<T: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        inputs: impl Debug,
        measure: impl FnOnce() -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        if let Some(measured) = self.find(name, &inputs) {
            return Ok(measured);
        }
        let measured = measure()?;
        self.keep(name, &inputs, &measured)?;
        Ok(measured)
    }

    /// Loads the measurement of an earlier run.
    pub fn find<T: DeserializeOwned>(&self, name: &str, inputs: impl Debug) -> Option<T> {
        let bytes = fs::read(self.path(name)).ok();
        let kept: Option<Kept<T>> = bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        let kept = kept.filter(|kept| kept.inputs == self.inputs_of(name, inputs));
        let measured = kept?.measured;
        self.count(1);
        Some(measured)
    }

    /// # Errors
    /// If it cannot be written.
    pub fn keep<T: Serialize>(
        &self,
        name: &str,
        inputs: impl Debug,
        measured: &T,
    ) -> Result<(), Failure> {
        create_folder(&self.folder)?;
        let kept = Kept {
            inputs: self.inputs_of(name, inputs),
            measured,
        };
        let text = serde_json::to_vec(&kept)?;
        OutputFile::create(self.path(name))?.commit_with(&text)?;
        self.count(0);
        Ok(())
    }

    /// Counts one more measurement.
    fn count(&self, of_earlier_run: usize) {
        let counts = self.measured.counts.get();
        self.measured.counts.set(Counts {
            all: counts.all + 1,
            of_earlier_run: counts.of_earlier_run + of_earlier_run,
        });
    }

    fn inputs_of(&self, name: &str, inputs: impl Debug) -> String {
        with(&self.inputs, (name, inputs))
            .finalize()
            .to_hex()
            .to_string()
    }

    fn path(&self, name: &str) -> PathBuf {
        let words = name.split(|c: char| !c.is_ascii_alphanumeric());
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        self.folder.join(format!("{}.json", words.join("-")))
    }
}

/// Extends the hash by more inputs.
fn with(hasher: &blake3::Hasher, inputs: impl Debug) -> blake3::Hasher {
    let mut hasher = hasher.clone();
    hasher.update(format!("{inputs:?}\n").as_bytes());
    hasher
}

/// Hash of this program's file: during development, the program changes without a change of version. If the system does not show the file,
/// the hash covers the version and the shaders.
fn program_hash() -> String {
    let hash = std::env::current_exe()
        .ok()
        .and_then(|path| file_hash(&path));
    hash.unwrap_or_else(engine_hash)
}

/// BLAKE3 hash of a file; `None` if the file cannot be read.
pub fn file_hash(path: &Path) -> Option<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(path).ok()?).ok()?;
    Some(hasher.finalize().to_hex().to_string())
}
