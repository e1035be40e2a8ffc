//! Measurements, each kept in a file of its own as soon as it is made: a report that was cut goes on from them.
//!
//! As in the manifest of a batch, `inputs` is a hash over all that a measurement depends on. Where a file has another, or is
//! damaged, its measurement is made anew.

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

/// How many measurements a report has.
#[derive(Serialize, Clone, Copy, Default)]
pub struct Counts {
    pub all: usize,
    /// Those that an earlier run has left.
    pub of_earlier_run: usize,
}

impl Counts {
    /// Where there is something to say.
    pub fn note(self) -> Option<String> {
        let Counts {
            all,
            of_earlier_run,
        } = self;
        (of_earlier_run > 0)
            .then(|| format!("{of_earlier_run} of {all} measurements are of an earlier run"))
    }
}

/// Those of one scene, or of the torture set.
pub struct Group<'a> {
    measured: &'a Measured,
    folder: PathBuf,
    inputs: blake3::Hasher,
}

/// A file.
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

    /// The group in this folder, below that of all. `inputs`: what its measurements depend on, beyond the program and the machine.
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
    /// Takes what an earlier run has left, or measures and keeps it.
    ///
    /// # Errors
    /// Those of measuring and writing.
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

    /// What an earlier run has left.
    pub fn find<T: DeserializeOwned>(&self, name: &str, inputs: impl Debug) -> Option<T> {
        let bytes = fs::read(self.path(name)).ok();
        let kept: Option<Kept<T>> = bytes.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        let kept = kept.filter(|kept| kept.inputs == self.inputs_of(name, inputs));
        let measured = kept?.measured;
        self.count(1);
        Some(measured)
    }

    /// # Errors
    /// Where it cannot be written.
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

    /// One more.
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

/// The hash over something more.
fn with(hasher: &blake3::Hasher, inputs: impl Debug) -> blake3::Hasher {
    let mut hasher = hasher.clone();
    hasher.update(format!("{inputs:?}\n").as_bytes());
    hasher
}

/// Of this program's file, for a program under development changes without its version; where the system does not show the
/// file, of version and shaders.
fn program_hash() -> String {
    let hash = std::env::current_exe()
        .ok()
        .and_then(|path| file_hash(&path));
    hash.unwrap_or_else(engine_hash)
}

/// BLAKE3; `None` where the file cannot be read.
pub fn file_hash(path: &Path) -> Option<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(path).ok()?).ok()?;
    Some(hasher.finalize().to_hex().to_string())
}
