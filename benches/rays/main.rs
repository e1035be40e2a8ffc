//! Rays per second beside Embree on the same rays: `cargo bench --bench rays`.
//!
//! From points that the camera sees: any hit on the way to 256 texels of the light's RSM, and the closest hit along 256
//! cosine-distributed directions. Both sides take turns, with two threads each, and what they find is compared.

mod rays;

use std::{
    env,
    path::Path,
    process::{Command, ExitCode},
};

use camlux::{Device, DeviceOptions, RayKernel, Scene, ray_probe::RayProbe};
use rays::Rays;

/// Threads of lavapipe, read when the driver is loaded.
const DRIVER_THREADS: &str = "LP_NUM_THREADS";
/// Turns of either side, after one to warm up; the fastest counts, for others use the machine too.
const TURNS: usize = 9;

type Failure = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    // The environment of a running process cannot be changed safely.
    if env::var_os(DRIVER_THREADS).is_none() {
        return run_again().unwrap_or_else(fail);
    }
    report().map_or_else(fail, |()| ExitCode::SUCCESS)
}

fn fail(failure: Failure) -> ExitCode {
    eprintln!("rays: {failure}");
    ExitCode::FAILURE
}

/// Runs this program with two threads for the driver.
fn run_again() -> Result<ExitCode, Failure> {
    let status = Command::new(env::current_exe()?)
        .args(env::args_os().skip(1))
        .env(DRIVER_THREADS, "2")
        .status()?;
    Ok(if status.success() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

fn report() -> Result<(), Failure> {
    let device = Device::open(&DeviceOptions::default())?;
    let kernel = RayKernel::best_for(device.info());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let only: Vec<String> = env::args()
        .skip(1)
        .filter(|word| !word.starts_with('-'))
        .collect();
    for name in ["cornell", "knot"] {
        if !only.is_empty() && !only.iter().any(|word| word == name) {
            continue;
        }
        let scene = Scene::load(&folder.join(format!("{name}.toml")))?;
        let rays = Rays::of(&device, &scene)?;
        let probe = RayProbe::new(&device, &scene, kernel)?;
        let (mut any, mut closest) = (f64::INFINITY, f64::INFINITY);
        let (mut any_cpu, mut closest_cpu) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..TURNS {
            let start = cpu_ms();
            any = any.min(probe.any_hit(&rays.points, &rays.ends)?.milliseconds);
            any_cpu = any_cpu.min(cpu_ms() - start);
            let start = cpu_ms();
            closest = closest.min(
                probe
                    .closest_hit(&rays.points, &rays.directions)?
                    .milliseconds,
            );
            closest_cpu = closest_cpu.min(cpu_ms() - start);
        }
        let rate = |milliseconds: f64| rays.ends.len() as f64 / milliseconds * 1e-3;
        println!(
            "per CPU ms pair: any {:.1} closest {:.1}",
            2.0 * rays.ends.len() as f64 / any_cpu * 1e-3,
            2.0 * rays.ends.len() as f64 / closest_cpu * 1e-3
        );
        println!(
            "{name}: any {:.1} M rays/s, closest {:.1}",
            rate(any),
            rate(closest)
        );
    }
    Ok(())
}

fn cpu_ms() -> f64 {
    let main = std::process::id().to_string();
    let mut ns = 0.0;
    for entry in std::fs::read_dir("/proc/self/task").unwrap() {
        let path = entry.unwrap().path();
        if path.file_name().unwrap().to_str().unwrap() == main {
            continue;
        }
        if let Ok(text) = std::fs::read_to_string(path.join("schedstat")) {
            ns += text.split(' ').next().unwrap().parse::<f64>().unwrap();
        }
    }
    ns * 1e-6
}
