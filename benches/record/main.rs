//! What `scripts/bench-record` records: a short fixed set of frames, as ratios that can be compared from machine to machine.
//!
//! A line of CSV for each frame: its name; its time over that of a yardstick that does not change with the engine, the hand-written
//! loop of the bench `speed`; the same in CPU time, which does not count what else the machine does; its rays per second over
//! those of the ray kernel alone, as the bench `rays` traces them; its rays; its estimated error. Of times by the clock the
//! least counts, and all sides take turns. The last two do not depend on the machine.

#[cfg(target_arch = "x86_64")]
mod frames;
#[cfg(target_arch = "x86_64")]
#[path = "../speed/native.rs"]
mod native;
#[cfg(target_arch = "x86_64")]
#[path = "../rays/rays.rs"]
mod rays;
#[path = "../two_threads.rs"]
mod two_threads;

use std::process::ExitCode;

use two_threads::Failure;

#[cfg(target_arch = "x86_64")]
use frames::report;

/// What is said where the yardstick cannot run.
const NO_YARDSTICK: &str = "the yardstick is written for AVX2 and FMA; use a CPU that has them";

fn main() -> ExitCode {
    two_threads::run("record", report)
}

#[cfg(not(target_arch = "x86_64"))]
fn report() -> Result<(), Failure> {
    Err(NO_YARDSTICK.into())
}
