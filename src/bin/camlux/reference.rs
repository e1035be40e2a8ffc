//! `camlux reference`: samples the true indirect light of a scene to the requested error.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use camlux::output::{ExrOptions, OutputFile, write_exr};
use camlux::reference::{Goal, Reference};
use camlux::scene::{FinalGather, IndirectLight};
use camlux::{Error, Scene};

use crate::options::{SizeArgs, warn_of};
use crate::output::require_extension;
use crate::progress::{Estimate, go_on, stop_on_signals};
use crate::{Failure, tell};

/// Interval at which the unfinished image is written.
const TIME_BETWEEN_SAVES: Duration = Duration::from_secs(30);

#[derive(clap::Args)]
#[command(group(clap::ArgGroup::new("goal").required(true)), after_help = "\
Example:
  camlux reference scenes/cornell_spot.toml -o reference.exr --stderr 0.01 --size 400 400
How it is sampled: docs/reference.md")]
pub struct Args {
    /// Scene file
    #[arg(value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// OpenEXR file to write; samples are added to an existing one
    #[arg(short, long, value_name = "FILE.exr")]
    pub output: PathBuf,
    /// Samples per pixel: 32 at least, rounded up to a multiple of 4
    #[arg(long, value_name = "N", group = "goal", value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    pub spp: Option<u32>,
    /// Sample until this relative standard error: 0.01 is 1 %
    #[arg(long, value_name = "SHARE", group = "goal", value_parser = parse_share)]
    pub stderr: Option<f64>,
    /// Bounces, 1 to 16 [default: those of the scene]
    #[arg(long, value_name = "NUMBER")]
    pub bounces: Option<u32>,
    #[command(flatten)]
    pub size: SizeArgs,
}

/// A share above 0 and below 1.
pub fn parse_share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok();
    share
        .filter(|share| *share > 0.0 && *share < 1.0)
        .ok_or_else(|| "give a share between 0 and 1, such as 0.01 for one percent".into())
}

pub fn run(args: &Args) -> Result<(), Failure> {
    stop_on_signals();
    let goal = match (args.spp, args.stderr) {
        (Some(samples), _) => Goal::SamplesPerPixel(samples),
        (None, Some(share)) => Goal::StandardError(share),
        // clap requires one of the two.
        (None, None) => return Err("give --spp or --stderr".into()),
    };
    require_extension("--output", &args.output, "exr")?;
    // Checks the output path first, so that a long computation does not end in a write error.
    drop(OutputFile::create(&args.output)?);
    let mut scene = args.size.load(&args.scene)?;
    if let Some(bounces) = args.bounces {
        // Nothing else of it changes a reference.
        scene.indirect = Some(IndirectLight::FinalGather(FinalGather {
            bounces,
            ..FinalGather::DEFAULT
        }));
    }
    warn_of(&scene, &args.scene.display());
    let path = &args.output;
    let shown = path.display();
    let resumed = path.exists().then(|| Reference::resume(&scene, path));
    let resumed = resumed.transpose()?;
    if let Some(reference) = &resumed {
        let samples = reference.samples_per_pixel();
        tell(&format!("{shown}: adding to {samples} samples per pixel"));
    }
    let start = Instant::now();
    let reference = refine(&scene, goal, resumed, path)?;
    tell(&describe(&reference, start.elapsed()));
    tell(&format!("wrote {shown}"));
    Ok(())
}

/// Refines a reference until it meets its goal, and shows a progress bar. Writes the image to the path from time to time, at the end, and
/// after an interruption.
///
/// # Errors
/// Errors of the library, and [`Error::Cancelled`] after an interruption.
pub fn refine(
    scene: &Scene,
    goal: Goal,
    resumed: Option<Reference>,
    path: &Path,
) -> Result<Reference, Error> {
    let mut bar = Estimate::new("reference");
    let mut reference = match resumed {
        Some(reference) => reference,
        None => Reference::start(scene, goal, &mut |_| go_on())?,
    };
    let mut saved = (reference.rounds(), Instant::now());
    while !reference.meets(goal) {
        let now = reference.progress_to(goal);
        let then = reference.progress_after_round(goal);
        let added = reference.add_round(&mut |fraction| {
            bar.show(now + (then - now) * f64::from(fraction));
            go_on()
        });
        if let Err(error) = added {
            drop(bar);
            if reference.rounds() > saved.0 {
                save(&reference, path)?;
            }
            if reference.rounds() > 0 {
                let samples = reference.samples_per_pixel();
                tell(&format!(
                    "stopped at {samples} samples per pixel, which are kept; run the same command again to continue"
                ));
            }
            return Err(error);
        }
        if saved.1.elapsed() > TIME_BETWEEN_SAVES && !reference.meets(goal) {
            save(&reference, path)?;
            saved = (reference.rounds(), Instant::now());
        }
    }
    bar.show(1.0);
    save(&reference, path)?;
    Ok(reference)
}

/// Writes the current image; the file is replaced as a whole.
fn save(reference: &Reference, path: &Path) -> Result<(), Error> {
    let file = OutputFile::create(path)?;
    write_exr(file, &reference.frame(), &ExrOptions::default())
}

/// Number of samples and the standard error that they reach.
fn describe(reference: &Reference, time: Duration) -> String {
    let samples = reference.samples_per_pixel();
    let rounds = reference.rounds();
    let found = match reference.relative_standard_error() {
        Some(error) => format!(
            "standard error of the indirect light {:.3} %",
            100.0 * error
        ),
        None => "no indirect light was found".into(),
    };
    let seconds = time.as_secs_f64();
    let rate = 1e-6 * reference.paths() as f64 / seconds;
    format!(
        "{samples} samples per pixel in {rounds} rounds; {found}; {seconds:.1} s, {rate:.2} M paths/s"
    )
}
