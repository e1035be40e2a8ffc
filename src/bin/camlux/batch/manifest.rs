//! The manifest: one line of JSON per frame, appended once the frame's file has its final name.
//!
//! A line counts only if it matches its file, so that nothing has to wait for the disk. If a line is lost or cut, or does not match its
//! file, only that frame is rendered again.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use camlux::Error;
use camlux::output::OutputFile;
use serde_json::Value;

use super::frames::Planned;

/// The manifest of all frames.
pub const WHOLE: &str = "manifest.jsonl";

/// A line as it was read. The text is kept, so that its numbers keep all digits.
#[derive(Clone)]
pub struct Line {
    text: String,
    inputs: String,
    /// `None`: the frame failed.
    blake3: Option<String>,
}

impl Line {
    /// `None` if the text is not a line of a manifest, such as one that was cut.
    fn parse(text: &str) -> Option<(u64, Line)> {
        let value: Value = serde_json::from_str(text).ok()?;
        let text_of = |key: &str| Some(value.get(key)?.as_str()?.to_owned());
        let line = Line {
            text: text.to_owned(),
            inputs: text_of("inputs")?,
            blake3: text_of("blake3"),
        };
        Some((value.get("index")?.as_u64()?, line))
    }

    pub fn is_of(&self, planned: &Planned) -> bool {
        self.inputs == planned.inputs
    }

    pub fn has_failed(&self) -> bool {
        self.blake3.is_none()
    }

    /// Whether the frame's inputs are unchanged and its file is there, byte for byte.
    pub fn is_proved_by(&self, planned: &Planned, folder: &Path) -> bool {
        let Some(expected) = self.blake3.as_ref().filter(|_| self.is_of(planned)) else {
            return false;
        };
        let mut hasher = blake3::Hasher::new();
        let mut files = planned.paths(folder).into_iter();
        let is_there = files.all(|path| {
            let file = File::open(path);
            file.is_ok_and(|file| hasher.update_reader(file).is_ok())
        });
        is_there && hasher.finalize().to_hex().as_str() == expected
    }
}

/// Lines by frame index; of two lines with the same index the later one counts.
pub type Lines = BTreeMap<u64, Line>;

/// The lines of a manifest; none if there is no file.
pub fn read(path: &Path) -> Result<Lines, Error> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Lines::new()),
        Err(error) => return Err(failed(path, &error)),
    };
    let text = String::from_utf8_lossy(&bytes);
    Ok(text.lines().filter_map(Line::parse).collect())
}

/// Replaces a manifest by these lines, in the order of their frames.
pub fn replace(path: &Path, lines: &Lines) -> Result<(), Error> {
    let text: String = lines.values().map(|l| format!("{}\n", l.text)).collect();
    replace_text(path, &text)
}

/// Replaces a file unless it already holds this text.
pub fn replace_text(path: &Path, text: &str) -> Result<(), Error> {
    if fs::read(path).is_ok_and(|before| before == text.as_bytes()) {
        return Ok(());
    }
    OutputFile::create(path)?.commit_with(text.as_bytes())
}

/// A manifest to which frames are added as they finish.
pub struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Starts with these lines.
    pub fn begin(path: &Path, lines: &Lines) -> Result<Journal, Error> {
        replace(path, lines)?;
        let file = File::options().append(true).create(true).open(path);
        Ok(Journal {
            path: path.to_owned(),
            file: file.map_err(|error| failed(path, &error))?,
        })
    }

    pub fn append(&mut self, line: &Value) -> Result<(), Error> {
        let text = format!("{line}\n");
        self.file
            .write_all(text.as_bytes())
            .map_err(|error| failed(&self.path, &error))
    }

    /// Sorts the lines and flushes them to the disk.
    pub fn finish(self) -> Result<Lines, Error> {
        let lines = read(&self.path)?;
        replace(&self.path, &lines)?;
        let on_disk = File::open(&self.path).and_then(|file| file.sync_all());
        on_disk.map_err(|error| failed(&self.path, &error))?;
        Ok(lines)
    }
}

fn failed(path: &Path, error: &io::Error) -> Error {
    Error::Output {
        path: path.to_owned(),
        problem: error.to_string(),
        hint: "check the free space and the permissions of its folder".into(),
    }
}
