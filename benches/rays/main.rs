//! Rays per second compared with Embree on the same rays: `cargo bench --bench rays`.
//!
//! From each point that the camera sees: any hit on the way to 256 texels of the light's RSM, and the closest hit along 256
//! cosine-distributed directions. Both sides alternate, use the same number of threads, and must find the same hits. Times are GPU timestamps
//! and CPU time. CPU time does not count other work of the machine.

mod embree;
mod rays;
#[path = "../two_threads.rs"]
mod two_threads;

use std::{env, fs, path::Path, process::ExitCode};

use camlux::{Device, DeviceOptions, Scene, Tracer, internals::ray_probe::RayProbe};
use embree::Embree;
use rays::Rays;
use two_threads::{DRIVER_THREADS, Failure};

/// Turns of each side, after one for warm-up. The fastest counts, because other programs use the machine, too.
const TURNS: usize = 9;
/// Scenes, and the required ratio of the any-hit rate to Embree's.
const BARS: [(&str, f64); 2] = [("cornell", 1.0), ("knot", 0.7)];
/// Share of the rays on which the two sides may differ: those within rounding of an edge.
const MAX_DIFFERENT: f64 = 1e-4;

/// The time for tracing all rays.
#[derive(Clone, Copy)]
pub struct Time {
    wall_ms: f64,
    /// The sum over all threads.
    cpu_ms: f64,
}

impl Time {
    const LONGEST: Time = Time {
        wall_ms: f64::INFINITY,
        cpu_ms: f64::INFINITY,
    };

    fn min(self, other: Time) -> Time {
        Time {
            wall_ms: self.wall_ms.min(other.wall_ms),
            cpu_ms: self.cpu_ms.min(other.cpu_ms),
        }
    }

    fn over(self, other: Time) -> Time {
        Time {
            wall_ms: self.wall_ms / other.wall_ms,
            cpu_ms: self.cpu_ms / other.cpu_ms,
        }
    }
}

fn main() -> ExitCode {
    two_threads::run("rays", report)
}

fn report() -> Result<(), Failure> {
    let threads: usize = env::var(DRIVER_THREADS)?.parse()?;
    let device = Device::open(&DeviceOptions::default())?;
    let kernel = Tracer::best_for(device.info());
    println!("device   {}", device.info().name);
    println!("driver   {}", device.info().driver);
    println!("threads  {threads}; Embree: as many processes");
    println!(
        "M rays/s by the clock, and per second of CPU time times threads; fastest of {TURNS} turns"
    );
    println!(
        "{:<10} {:<8} {:>9} {:>13} {:>13} {:>13}  {:>10}  bar",
        "scene",
        "hit",
        "triangles",
        kernel.name(),
        "Embree",
        "ratio",
        "different"
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (name, bar) in BARS {
        let scene = Scene::load(&folder.join(format!("{name}.toml")))?;
        let rays = Rays::of(&device, &scene)?;
        let mut duel = Duel {
            probe: RayProbe::new(&device, &scene, kernel)?,
            embree: Embree::start(&scene, &rays, threads)?,
            rays,
            threads,
        };
        for kind in ["any", "closest"] {
            let bar = (kind == "any").then_some(bar);
            let triangles: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
            print!("{name:<10} {kind:<8} {triangles:>9}");
            duel.fight(kind, bar)?;
        }
    }
    Ok(())
}

struct Duel {
    probe: RayProbe,
    embree: Embree,
    rays: Rays,
    threads: usize,
}

impl Duel {
    fn fight(&mut self, kind: &str, bar: Option<f64>) -> Result<(), Failure> {
        let (mut time, mut embree_time) = (Time::LONGEST, Time::LONGEST);
        let mut different = 0;
        for _ in 0..=TURNS {
            let (found, own) = self.trace(kind)?;
            let (embree_found, embrees) = self.embree.trace(kind)?;
            time = time.min(own);
            embree_time = embree_time.min(embrees);
            // Any-hit rays may hit different triangles.
            let is_same = |(a, b): &(&Option<usize>, &Option<usize>)| match kind {
                "any" => a.is_some() == b.is_some(),
                _ => a == b,
            };
            let pairs = found.iter().zip(&embree_found);
            different = pairs.filter(|pair| !is_same(pair)).count();
        }
        let count = self.rays.ends.len() as f64;
        if different as f64 > MAX_DIFFERENT * count {
            return Err(format!("{different} of {count} rays find something else").into());
        }
        let rates = |time: Time| {
            let cpu_ms = time.cpu_ms / self.threads as f64;
            format!(
                "{:.1} / {:.1}",
                count / time.wall_ms * 1e-3,
                count / cpu_ms * 1e-3
            )
        };
        let ratio = embree_time.over(time);
        let verdict = bar.map_or(String::new(), |bar| {
            let is_met = ratio.cpu_ms >= bar;
            format!("≥ {bar:.1} {}", if is_met { "met" } else { "missed" })
        });
        println!(
            " {:>13} {:>13} {:>13}  {different:>10}  {verdict}",
            rates(time),
            rates(embree_time),
            format!("{:.2} / {:.2}", ratio.wall_ms, ratio.cpu_ms),
        );
        Ok(())
    }

    /// The hit of each ray, by camlux's kernel, and the time.
    fn trace(&self, kind: &str) -> Result<(Vec<Option<usize>>, Time), Failure> {
        let start = driver_cpu_ms()?;
        let (found, wall_ms) = if kind == "any" {
            let probed = self.probe.any_hit(&self.rays.points, &self.rays.ends)?;
            let found = probed.found.iter().map(|&hit| hit.then_some(0)).collect();
            (found, probed.milliseconds)
        } else {
            let probed = self
                .probe
                .closest_hit(&self.rays.points, &self.rays.directions)?;
            let found = probed.found.iter().map(|hit| Some(hit.as_ref()?.triangle));
            (found.collect(), probed.milliseconds)
        };
        let cpu_ms = driver_cpu_ms()? - start;
        Ok((found, Time { wall_ms, cpu_ms }))
    }
}

/// CPU time of all threads of this process except the first. They are the driver's, which runs the kernel and copies images.
fn driver_cpu_ms() -> Result<f64, Failure> {
    let first = std::process::id().to_string();
    let mut nanoseconds = 0.0;
    for entry in fs::read_dir("/proc/self/task")? {
        let entry = entry?;
        if entry.file_name() == first.as_str() {
            continue;
        }
        // A thread may have ended by now.
        let text = fs::read_to_string(entry.path().join("schedstat")).unwrap_or_default();
        let on_cpu = text.split(' ').next().unwrap_or_default();
        nanoseconds += on_cpu.parse().unwrap_or(0.0);
    }
    Ok(nanoseconds * 1e-6)
}
