//! Runs of the program, and what they write.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;

use crate::rows::assert_says;

pub fn scene_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"))
}

/// Copies the files of a demo scene's folder.
pub fn copy_scene_files(names: &[&str], folder: &Path) {
    for name in names {
        let from = scene_file("cornell").with_file_name(name);
        fs::copy(from, folder.join(name)).unwrap();
    }
}

/// The program in a folder, under the validation layer, whose messages go to stdout.
pub fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_camlux"));
    command.args(arguments).current_dir(folder);
    command.env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation");
    command
}

pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    program(folder, arguments).output().unwrap()
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// The stderr of a run that succeeded, with nothing on stdout.
#[track_caller]
pub fn assert_succeeds(output: &Output) -> String {
    let stderr = stderr(output);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert_eq!(stdout(output), "", "stdout stays clean");
    stderr
}

/// Asserts that a run failed with one line on stderr that has these words, and nothing on stdout.
#[track_caller]
pub fn assert_fails(output: &Output, words: &[&str]) {
    let stderr = stderr(output);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert_says(&stderr, words);
    assert!(output.stdout.is_empty());
}

/// The names in a folder, sorted.
pub fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

pub fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}
