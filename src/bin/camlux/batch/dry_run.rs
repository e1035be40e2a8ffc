//! `--dry-run`: which frames there are, and what they will take, from a few that are rendered and packed but not kept.

use std::fmt::Write;
use std::time::{Duration, Instant};

use camlux::DeviceOptions;
use camlux::output::{OutputFile, write_exr_hashed};

use super::frames::Frames;
use super::work::Engine;
use crate::{Failure, print, tell, warn};

/// Frames that are tried beside the first, whose time holds what is made once.
const TRIED_FRAMES: usize = 3;

pub fn run(frames: &mut Frames, indices: &[u64], device: &DeviceOptions) -> Result<(), Failure> {
    let mut text = String::new();
    for &index in indices {
        let planned = frames.plan(index);
        let (position_m, rotation) = planned.camera_pose;
        let (position_m, rotation) = (position_m.to_array(), rotation.to_array());
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{index} {} position = {position_m:?}, rotation = {rotation:?}",
            planned.file
        );
    }
    print(&text)?;
    if let (Some(&first), Some(estimate)) = (indices.first(), estimate(frames, indices, device)?) {
        let last = indices.last().unwrap_or(&first);
        let total = indices.len() as u32;
        tell(&format!(
            "{total} frames, {first} to {last}: about {} and {:.1} MB, by {} of them rendered at full size, without what overlaps",
            humantime::format_duration(Duration::from_secs((estimate.time * total).as_secs())),
            estimate.bytes * f64::from(total) * 1e-6,
            estimate.tried,
        ));
    }
    Ok(())
}

/// Of one frame.
struct Estimate {
    time: Duration,
    bytes: f64,
    tried: usize,
}

fn estimate(
    frames: &mut Frames,
    indices: &[u64],
    device: &DeviceOptions,
) -> Result<Option<Estimate>, Failure> {
    let Some(&first) = indices.first() else {
        return Ok(None);
    };
    let spread = |i: usize| indices[(2 * i + 1) * indices.len() / (2 * TRIED_FRAMES)];
    let mut tried: Vec<u64> = (0..TRIED_FRAMES).map(spread).collect();
    tried.dedup();
    let mut engine = Engine::open(device)?;
    let folder = std::env::temp_dir().join(format!("camlux-dry-run-{}.exr", std::process::id()));
    let mut one = |index: u64| -> Result<(Duration, u64), Failure> {
        let start = Instant::now();
        let planned = frames.plan(index);
        let frame = engine.render(frames, &planned)?;
        let mut exr = frames.job.exr.clone();
        exr.attributes = planned.attributes();
        let written = write_exr_hashed(OutputFile::create(&folder)?, &frame, &exr);
        let _ = std::fs::remove_file(&folder);
        Ok((start.elapsed(), written?.bytes))
    };
    // A frame that fails does so in the batch, and is recorded there.
    let _ = one(first);
    let measured: Vec<(Duration, u64)> = tried.iter().filter_map(|&i| one(i).ok()).collect();
    let count = measured.len();
    if count == 0 {
        warn("none of the frames that were tried could be rendered");
        return Ok(None);
    }
    Ok(Some(Estimate {
        time: measured.iter().map(|(time, _)| *time).sum::<Duration>() / count as u32,
        bytes: measured.iter().map(|(_, bytes)| *bytes as f64).sum::<f64>() / count as f64,
        tried: count,
    }))
}
