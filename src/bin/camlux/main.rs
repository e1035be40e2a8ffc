//! `camlux`: renders scene files, measures how right the result is, and lists the devices that can.
//!
//! Results go to files and stdout, everything about the run to stderr. Exit codes: 0 done, 1 failed, 2 wrong usage.

mod batch;
mod canvas;
mod compare;
mod doctor;
mod error_map;
mod indirect;
mod info;
mod json;
mod numbers;
mod options;
mod output;
mod progress;
mod range_error;
mod reduced;
mod reference;
mod render;
mod report;
mod summary;
mod tof_picture;
mod torture;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

/// Computes in physical units how a light illuminates what a camera sees.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Render a scene file into an OpenEXR file
    Render(render::Args),
    /// Render the many frames of a job file into a data set; the same command again renders what is missing
    Batch(batch::Args),
    /// Sample the true single bounce of a scene on the CPU, with the standard error of each pixel
    Reference(reference::Args),
    /// Compare an image with a reference: error metrics, without the noise of either, and a map of the errors
    Compare(compare::Args),
    /// Measure speed against error: report.json, and a page with plots and pictures
    Report(report::Args),
    /// Run hard cases on the device and compare with the truth; exit code 1 if one is not met
    Doctor(doctor::Args),
    /// List the Vulkan devices, their limits, and which one is used by default; exit code 1 if none is usable
    Info,
}

/// What ends the program early: one of the library's errors, or a text of the program's own.
type Failure = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(usage) if usage.use_stderr() => {
            tell(&format!("camlux: {}", usage.to_string().trim_end()));
            return ExitCode::from(2);
        }
        // Help and version.
        Err(text) => return finish(print(&text.to_string()).map(|()| ExitCode::SUCCESS)),
    };
    finish(match cli.command {
        Command::Render(args) => render::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Batch(args) => batch::run(&args),
        Command::Reference(args) => reference::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Compare(args) => compare::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Report(args) => report::run(&args).map(|()| ExitCode::SUCCESS),
        Command::Doctor(args) => doctor::run(&args),
        Command::Info => info::run(),
    })
}

fn finish(result: Result<ExitCode, Failure>) -> ExitCode {
    result.unwrap_or_else(|failure| {
        // Scripts read the error by line, and parsers like to draw the place of an error in several.
        let lines = failure.to_string();
        let words: Vec<&str> = lines.split_whitespace().collect();
        tell(&format!("camlux: error: {}", words.join(" ")));
        ExitCode::FAILURE
    })
}

/// A line on stderr. Where stderr is closed there is nobody to tell.
fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// What can be done but is probably not meant.
fn warn(text: impl std::fmt::Display) {
    tell(&format!("camlux: warning: {text}"));
}

/// "1 frame is", "2 frames are".
fn counted(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// Text on stdout.
fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(|error| format!("cannot write to stdout: {error}; check where it goes").into())
}
