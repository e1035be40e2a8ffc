//! A render that is killed or told to end leaves no half image.

use std::{
    fs,
    io::{BufRead, BufReader, Lines},
    path::Path,
    process::{Child, ChildStderr, Command, Stdio},
};

use crate::program::{files, program, scene_file};

/// Starts a render and waits until it has reached the gather. Returns it and its further stderr lines.
fn render_at_work(folder: &Path, name: &str) -> (Child, Lines<BufReader<ChildStderr>>) {
    let scene = scene_file("cornell");
    let arguments = ["render", scene.to_str().unwrap(), "-o", name];
    // About 68 G pairs, far more than can be computed before a signal.
    let mut child = program(folder, &arguments)
        .args(["--size", "1024", "1024", "--rsm-size", "256"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().contains("gather")));
    (child, lines)
}

/// Only the hidden unfinished file is left, and an existing file is unchanged.
#[test]
fn a_killed_render_leaves_no_half_image() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("old.exr"), "old").unwrap();
    for name in ["new.exr", "old.exr"] {
        let (mut child, _stderr) = render_at_work(folder.path(), name);
        child.kill().unwrap();
        let status = child.wait().unwrap();
        assert!(status.code().is_none(), "killed at work: {status}");
    }
    let visible: Vec<String> = files(folder.path())
        .into_iter()
        .filter(|name| !(name.starts_with('.') && name.ends_with(".part")))
        .collect();
    assert_eq!(visible, ["old.exr"]);
    assert_eq!(
        fs::read_to_string(folder.path().join("old.exr")).unwrap(),
        "old"
    );
}

/// Ctrl-C and SIGTERM end the program between two submissions, after it has removed its files.
#[test]
fn a_terminated_render_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (mut child, lines) = render_at_work(folder.path(), "a.exr");
    let pid = child.id().to_string();
    let signal = Command::new("kill").args(["-TERM", &pid]).status().unwrap();
    assert!(signal.success());
    let rest: Vec<String> = lines.map(|line| line.unwrap()).collect();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{rest:?}");
    assert!(
        rest.iter().any(|line| line.contains("cancelled")),
        "{rest:?}"
    );
    assert_eq!(files(folder.path()), Vec::<String>::new());
}
