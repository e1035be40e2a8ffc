//! The bench that `scripts/bench-record` records: a short fixed set of frames, as ratios that are comparable between machines.
//!
//! Each frame is a line of CSV:
//! - its name
//! - its time over that of a yardstick that does not change with the engine, the hand-written loop of the bench `speed`
//! - the same in CPU time, which does not count other work of the machine
//! - its rays per second over those of the ray kernel alone, on even rays of both kinds
//! - its number of rays
//! - its estimated error
//!
//! All sides alternate, and the shortest wall-clock time counts. The last two columns do not depend on the machine.

#[cfg(target_arch = "x86_64")]
mod frames;
#[cfg(target_arch = "x86_64")]
#[path = "../speed/native.rs"]
mod native;
#[cfg(target_arch = "x86_64")]
mod rays;
#[path = "../shared/two_threads.rs"]
mod two_threads;

use std::process::ExitCode;

use two_threads::Failure;

#[cfg(target_arch = "x86_64")]
use frames::report;

/// The message if the yardstick cannot run.
const NO_YARDSTICK: &str = "the yardstick is written for AVX2 and FMA; use a CPU that has them";

fn main() -> ExitCode {
    two_threads::run("record", report)
}

#[cfg(not(target_arch = "x86_64"))]
fn report() -> Result<(), Failure> {
    Err(NO_YARDSTICK.into())
}
