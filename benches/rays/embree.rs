//! Runs Embree in separate processes on the same rays.

use std::{
    fs,
    io::{BufRead, BufReader, Write},
    path::Path,
    process::{Child, ChildStdin, ChildStdout, Command, Stdio},
};

use camlux::{LocalSpace, Scene, glam::DVec3, internals::ray_probe::RayPoint};
use tempfile::TempDir;

use crate::{Failure, rays::Rays};

/// Distances from surfaces at which rays start and end, as in `shaders/shared/ray.wgsl`.
const ORIGIN_SHIFT: f64 = 24.0 / (1 << 24) as f64;
const END_SHIFT: f64 = 40.0 / (1 << 24) as f64;

pub struct Embree {
    child: Child,
    /// Dropping this closes Embree's standard input, which ends it.
    questions: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    folder: TempDir,
}

impl Embree {
    /// Starts Embree on a scene's rays. Returns an error if Embree is not available.
    pub fn start(scene: &Scene, rays: &Rays, threads: usize) -> Result<Embree, Failure> {
        let folder = tempfile::tempdir()?;
        let space = LocalSpace::of(scene.bounding_box());
        let mut triangles = Vec::new();
        for mesh in &scene.flattened().meshes {
            for &corner in mesh.triangles.as_flattened() {
                triangles.extend(space.to_local(mesh.positions_m[corner as usize]));
            }
        }
        let before = |point: &RayPoint, shift: f64| {
            let normal = point.geometric_normal;
            let position = DVec3::from(space.to_local(point.position_m).map(f64::from));
            position + shift * normal.abs().element_sum() * normal
        };
        let (mut any, mut closest) = (Vec::new(), Vec::new());
        let rays_per_point = rays.ends.len() / rays.points.len();
        for (ray, end) in rays.ends.iter().enumerate() {
            let origin = before(&rays.points[ray / rays_per_point], ORIGIN_SHIFT);
            let way = before(end, END_SHIFT) - origin;
            let [x, y, z] = origin.as_vec3().to_array();
            any.extend([x, y, z]);
            any.extend(way.as_vec3().to_array());
            closest.extend([x, y, z]);
            closest.extend(rays.directions[ray].as_vec3().to_array());
        }
        for (name, values) in [("triangles", triangles), ("any", any), ("closest", closest)] {
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

    /// Traces all rays of a kind, `any` or `closest`. Returns the triangle that each ray hits, and the milliseconds.
    pub fn trace(&mut self, kind: &str) -> Result<(Vec<Option<usize>>, f64), Failure> {
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

impl Drop for Embree {
    fn drop(&mut self) {
        self.questions = None;
        // A failure does not matter here.
        let _ = self.child.wait();
    }
}
