//! Shared by the benches: runs lavapipe on two threads, as in the documentation, on every machine.

use std::{
    env,
    process::{Command, ExitCode},
};

/// The variable for lavapipe's number of threads. The driver reads it when it is loaded.
pub const DRIVER_THREADS: &str = "LP_NUM_THREADS";

pub type Failure = Box<dyn std::error::Error>;

/// Runs a bench with two threads for the driver, or the number in the environment.
pub fn run(name: &str, report: fn() -> Result<(), Failure>) -> ExitCode {
    let fail = |failure: Failure| {
        eprintln!("{name}: {failure}");
        ExitCode::FAILURE
    };
    // A running process cannot change its environment safely.
    if env::var_os(DRIVER_THREADS).is_none() {
        return run_again().unwrap_or_else(fail);
    }
    report().map_or_else(fail, |()| ExitCode::SUCCESS)
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
