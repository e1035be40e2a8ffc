//! trimesh, which loads the same files.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use super::{Failure, Times};

/// Answers each path with the seconds of its load by the clock and of CPU time, and with the number of triangles.
const SCRIPT: &str = "
import sys, time
import trimesh
print(trimesh.__version__, flush=True)
for line in sys.stdin:
    clock, cpu = time.perf_counter(), time.process_time()
    loaded = trimesh.load(line.rstrip('\\n'), process=False)
    clock, cpu = time.perf_counter() - clock, time.process_time() - cpu
    meshes = loaded.geometry.values() if isinstance(loaded, trimesh.Scene) else [loaded]
    print(clock, cpu, sum(len(mesh.faces) for mesh in meshes), flush=True)
    del loaded, meshes
";

pub struct Trimesh {
    process: Child,
    paths: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    pub version: String,
}

impl Trimesh {
    /// `None`: no Python that has it is named.
    pub fn start() -> Result<Option<Self>, Failure> {
        let Some(python) = std::env::var_os("CAMLUX_PYTHON") else {
            return Ok(None);
        };
        let mut process = Command::new(python)
            .args(["-c", SCRIPT])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let (paths, answers) = (process.stdin.take(), process.stdout.take());
        let mut answers = BufReader::new(answers.ok_or("no output")?);
        let version = read_line(&mut answers)?;
        let trimesh = Trimesh {
            process,
            paths,
            answers,
            version,
        };
        Ok((!trimesh.version.is_empty()).then_some(trimesh))
    }

    pub fn load(&mut self, file: &Path, triangles: usize) -> Result<Times, Failure> {
        let paths = self.paths.as_mut().ok_or("no input")?;
        writeln!(paths, "{}", file.display())?;
        paths.flush()?;
        let answer = read_line(&mut self.answers)?;
        let numbers: Vec<f64> = answer
            .split(' ')
            .map(str::parse)
            .collect::<Result<_, _>>()?;
        match numbers[..] {
            [clock_s, cpu_s, found] if found == triangles as f64 => Ok(Times { clock_s, cpu_s }),
            _ => Err(format!("trimesh, {}: {answer}", file.display()).into()),
        }
    }
}

impl Drop for Trimesh {
    fn drop(&mut self) {
        // It ends at the end of its input.
        self.paths = None;
        let _ = self.process.wait();
    }
}

fn read_line(answers: &mut impl BufRead) -> Result<String, Failure> {
    let mut line = String::new();
    answers.read_line(&mut line)?;
    Ok(line.trim_end().to_owned())
}
