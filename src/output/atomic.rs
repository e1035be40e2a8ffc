//! A file that appears under its name whole, or not at all.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

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
    temporary: PathBuf,
    /// `None` once closed.
    file: Option<File>,
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
        // Unique within the process by the count, between processes by the id; where ids come again, as in containers, a
        // killed process may have left the name, so that the next count is tried.
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let (temporary, file) = loop {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let mut hidden_name = std::ffi::OsString::from(".");
            hidden_name.push(name);
            hidden_name.push(format!(".{}-{count}.part", std::process::id()));
            let temporary = target.with_file_name(hidden_name);
            match File::options()
                .read(true)
                .write(true)
                .create_new(true)
                .open(&temporary)
            {
                Ok(file) => break (temporary, file),
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(creation_error(&path, &error)),
            }
        };
        Ok(OutputFile {
            path,
            target,
            temporary,
            file: Some(file),
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
    pub fn commit(mut self) -> Result<()> {
        drop(self.file.take());
        fs::rename(&self.temporary, &self.target).map_err(|error| self.failed(&error))
    }

    /// The error to return when a write to this file failed.
    pub fn failed(&self, error: &dyn std::fmt::Display) -> Error {
        output_error(
            &self.path,
            error.to_string(),
            "check the free space and the permissions of its folder",
        )
    }

    /// Writes these bytes behind what is there, and gives the file its name.
    ///
    /// # Errors
    /// [`Error::Output`] where either fails; then what had the name before is still there.
    pub fn commit_with(mut self, bytes: &[u8]) -> Result<()> {
        self.write_all(bytes).map_err(|error| self.failed(&error))?;
        self.commit()
    }

    fn open_file(&mut self) -> io::Result<&mut File> {
        self.file
            .as_mut()
            .ok_or_else(|| io::Error::other("the file is closed"))
    }
}

impl Read for OutputFile {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.open_file()?.read(bytes)
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.open_file()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.open_file()?.flush()
    }
}

impl Seek for OutputFile {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.open_file()?.seek(position)
    }
}

impl Drop for OutputFile {
    fn drop(&mut self) {
        drop(self.file.take());
        // Gone already after a commit; there is nobody to tell where it fails.
        let _ = fs::remove_file(&self.temporary);
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

fn creation_error(path: &Path, error: &io::Error) -> Error {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.display().to_string(),
        _ => "the current folder".to_owned(),
    };
    match error.kind() {
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
