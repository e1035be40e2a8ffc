//! `camlux`: renders scene files, measures the error of the result, and lists the Vulkan devices.
//!
//! Results go to files and stdout; everything about the run goes to stderr. Exit codes: 0 done, 1 failed, 2 wrong usage.

mod batch;
mod canvas;
mod compare;
mod doctor;
mod error_map;
mod indirect;
mod info;
mod json;
mod manual;
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

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::Parser;

/// Computes in physical units how a light illuminates what a camera sees
#[derive(Parser)]
#[command(name = "camlux", version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  camlux render scenes/cornell_spot.toml -o cornell.exr --png cornell.png
  camlux render --help";

#[derive(clap::Subcommand)]
enum Command {
    /// Render a scene to an OpenEXR file
    Render(render::Args),
    /// Render the missing frames of a job file to a data set
    Batch(batch::Args),
    /// Path-trace a reference image of a scene on the CPU
    Reference(reference::Args),
    /// Measure the error of an image against a reference
    Compare(compare::Args),
    /// Measure speed against error: a page with plots and pictures
    Report(report::Args),
    /// Run hard cases on this device; exit code 1 if one fails
    Doctor(doctor::Args),
    /// List the Vulkan devices; exit code 1 if none is usable
    Info,
    /// Print a completion script for a shell
    Completions(manual::CompletionsArgs),
    /// Write the manual pages
    Man(manual::ManArgs),
}

/// Why the program ends early: one of the library's errors, or a text of the program's own.
type Failure = Box<dyn std::error::Error>;

pub fn main() -> ExitCode {
    ExitCode::from(run(std::env::args_os()))
}

/// Runs the program with these arguments, the first of which is its name. Returns its exit code. The Python package calls it.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let code = run_command(arguments);
    // The number in an exit code cannot be read.
    let is_code = |number: &u8| ExitCode::from(*number) == code;
    (0..=u8::MAX).find(is_code).unwrap_or(1)
}

fn run_command(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(arguments) {
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
        Command::Completions(args) => manual::print_completions(&args).map(|()| ExitCode::SUCCESS),
        Command::Man(args) => manual::write_pages(&args).map(|()| ExitCode::SUCCESS),
    })
}

fn finish(result: Result<ExitCode, Failure>) -> ExitCode {
    result.unwrap_or_else(|failure| {
        // Scripts read errors line by line, but parsers tend to spread the position of an error over several lines.
        let lines = failure.to_string();
        let words: Vec<&str> = lines.split_whitespace().collect();
        tell(&format!("camlux: error: {}", words.join(" ")));
        ExitCode::FAILURE
    })
}

/// Prints a line on stderr. A closed stderr is ignored.
fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Warns of something that can be done but is probably a mistake.
fn warn(text: impl std::fmt::Display) {
    tell(&format!("camlux: warning: {text}"));
}

/// "1 frame is", "2 frames are".
fn counted(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// Prints text on stdout.
fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = std::io::stdout().lock();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(|error| format!("cannot write to stdout: {error}; check where it goes").into())
}
