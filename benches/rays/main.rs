//! Rays per second of each tracer compared with Embree on the rays of frames: `cargo bench --bench rays [-- SCENE_FILE...]`.
//!
//! A frame with a target error of 2 % is rendered, and a sixteenth of its rays is traced again. The sides take turns, use the same number of
//! threads, and must find the same hits. Times are those of the trace alone, by the clock.

mod embree;
#[path = "../shared/scenes.rs"]
mod scenes;
#[path = "../shared/two_threads.rs"]
mod two_threads;

use std::{env, path::PathBuf, process::ExitCode};

use camlux::{
    Device, DeviceOptions, Renderer, Scene, Tracer,
    internals::ray_probe::{FrameRays, RayProbe},
    scene::IndirectLight,
};
use embree::Embree;
use two_threads::{DRIVER_THREADS, Failure};

/// Turns of each side, after one for warm-up. The fastest counts, because other programs use the machine, too.
const TURNS: usize = 5;
const TARGET_ERROR: f64 = 0.02;
/// Scenes if none is given.
const SCENES: [&str; 2] = ["cornell", "knot"];
/// The goal for the fastest tracer's rates relative to Embree's.
const GOAL: f64 = 0.8;
/// Share of the rays on which the two sides may differ: those within rounding of an edge or of their end.
const MAX_DIFFERENT: f64 = 5e-3;

fn main() -> ExitCode {
    two_threads::run("rays", report)
}

fn report() -> Result<(), Failure> {
    let threads: usize = env::var(DRIVER_THREADS)?.parse()?;
    let device = Device::open(&DeviceOptions::default())?;
    let mut renderer = Renderer::new(&device)?;
    let info = device.info();
    println!("device   {}", info.name);
    println!("driver   {}", info.driver);
    println!("threads  {threads}; Embree: as many processes");
    println!("M rays/s; fastest of {TURNS} turns");
    println!(
        "{:<12} {:>9} {:<8} {:>9} {:<7} {:>7} {:>7} {:>6}  {:>9}  goal",
        "scene", "triangles", "hit", "rays", "tracer", "rate", "Embree", "ratio", "different"
    );
    // Without the arguments of cargo.
    let given = env::args().skip(1).filter(|word| !word.starts_with("--"));
    let given = given.map(PathBuf::from).collect();
    for path in scenes::given_or(given, &SCENES) {
        let mut scene = Scene::load(&path)?;
        scene.indirect = Some(IndirectLight::final_gather(TARGET_ERROR));
        let rays = FrameRays::of(&mut renderer, &scene)?;
        let mut embree = Embree::start(&scene, &rays, threads)?;
        let name = path.file_stem().unwrap_or_default().display();
        let triangles = scene.flattened().meshes;
        let triangles: usize = triangles.iter().map(|mesh| mesh.triangles.len()).sum();
        let tracers = Tracer::ALL
            .into_iter()
            .filter(|tracer| tracer.runs_on(info));
        for tracer in tracers {
            let probe = RayProbe::new(&device, &scene, tracer)?;
            for rays in &rays {
                let (kind, count) = (embree::name_of(rays), rays.records().len());
                print!(
                    "{name:<12} {triangles:>9} {kind:<8} {count:>9} {:<7}",
                    tracer.name()
                );
                compare(&probe, &mut embree, rays, tracer == Tracer::best_for(info))?;
            }
        }
    }
    Ok(())
}

fn compare(
    probe: &RayProbe,
    embree: &mut Embree,
    rays: &FrameRays,
    has_goal: bool,
) -> Result<(), Failure> {
    let (mut ms, mut embree_ms) = (f64::INFINITY, f64::INFINITY);
    let mut different = 0;
    for _ in 0..=TURNS {
        let own = probe.trace(rays)?;
        let (embree_found, its_ms) = embree.trace(rays)?;
        (ms, embree_ms) = (ms.min(own.milliseconds), embree_ms.min(its_ms));
        // Any hit may be of different triangles.
        let is_same = |(a, b): &(&Option<usize>, &Option<usize>)| match rays.wants_closest() {
            true => a == b,
            false => a.is_some() == b.is_some(),
        };
        let pairs = own.found.iter().zip(&embree_found);
        different = pairs.filter(|pair| !is_same(pair)).count();
    }
    let count = rays.records().len() as f64;
    let ratio = embree_ms / ms;
    let verdict = if ratio >= GOAL { "met" } else { "missed" };
    let verdict = has_goal.then(|| format!("{GOAL:.1} {verdict}"));
    println!(
        " {:>7.1} {:>7.1} {ratio:>6.2}  {different:>9}  {}",
        count / ms * 1e-3,
        count / embree_ms * 1e-3,
        verdict.unwrap_or_default()
    );
    if different as f64 > MAX_DIFFERENT * count {
        return Err(format!("{different} of {count} rays find something else").into());
    }
    Ok(())
}
