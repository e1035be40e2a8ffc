//! `--dry-run`: lists the frames and estimates time and disk space from a few frames that are rendered and packed but not kept.

use std::fmt::Write;
use std::time::{Duration, Instant};

use camlux::DeviceOptions;
use camlux::output::{OutputFile, write_exr_hashed};

use super::frames::Frames;
use super::work::Engine;
use crate::{Failure, print, tell, warn};

/// Number of frames that are tried besides the first. The time of the first includes one-off work.
const TRIED_FRAMES: usize = 3;

pub fn run(frames: &Frames, indices: &[u64], device: &DeviceOptions) -> Result<(), Failure> {
    let mut text = String::new();
    for &index in indices {
        let planned = frames.plan(index);
        let (position_m, rotation) = planned.camera_pose;
        let (position_m, rotation) = (position_m.to_array(), rotation.to_array());
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{index} {} camera position = {position_m:?}, rotation = {rotation:?}",
            planned.file
        );
    }
    print(&text)?;
    let (Some(&first), Some(&last)) = (indices.first(), indices.last()) else {
        return Ok(());
    };
    let spread = |i: usize| indices[(2 * i + 1) * indices.len() / (2 * TRIED_FRAMES)];
    let mut tried: Vec<u64> = (0..TRIED_FRAMES).map(spread).collect();
    tried.dedup();
    let mut engine = Engine::open(device)?;
    // A frame that fails here will fail in the batch, too, and is recorded there.
    let _ = take(first, frames, &mut engine);
    let taken = tried
        .iter()
        .filter_map(|&i| take(i, frames, &mut engine).ok());
    let (times, bytes): (Vec<Duration>, Vec<u64>) = taken.unzip();
    if times.is_empty() {
        warn("none of the frames that were tried could be rendered");
        return Ok(());
    }
    let (tried, total) = (times.len() as u32, indices.len() as u32);
    let time = times.iter().sum::<Duration>() / tried * total;
    let megabytes = bytes.iter().sum::<u64>() as f64 / f64::from(tried) * f64::from(total) * 1e-6;
    tell(&format!(
        "{total} frames, {first} to {last}: about {} and {megabytes:.1} MB, by {tried} of them rendered at full size, without what overlaps",
        humantime::format_duration(Duration::from_secs(time.as_secs())),
    ));
    Ok(())
}

/// The time that a frame takes, and its size in bytes.
fn take(index: u64, frames: &Frames, engine: &mut Engine) -> Result<(Duration, u64), Failure> {
    let start = Instant::now();
    let planned = frames.plan(index);
    let frame = engine.render(&planned)?;
    let mut exr = frames.job.exr.clone();
    exr.attributes = planned.attributes();
    let path = std::env::temp_dir().join(format!("camlux-dry-run-{}.exr", std::process::id()));
    let written = write_exr_hashed(OutputFile::create(&path)?, &frame, &exr);
    let _ = std::fs::remove_file(&path);
    Ok((start.elapsed(), written?.bytes))
}
