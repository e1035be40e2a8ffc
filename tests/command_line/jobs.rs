//! A scene of one quad, jobs for it, and helpers that run `camlux batch`.
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use crate::program;

/// Direct light only, 16 × 16 pixels.
pub const SCENE: &str = r#"
[camera]
resolution = [16, 16]
position = [0.0, 0.0, 3.0]
look_at = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
fov_y_deg = 50.0
[[light]]
kind = "point"
position = [0.5, 1.0, 2.0]
power_w = 50.0
[[mesh]]
path = "quad.obj"
material = "white"
[material.white]
kd = 0.7
"#;

const QUAD: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n";

/// Twelve different frames: the camera moves on a path, and the light has random positions.
pub const JOB: &str = r#"
[job]
scene = "scene.toml"
seed = 3
[camera]
keyframes = [
    { frame = 0, position = [-1.0, 0.0, 3.0], look_at = [0.0, 0.0, 0.0] },
    { frame = 11, position = [1.0, 0.5, 2.5], look_at = [0.2, 0.0, 0.0] },
]
[[light]]
index = 0
random = { min = [-1.0, 0.5, 1.0], max = [1.0, 1.5, 2.0] }
"#;
pub const JOB_FRAMES: usize = 12;

pub struct Jobs {
    pub folder: tempfile::TempDir,
}

impl Jobs {
    /// A folder with the scene and this job.
    pub fn new(job: &str) -> Jobs {
        let jobs = Jobs {
            folder: tempfile::tempdir().unwrap(),
        };
        jobs.write("scene.toml", SCENE);
        jobs.write("quad.obj", QUAD);
        jobs.write("job.toml", job);
        jobs
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    pub fn json(&self, name: &str) -> Value {
        program::json(&self.path(name))
    }

    pub fn program(&self, arguments: &[&str]) -> Command {
        program::program(self.folder.path(), arguments)
    }

    /// `camlux batch job.toml -o OUT`, with more arguments.
    pub fn command(&self, out: &str, more: &[&str]) -> Command {
        let mut command = self.program(&["batch", "job.toml", "-o", out]);
        command.args(more);
        command
    }

    pub fn run(&self, out: &str, more: &[&str]) -> Output {
        self.command(out, more).output().unwrap()
    }

    /// Runs a job that must succeed, and returns stderr. stdout must be empty: the validation layer writes there.
    #[track_caller]
    pub fn succeed(&self, out: &str, more: &[&str]) -> String {
        program::assert_succeeds(&self.run(out, more))
    }

    /// Runs a job that must fail, and returns stderr.
    #[track_caller]
    pub fn fail(&self, out: &str, more: &[&str]) -> String {
        let output = self.run(out, more);
        let stderr = program::stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        stderr
    }

    /// Starts a run and returns at once.
    pub fn start(&self, out: &str, more: &[&str]) -> std::process::Child {
        let mut command = self.command(out, more);
        command.stderr(Stdio::null()).stdout(Stdio::null());
        command.spawn().unwrap()
    }

    pub fn manifest(&self, name: &str) -> Vec<Value> {
        let text = fs::read_to_string(self.path(name)).unwrap();
        let lines = text.lines();
        lines.map(|l| serde_json::from_str(l).unwrap()).collect()
    }

    /// The hash of each frame's file by frame index. Checks that the manifest has the same hash.
    #[track_caller]
    pub fn hashes(&self, out: &str) -> BTreeMap<u64, String> {
        let lines = self.manifest(&format!("{out}/manifest.jsonl"));
        let hash_of = |line: &Value| {
            let file = format!("{out}/{}", line["file"].as_str().unwrap());
            let hash = blake3::hash(&self.read(&file)).to_hex().to_string();
            assert_eq!(line["blake3"], hash.as_str());
            (line["index"].as_u64().unwrap(), hash)
        };
        lines.iter().map(hash_of).collect()
    }
}

/// All files below a folder, including hidden ones. Lock files are left out, because runs never remove them.
pub fn files_below(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            names.extend(files_below(&path));
        } else {
            names.push(path.file_name().unwrap().to_str().unwrap().to_owned());
        }
    }
    names.retain(|name| !name.ends_with(".lock"));
    names.sort();
    names
}
