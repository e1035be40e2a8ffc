//! A file that appears under its name whole, or not at all.

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
        let mut prefix = std::ffi::OsString::from(".");
        prefix.push(name);
        prefix.push(".");
        // Not the private file that `tempfile` makes by itself: the finished one is for whom the user's umask says.
        let open = |path: &Path| {
            File::options()
                .read(true)
                .write(true)
                .create_new(true)
                .open(path)
        };
        let temporary = tempfile::Builder::new()
            .prefix(&prefix)
            .suffix(".part")
            .make_in(folder_of(&target), open)
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
    pub(super) fn failed(&self, error: &dyn std::fmt::Display) -> Error {
        write_error(&self.path, error)
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
    if metadata.is_dir() {
        return Err(output_error(path, "it is a folder", "add a file name"));
    }
    if !metadata.is_file() {
        return Err(output_error(
            path,
            "it is a device, a pipe or a socket",
            "name a file on a disk",
        ));
    }
    if metadata.permissions().readonly() {
        return Err(output_error(
            path,
            "the file is there and read-only",
            "name another file, or make it writable",
        ));
    }
    fs::canonicalize(path)
        .map_err(|error| output_error(path, error.to_string(), "name another file"))
}

fn folder_of(path: &Path) -> &Path {
    let parent = path.parent().unwrap_or(Path::new(""));
    match parent.as_os_str().is_empty() {
        true => Path::new("."),
        false => parent,
    }
}

fn creation_error(path: &Path, error: &io::Error) -> Error {
    let folder = folder_of(path);
    let is_there = folder.is_dir();
    let folder = match folder == Path::new(".") {
        true => "the current folder".into(),
        false => folder.display().to_string(),
    };
    match error.kind() {
        // Where a system shows its state as files, as in /proc.
        io::ErrorKind::NotFound if is_there => {
            let hint = format!("name a folder on a disk instead of {folder}");
            output_error(path, "its folder takes no new files", hint)
        }
        io::ErrorKind::NotFound => {
            let hint = format!("create {folder}, or name another one");
            output_error(path, "its folder does not exist", hint)
        }
        io::ErrorKind::NotADirectory => {
            let hint = format!("{folder} is a file: name a folder");
            output_error(path, "its folder is not a folder", hint)
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            let hint = format!("allow writing to {folder}, or name another one");
            output_error(path, "its folder cannot be written", hint)
        }
        _ => output_error(path, error.to_string(), "name another file"),
    }
}

fn output_error(path: &Path, problem: impl Into<String>, hint: impl Into<String>) -> Error {
    Error::Output {
        path: path.to_owned(),
        problem: problem.into(),
        hint: hint.into(),
    }
}

fn write_error(path: &Path, error: &dyn std::fmt::Display) -> Error {
    output_error(
        path,
        error.to_string(),
        "check the free space and the permissions of its folder",
    )
}
