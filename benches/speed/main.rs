//! Speed as ratios of times measured in one run: `cargo bench --bench speed`.
//!
//! - `gather`: the gather kernels, by GPU timestamps, and a hand-vectorised loop of the same formula on the same number of threads. Both
//!   alternate, so other work of the machine affects both.
//! - `sums`: sums at few pixels and at every pixel.
//! - `frame`: the whole program, from its start to its end, including an OpenEXR file.
//! - `first`: the same in a fresh container, where no kernel has been compiled, beside Mitsuba's whole process.
//!
//! One of these words runs only that part: `cargo bench --bench speed -- sums`.

mod first;
mod frame;
mod gather;
#[cfg(target_arch = "x86_64")]
mod native;
mod sums;
#[path = "../shared/two_threads.rs"]
mod two_threads;

use std::{env, fs, process::ExitCode};

use camlux::{Device, DeviceOptions};
use two_threads::{DRIVER_THREADS, Failure};

fn main() -> ExitCode {
    two_threads::run("speed", report)
}

fn report() -> Result<(), Failure> {
    let threads: usize = env::var(DRIVER_THREADS)?.parse()?;
    let device = Device::open(&DeviceOptions::default())?;
    let info = device.info();
    println!("device   {}", info.name);
    println!("driver   {}", info.driver);
    println!("CPU      {}", cpu_model());
    println!("threads  {threads} ({DRIVER_THREADS}, and as many for the native loop)");
    println!();
    let only = env::args().skip(1).find(|word| !word.starts_with('-'));
    let is_wanted = |part: &str| only.as_ref().is_none_or(|only| only == part);
    if is_wanted("gather") {
        gather::report(&device, threads)?;
        println!();
    }
    if is_wanted("sums") {
        sums::report(&device)?;
        println!();
    }
    if is_wanted("frame") {
        frame::report()?;
        println!();
    }
    if is_wanted("first") {
        first::report()?;
    }
    Ok(())
}

fn cpu_model() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with("model name"));
    let model = line.and_then(|line| Some(line.split_once(':')?.1.trim()));
    model.unwrap_or("unknown").to_owned()
}

/// Median, minimum and maximum of some figures.
struct Spread {
    median: f64,
    min: f64,
    max: f64,
}

impl Spread {
    fn of(mut figures: Vec<f64>) -> Spread {
        figures.sort_by(f64::total_cmp);
        Spread {
            median: figures[figures.len() / 2],
            min: figures[0],
            max: figures[figures.len() - 1],
        }
    }
}

/// The word printed next to a bar.
fn verdict(is_met: bool) -> &'static str {
    if is_met { "met" } else { "missed" }
}
