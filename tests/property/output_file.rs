//! A file appears whole or not at all, and an unwritable path is refused on creation.

use std::fs;
use std::path::Path;

use camlux::output::OutputFile;

fn file_names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn commit_replaces_at_once_and_drop_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    fs::write(&path, "old").unwrap();

    let output = OutputFile::create(&path).unwrap();
    assert_eq!(file_names(folder.path()).len(), 2);
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    drop(output);
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");

    let output = OutputFile::create(&path).unwrap();
    output.commit_with(b"new").unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(file_names(folder.path()), ["a.txt"]);
}

#[cfg(unix)]
#[test]
fn commit_through_a_link_keeps_the_link() {
    let folder = tempfile::tempdir().unwrap();
    let [real, link] = ["real.txt", "link.txt"].map(|name| folder.path().join(name));
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    OutputFile::create(&link).unwrap().commit().unwrap();
    assert_eq!(fs::read_to_string(&real).unwrap(), "");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
}

#[test]
fn unwritable_places_are_refused_on_creation() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let read_only = folder.path().join("read_only.exr");
    fs::write(&read_only, "kept").unwrap();
    let mut permissions = fs::metadata(&read_only).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&read_only, permissions).unwrap();
    let cases = [
        (
            folder.path().join("missing/a.exr"),
            "its folder does not exist",
        ),
        (folder.path().to_owned(), "it is a folder"),
        (file.join("a.exr"), "a part of its path is a file"),
        (read_only.clone(), "read-only"),
        #[cfg(target_os = "linux")]
        ("/proc/a.png".into(), "its folder takes no new files"),
    ];
    for (path, problem) in cases {
        let message = OutputFile::create(&path).unwrap_err().to_string();
        assert!(message.contains(problem), "{message}");
        assert!(
            message.starts_with(&path.display().to_string()),
            "{message}"
        );
    }
    assert_eq!(fs::read_to_string(&read_only).unwrap(), "kept");
    assert_eq!(file_names(folder.path()), ["file", "read_only.exr"]);
}

/// A written file has the permissions that the user's umask gives.
#[cfg(unix)]
#[test]
fn a_file_has_the_permissions_of_any_other() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let [plain, output] = ["plain", "output"].map(|name| folder.path().join(name));
    fs::write(&plain, "").unwrap();
    OutputFile::create(&output).unwrap().commit().unwrap();
    let mode = |path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(output), mode(plain));
}
