//! `--merge`: one manifest from those of the shards, each line proved by its file.

use std::fs;
use std::path::Path;

use super::frames::Frames;
use super::manifest::{self, Lines, WHOLE};
use crate::{Failure, counted, tell};

/// Indices that a message names at most.
const MOST_NAMED: usize = 10;

/// Whether every frame is there.
pub fn run(frames: &Frames, folder: &Path) -> Result<bool, Failure> {
    let (manifests, shard_count) = manifests(folder)?;
    let mut merged = Lines::new();
    let (mut missing, mut failed) = (Vec::new(), Vec::new());
    for index in 0..frames.count() {
        let planned = frames.plan(index);
        let lines = manifests.iter().filter_map(|lines| lines.get(&index));
        let of_frame: Vec<_> = lines.filter(|line| line.is_of(&planned)).collect();
        let proved = of_frame
            .iter()
            .find(|line| line.is_proved_by(&planned, folder));
        let error = of_frame.iter().find(|line| line.has_failed());
        match (proved, error) {
            (Some(&line), _) => {
                merged.insert(index, line.clone());
            }
            (None, Some(&line)) => {
                merged.insert(index, line.clone());
                failed.push(index);
            }
            (None, None) => missing.push(index),
        }
    }
    manifest::replace(&folder.join(WHOLE), &merged)?;
    tell(&format!(
        "merged {} of {} from {}",
        merged.len() - failed.len(),
        counted(frames.count(), "frame", "frames"),
        match shard_count {
            0 => WHOLE.into(),
            count => counted(count, "shard", "shards"),
        }
    ));
    let missing_texts = [
        "frame is missing or damaged",
        "frames are missing or damaged",
    ];
    for (list, [one, many]) in [
        (&missing, missing_texts),
        (&failed, ["frame failed", "frames failed"]),
    ] {
        if !list.is_empty() {
            let count = counted(list.len() as u64, one, many);
            tell(&format!("{count}: {}", some(list)));
        }
    }
    Ok(missing.is_empty() && failed.is_empty())
}

fn some(indices: &[u64]) -> String {
    let named: Vec<String> = indices
        .iter()
        .take(MOST_NAMED)
        .map(u64::to_string)
        .collect();
    let rest = if indices.len() > MOST_NAMED {
        ", ..."
    } else {
        ""
    };
    named.join(", ") + rest
}

/// All manifests of the folder, those of shards first, and how many of these there are.
fn manifests(folder: &Path) -> Result<(Vec<Lines>, u64), Failure> {
    let unreadable = |error| format!("{}: cannot be read: {error}", folder.display());
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("manifest") && name.ends_with(".jsonl") {
            paths.push(path);
        }
    }
    paths.sort();
    let shards = paths.iter().filter(|path| !path.ends_with(WHOLE));
    let shard_count = shards.count() as u64;
    let manifests = paths.iter().map(|path| manifest::read(path));
    Ok((manifests.collect::<Result<_, _>>()?, shard_count))
}
