//! Rays per second of each tracer compared with Embree on the same rays: `cargo bench --bench rays`.
//!
//! From each point that the camera sees: any hit on the way to 256 texels of the light's RSM, and the closest hit along 256
//! cosine-distributed directions. The sides take turns, use the same number of threads, and must find the same hits. Times are those of the
//! trace alone, by the clock.

mod embree;
mod rays;
#[path = "../two_threads.rs"]
mod two_threads;

use std::{env, path::Path, process::ExitCode};

use camlux::{Device, DeviceOptions, Scene, Tracer, internals::ray_probe::RayProbe};
use embree::Embree;
use rays::Rays;
use two_threads::{DRIVER_THREADS, Failure};

/// Turns of each side, after one for warm-up. The fastest counts, because other programs use the machine, too.
const TURNS: usize = 9;
/// Scenes, and the goal for the fastest tracer's rates relative to Embree's.
const GOALS: [(&str, f64); 2] = [("cornell", 0.8), ("knot", 0.8)];
/// Share of the rays on which the two sides may differ: those within rounding of an edge.
const MAX_DIFFERENT: f64 = 1e-4;

fn main() -> ExitCode {
    two_threads::run("rays", report)
}

fn report() -> Result<(), Failure> {
    let threads: usize = env::var(DRIVER_THREADS)?.parse()?;
    let device = Device::open(&DeviceOptions::default())?;
    let info = device.info();
    println!("device   {}", info.name);
    println!("driver   {}", info.driver);
    println!("threads  {threads}; Embree: as many processes");
    println!("M rays/s; fastest of {TURNS} turns");
    println!(
        "{:<10} {:<8} {:>9} {:<7} {:>7} {:>7} {:>6}  {:>10}  goal",
        "scene", "hit", "triangles", "tracer", "rate", "Embree", "ratio", "different"
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for (name, goal) in GOALS {
        let scene = Scene::load(&folder.join(format!("{name}.toml")))?;
        let rays = Rays::of(&device, &scene)?;
        let mut embree = Embree::start(&scene, &rays, threads)?;
        let triangles: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
        let tracers = Tracer::ALL
            .into_iter()
            .filter(|tracer| tracer.runs_on(info));
        for tracer in tracers {
            let probe = RayProbe::new(&device, &scene, tracer)?;
            for kind in ["any", "closest"] {
                let goal = (tracer == Tracer::best_for(info)).then_some(goal);
                print!("{name:<10} {kind:<8} {triangles:>9} {:<7}", tracer.name());
                compare(&probe, &mut embree, &rays, (kind, goal))?;
            }
        }
    }
    Ok(())
}

fn compare(
    probe: &RayProbe,
    embree: &mut Embree,
    rays: &Rays,
    (kind, goal): (&str, Option<f64>),
) -> Result<(), Failure> {
    let (mut ms, mut embree_ms) = (f64::INFINITY, f64::INFINITY);
    let mut different = 0;
    for _ in 0..=TURNS {
        let (found, own_ms) = trace(probe, rays, kind)?;
        let (embree_found, its_ms) = embree.trace(kind)?;
        (ms, embree_ms) = (ms.min(own_ms), embree_ms.min(its_ms));
        // Any-hit rays may hit different triangles.
        let is_same = |(a, b): &(&Option<usize>, &Option<usize>)| match kind {
            "any" => a.is_some() == b.is_some(),
            _ => a == b,
        };
        let pairs = found.iter().zip(&embree_found);
        different = pairs.filter(|pair| !is_same(pair)).count();
    }
    let count = rays.ends.len() as f64;
    if different as f64 > MAX_DIFFERENT * count {
        return Err(format!("{different} of {count} rays find something else").into());
    }
    let ratio = embree_ms / ms;
    let verdict = goal.map_or(String::new(), |goal| {
        let is_met = ratio >= goal;
        format!("{goal:.1} {}", if is_met { "met" } else { "missed" })
    });
    println!(
        " {:>7.1} {:>7.1} {ratio:>6.2}  {different:>10}  {verdict}",
        count / ms * 1e-3,
        count / embree_ms * 1e-3,
    );
    Ok(())
}

/// The hit of each ray, and the time.
fn trace(probe: &RayProbe, rays: &Rays, kind: &str) -> Result<(Vec<Option<usize>>, f64), Failure> {
    if kind == "any" {
        let probed = probe.any_hit(&rays.points, &rays.ends)?;
        let found = probed.found.iter().map(|&hit| hit.then_some(0)).collect();
        return Ok((found, probed.milliseconds));
    }
    let probed = probe.closest_hit(&rays.points, &rays.directions)?;
    let found = probed.found.iter().map(|hit| Some(hit.as_ref()?.triangle));
    Ok((found.collect(), probed.milliseconds))
}
