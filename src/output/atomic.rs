//! A file that appears under its name complete, or not at all.

use std::ffi::OsString;
use std::fmt::Display;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// An output file under construction: a temporary file beside the target. [`commit`](Self::commit) moves it over the target.
///
/// Create it before the work that fills it, so that an unwritable place is reported before that work. If it is dropped without a commit,
/// the target stays as it was and the temporary file is removed. A killed process leaves the temporary file, but never half a target.
#[derive(Debug)]
pub struct OutputFile {
    path: PathBuf,
    /// `path` with its symbolic links resolved, so that a commit replaces the file and not the link to it.
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
            // `tempfile` itself would make a private file. The finished file must have the permissions of the user's umask.
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

    /// Gives the finished file its name and replaces the previous file. The file is then in the system's file cache; nothing waits for the
    /// disk.
    ///
    /// # Errors
    /// [`Error::Output`] when the file cannot be renamed; the target then stays as it was.
    pub fn commit(self) -> Result<()> {
        let persisted = self.temporary.persist(&self.target);
        persisted.map_err(|failed| write_error(&self.path, &failed.error))?;
        Ok(())
    }

    /// The error to return when a write to this file fails.
    pub(super) fn failed(&self, error: &dyn Display) -> Error {
        write_error(&self.path, error)
    }

    /// The error to return when the data cannot be written.
    pub(super) fn refused(&self, problem: impl Into<String>, hint: &str) -> Error {
        output_error(&self.path, problem, hint)
    }

    /// Appends these bytes and gives the file its name.
    ///
    /// # Errors
    /// [`Error::Output`] if either fails; the previous file of that name is then still there.
    pub fn commit_with(mut self, bytes: &[u8]) -> Result<()> {
        self.temporary
            .write_all(bytes)
            .map_err(|error| self.failed(&error))?;
        self.commit()
    }
}

/// Resolves links to the file that is replaced, and refuses targets that a rename must not replace.
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
        // Systems that show their state as files, such as /proc.
        io::ErrorKind::NotFound if folder.is_dir() => {
            let hint = format!("name a folder on a disk instead of {name}");
            ("its folder takes no new files", hint)
        }
        io::ErrorKind::NotFound => {
            let hint = format!("create {name}, or name another one");
            ("its folder does not exist", hint)
        }
        io::ErrorKind::NotADirectory => {
            let hint = format!("name a folder instead of {name}");
            ("a part of its path is a file", hint)
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
