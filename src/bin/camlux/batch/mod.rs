//! `camlux batch`: renders a job file to a data set of many frames. See `docs/batch.md`.

mod blur;
mod changes;
mod contact_sheet;
mod dataset;
mod draws;
mod dry_run;
mod engine;
mod files;
mod flow;
mod frames;
mod job;
mod light_images;
mod manifest;
mod materials;
mod merge;
mod motion;
mod pose;
mod progress;
mod rig;
mod selection;
mod timing;
mod trajectory;
mod work;

use std::collections::HashSet;
use std::fs::{self, File, TryLockError};
use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use crate::options::DeviceArgs;
use crate::output::create_folder;
use crate::progress::stop_on_signals;
use crate::{Failure, counted, tell, warn};
use contact_sheet::ContactSheet;
use frames::Frames;
use job::Job;
use manifest::{Journal, Line, Lines, WHOLE};
use selection::Shard;
use work::WorkOptions;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  camlux batch examples/rooms.toml -o dataset
  camlux batch examples/rooms.toml -o dataset --shard 2/8
Job files: docs/batch.md. Run the same command again to render missing frames.")]
pub struct Args {
    /// Job file
    #[arg(value_name = "JOB.toml")]
    pub job: PathBuf,
    /// Folder of the data set; complete frames in it are kept
    #[arg(
        short,
        long,
        value_name = "FOLDER",
        required_unless_present = "dry_run"
    )]
    pub output: Option<PathBuf>,
    /// Render only these frames; END is not one of them
    #[arg(long, value_name = "FIRST..END", value_parser = selection::range)]
    pub frames: Option<Range<u64>>,
    /// Render every N-th frame from the I-th on, for N machines
    #[arg(long, value_name = "I/N", value_parser = selection::shard)]
    pub shard: Option<Shard>,
    /// List the frames; estimate time and disk space
    #[arg(long)]
    pub dry_run: bool,
    /// Check the frames of all shards and merge their manifests
    #[arg(long, conflicts_with_all = ["dry_run", "frames", "shard"])]
    pub merge: bool,
    /// Write a picture of up to 64 frames
    #[arg(long, value_name = "FILE.png", conflicts_with = "dry_run")]
    pub contact_sheet: Option<PathBuf>,
    /// Stop at the first frame that fails
    #[arg(long)]
    pub fail_fast: bool,
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Frames that may wait to be written
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub queue: usize,
}

pub fn run(args: &Args) -> Result<ExitCode, Failure> {
    let frames = Frames::load(Job::load(&args.job)?)?;
    let indices = selection::frames(args.frames.clone(), args.shard, frames.count())?;
    let device = args.device.options();
    if args.dry_run {
        dry_run::run(&frames, &indices, &device)?;
        return Ok(ExitCode::SUCCESS);
    }
    // clap requires this option.
    let folder = args.output.as_deref().ok_or("give --output")?;
    dataset::refuse_loop(folder)?;
    let sheet = args.contact_sheet.as_deref();
    let sheet = sheet.map(|path| ContactSheet::create(path, &frames));
    let sheet = sheet.transpose()?;
    let show = |frames: &Frames| sheet.map_or(Ok(()), |s| s.write(frames, &indices, folder));
    if args.merge {
        let _lock = lock(&folder.join(WHOLE))?;
        let is_whole = merge::run(&frames, folder)?;
        dataset::write(&frames, folder)?;
        show(&frames)?;
        return Ok(ExitCode::from(u8::from(!is_whole)));
    }
    stop_on_signals();
    for scene in &frames.scenes {
        create_folder(&folder.join("frames").join(&scene.folder))?;
    }
    // Each shard has its own manifest, so that a shard can write it without access to the others.
    let manifest = folder.join(match args.shard {
        None => WHOLE.into(),
        Some(Shard { number, count }) => format!("manifest-{number}-of-{count}.jsonl"),
    });
    let _lock = lock(&manifest)?;
    dataset::write(&frames, folder)?;
    let (kept, missing) = sort_out(&frames, &indices, folder, &manifest)?;
    remove_unfinished(&frames, &missing, folder, &manifest);
    let there = indices.len() - missing.len();
    if there > 0 {
        tell(&format!(
            "{there} of {} already complete",
            counted(indices.len() as u64, "frame is", "frames are")
        ));
    }
    let journal = Journal::begin(&manifest, &kept)?;
    if missing.is_empty() {
        journal.finish()?;
        show(&frames)?;
        return Ok(ExitCode::SUCCESS);
    }
    let options = WorkOptions {
        folder,
        device: &device,
        queue: args.queue,
        fail_fast: args.fail_fast,
    };
    let start = Instant::now();
    let (done, journal) = work::render(&frames, &missing, journal, options)?;
    work::tell_summary(&done, start.elapsed());
    journal.finish()?;
    show(&frames)?;
    if done.warned > 0 {
        warn(format_args!(
            "{} warnings; {} has their text",
            counted(done.warned, "frame has", "frames have"),
            manifest.display()
        ));
    }
    if done.failed > 0 {
        tell(&format!(
            "camlux: error: {} failed; {} says why",
            counted(done.failed, "frame", "frames"),
            manifest.display()
        ));
    }
    if !done.is_whole {
        let left = missing.len() as u64 - done.written - done.failed;
        tell(&format!(
            "camlux: stopped with {} to go; run the same command again to continue",
            counted(left, "frame", "frames")
        ));
    }
    let is_success = done.is_whole && done.failed == 0;
    Ok(ExitCode::from(u8::from(!is_success)))
}

/// Locks a manifest for one run until that run ends. A killed run releases the lock, too.
fn lock(manifest: &Path) -> Result<File, Failure> {
    let name = manifest.file_name().unwrap_or_default().display();
    let path = manifest.with_file_name(format!(".{name}.lock"));
    let failed = |error| {
        let path = path.display();
        format!("{path}: cannot be locked: {error}; check the permissions of its folder")
    };
    let mut options = File::options();
    let file = options.create(true).write(true).truncate(false).open(&path);
    let file = file.map_err(failed)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(format!(
                "{}: another run uses it; wait until that run ends, or give each run its own --shard",
                manifest.display()
            )
            .into());
        }
        Err(TryLockError::Error(error)) if error.kind() == ErrorKind::Unsupported => {
            warn(
                "the file system of --output has no locks; make sure that no other run writes the same frames",
            );
        }
        Err(TryLockError::Error(error)) => return Err(failed(error).into()),
    }
    Ok(file)
}

/// Returns the manifest lines to keep and the frames of this run to render. A frame is rendered if it has no line, if its file does not
/// match the line, if its job or scene has changed, or if it failed.
fn sort_out(
    frames: &Frames,
    indices: &[u64],
    folder: &Path,
    manifest: &Path,
) -> Result<(Lines, Vec<u64>), Failure> {
    let mut lines = manifest::read(manifest)?;
    lines.retain(|&index, _| index < frames.count());
    let is_there = |index, line: &Line| line.is_proved_by(&frames.plan(index), folder);
    let mut missing = indices.to_vec();
    missing.retain(|&index| !lines.get(&index).is_some_and(|line| is_there(index, line)));
    for index in &missing {
        lines.remove(index);
    }
    Ok((lines, missing))
}

/// Removes unfinished files that a killed run left for these frames and this manifest. Other runs may be working on other frames.
fn remove_unfinished(frames: &Frames, missing: &[u64], folder: &Path, manifest: &Path) {
    let paths = missing.iter().flat_map(|&index| {
        let planned = frames.plan(index);
        // Plain files are written beside a file of this name.
        let whole = folder.join(&planned.file);
        planned.paths(folder).into_iter().chain([whole])
    });
    let own: HashSet<PathBuf> = paths.chain([manifest.to_owned()]).collect();
    let of_scenes = frames.scenes.iter();
    let of_scenes = of_scenes.map(|scene| folder.join("frames").join(&scene.folder));
    for folder in of_scenes.chain([folder.to_owned()]) {
        let Ok(entries) = fs::read_dir(&folder) else {
            continue;
        };
        for path in entries.flatten().map(|entry| entry.path()) {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let unfinished = name.strip_prefix('.').and_then(|n| n.strip_suffix(".part"));
            let finished = unfinished.and_then(|n| Some(folder.join(n.rsplit_once('.')?.0)));
            if finished.is_some_and(|finished| own.contains(&finished)) {
                // A file that cannot be removed does no harm.
                let _ = fs::remove_file(&path);
            }
        }
    }
}
