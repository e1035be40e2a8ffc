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
const TURNS: usize = 7;

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
    for name in ["cornell", "knot"] {
        let scene = Scene::load(&folder.join(format!("{name}.toml")))?;
        let rays = Rays::of(&device, &scene)?;
        let probe = RayProbe::new(&device, &scene, kernel)?;
        let (mut any, mut closest) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..TURNS {
            any = any.min(probe.any_hit(&rays.points, &rays.ends)?.milliseconds);
            closest = closest.min(probe.closest_hit(&rays.points, &rays.directions)?.milliseconds);
        }
        let rate = |milliseconds: f64| rays.ends.len() as f64 / milliseconds * 1e-3;
        println!("{name}: any {:.1} M rays/s, closest {:.1}", rate(any), rate(closest));
    }
    Ok(())
}
