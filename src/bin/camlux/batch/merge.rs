//! `--merge`: one manifest from those of the shards, each line proved by its file.

use std::fs;
use std::path::Path;

use super::frames::Frames;
use super::manifest::{self, Lines};
use crate::{Failure, tell};

/// Indices that a message names at most.
const MOST_NAMED: usize = 10;

/// Whether every frame is there.
pub fn run(frames: &Frames, folder: &Path) -> Result<bool, Failure> {
    let manifests = shard_manifests(folder)?;
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
    manifest::replace(&folder.join("manifest.jsonl"), &merged)?;
    tell(&format!(
        "merged {} of {} frames from {} manifests",
        merged.len() - failed.len(),
        frames.count(),
        manifests.len()
    ));
    for (what, list) in [("missing or damaged", &missing), ("failed", &failed)] {
        if !list.is_empty() {
            tell(&format!("{} frames are {what}: {}", list.len(), some(list)));
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

/// All manifests of the folder, those of shards first.
fn shard_manifests(folder: &Path) -> Result<Vec<Lines>, Failure> {
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
    Ok(paths
        .iter()
        .map(|path| manifest::read(path))
        .collect::<Result<_, _>>()?)
}
