//! A file that appears under its name whole, or not at all.

use std::ffi::OsString;
use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// An output file under construction: a temporary file beside the target that [`commit`](Self::commit) moves over it.
///
/// Create it before the work that fills it, so that a place that cannot be written is reported before that work. Dropped
/// without a commit it leaves the target as it was and removes the temporary file; a killed process leaves the temporary
/// file, never half a target.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    /// `path` behind its symbolic links, so that a commit replaces the file and not the link to it.
    target: PathBuf,
    pub(super) temporary: NamedTempFile,
}

impl OutputFile {
    /// Opens the temporary file. An existing target keeps its content until the commit.
    ///
    /// # Errors
    /// [`Error::Output`] when the folder is missing or cannot be written, and when the target is a folder, a device or
    /// another special file, or a read-only file.
    pub fn create(path: impl Into<PathBuf>) -> Result<Self> {
        let path = path.into();
        let target = resolve_target(&path)?;
        let Some(name) = target.file_name() else {
            return Err(output_error(&path, "it names no file", "add a file name"));
        };
        let mut prefix = OsString::from(".");
        prefix.push(name);
        prefix.push(".");
        let temporary = tempfile::Builder::new()
            .prefix(&prefix)
            .suffix(".part")
            // Not the private file that `tempfile` makes by itself: the finished one is for whom the user's umask says.
            .make_in(folder_of(&target), |path| File::create_new(path))
            .map_err(|error| creation_error(&path, &error))?;
        Ok(OutputFile {
            path,
            target,
            temporary,
        })
    }

    /// The name under which the file will appear.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the finished file its name, replacing what was there. It is in the system's file cache then; nothing waits
    /// for the disk.
    ///
    /// # Errors
    /// [`Error::Output`] when the file cannot be renamed; the target is as it was then.
    pub fn commit(self) -> Result<()> {
        let persisted = self.temporary.persist(&self.target);
        persisted.map_err(|failed| write_error(&self.path, &failed.error))?;
        Ok(())
    }

    /// The error to return when a write to this file failed.
    pub(super) fn failed(&self, error: &dyn Display) -> Error {
        write_error(&self.path, error)
    }

    /// The error to return when what is to be written cannot be.
    pub(super) fn refused(&self, problem: impl Into<String>, hint: &str) -> Error {
        output_error(&self.path, problem, hint)
    }

    /// Writes these bytes behind what is there, and gives the file its name.
    ///
    /// # Errors
    /// [`Error::Output`] where either fails; then what had the name before is still there.
    pub fn commit_with(mut self, bytes: &[u8]) -> Result<()> {
        self.temporary
            .write_all(bytes)
            .map_err(|error| self.failed(&error))?;
        self.commit()
    }
}

/// Follows links to the file that is to be replaced, and refuses what a rename must not replace.
fn resolve_target(path: &Path) -> Result<PathBuf> {
    let Ok(metadata) = fs::metadata(path) else {
        return Ok(path.to_owned());
    };
    let (problem, hint) = if metadata.is_dir() {
        ("it is a folder", "add a file name")
    } else if !metadata.is_file() {
        let problem = "it is a device, a pipe or a socket";
        (problem, "name a file on a disk")
    } else if metadata.permissions().readonly() {
        let problem = "the file is there and read-only";
        (problem, "name another file, or make it writable")
    } else {
        return fs::canonicalize(path)
            .map_err(|error| output_error(path, error.to_string(), "name another file"));
    };
    Err(output_error(path, problem, hint))
}

fn folder_of(path: &Path) -> &Path {
    let parent = path.parent().unwrap_or(Path::new(""));
    if parent.as_os_str().is_empty() {
        Path::new(".")
    } else {
        parent
    }
}

fn creation_error(path: &Path, error: &io::Error) -> Error {
    let folder = folder_of(path);
    let name = if folder == Path::new(".") {
        "the current folder".into()
    } else {
        folder.display().to_string()
    };
    let (problem, hint) = match error.kind() {
        // Where a system shows its state as files, as in /proc.
        io::ErrorKind::NotFound if folder.is_dir() => {
            let hint = format!("name a folder on a disk instead of {name}");
            ("its folder takes no new files", hint)
        }
        io::ErrorKind::NotFound => {
            let hint = format!("create {name}, or name another one");
            ("its folder does not exist", hint)
        }
        io::ErrorKind::NotADirectory => {
            let hint = format!("{name} is a file: name a folder");
            ("its folder is not a folder", hint)
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            let hint = format!("allow writing to {name}, or name another one");
            ("its folder cannot be written", hint)
        }
        _ => return output_error(path, error.to_string(), "name another file"),
    };
    output_error(path, problem, hint)
}

pub(super) fn output_error(
    path: &Path,
    problem: impl Into<String>,
    hint: impl Into<String>,
) -> Error {
    Error::Output {
        path: path.to_owned(),
        problem: problem.into(),
        hint: hint.into(),
    }
}

fn write_error(path: &Path, error: &dyn Display) -> Error {
    let hint = "check the free space and the permissions of its folder";
    output_error(path, error.to_string(), hint)
}
