//! Runs Embree in separate processes on the same rays.

use std::{
    fs,
    io::{BufRead, BufReader, Write},
    iter,
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use camlux::{LocalSpace, Scene, internals::ray_probe::FrameRays};
use tempfile::TempDir;

use crate::Failure;

pub struct Embree {
    child: Child,
    /// Dropping this closes Embree's standard input, which ends it.
    questions: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    folder: TempDir,
}

impl Embree {
    /// Starts Embree on the rays of a scene's frame. Returns an error if Embree is not available.
    pub fn start(scene: &Scene, rays: &[FrameRays], threads: usize) -> Result<Embree, Failure> {
        let folder = tempfile::tempdir()?;
        let space = LocalSpace::of(scene.bounding_box());
        let mut triangles = Vec::new();
        for mesh in &scene.flattened().meshes {
            for &corner in mesh.triangles.as_flattened() {
                triangles.extend(space.to_local(mesh.positions_m[corner as usize]));
            }
        }
        let of_rays = rays.iter().map(|rays| {
            let records = rays.records().as_flattened();
            (name_of(rays), records.to_vec())
        });
        for (name, values) in iter::once(("triangles", triangles)).chain(of_rays) {
            let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            fs::write(folder.path().join(name), bytes)?;
        }
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/rays/embree");
        let mut child = Command::new(script)
            .arg(folder.path())
            .arg(threads.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let questions = child.stdin.take();
        let answers = BufReader::new(child.stdout.take().ok_or("no standard output")?);
        Ok(Embree {
            child,
            questions,
            answers,
            folder,
        })
    }

    /// Returns the triangle that each ray hits, and the milliseconds.
    pub fn trace(&mut self, rays: &FrameRays) -> Result<(Vec<Option<usize>>, f64), Failure> {
        let kind = name_of(rays);
        let questions = self.questions.as_mut().ok_or("no standard input")?;
        writeln!(questions, "{kind}")?;
        let mut answer = String::new();
        self.answers.read_line(&mut answer)?;
        let seconds: f64 = answer.trim().parse().map_err(|_| "Embree has failed")?;
        let found = fs::read(self.folder.path().join(format!("{kind}.found")))?;
        let (words, _) = found.as_chunks::<4>();
        let triangle = |&word: &[u8; 4]| usize::try_from(i32::from_le_bytes(word)).ok();
        Ok((words.iter().map(triangle).collect(), 1e3 * seconds))
    }
}

/// What `embree.py` calls them.
pub fn name_of(rays: &FrameRays) -> &'static str {
    match rays.wants_closest() {
        true => "closest",
        false => "any",
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        self.questions = None;
        // A failure does not matter here.
        let _ = self.child.wait();
    }
}
