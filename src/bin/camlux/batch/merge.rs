//! `--merge`: merges the manifests of the shards into one and checks each line against its file.

use std::fs;
use std::path::Path;

use super::frames::Frames;
use super::manifest::{self, Lines, WHOLE};
use crate::{Failure, counted, tell};

/// Maximum number of indices in a message.
const MOST_NAMED: usize = 10;

/// Returns whether every frame is there.
pub fn run(frames: &Frames, folder: &Path) -> Result<bool, Failure> {
    let (manifests, shard_count) = manifests(folder)?;
    let mut merged = Lines::new();
    let (mut missing, mut failed) = (Vec::new(), Vec::new());
    for index in 0..frames.count() {
        let planned = frames.plan(index);
        let lines = manifests.iter().filter_map(|lines| lines.get(&index));
        let lines: Vec<_> = lines.filter(|line| line.is_of(&planned)).collect();
        let proved = lines
            .iter()
            .find(|line| line.is_proved_by(&planned, folder));
        if let Some(&line) = proved {
            merged.insert(index, line.clone());
        } else if let Some(&line) = lines.iter().find(|line| line.has_failed()) {
            merged.insert(index, line.clone());
            failed.push(index);
        } else {
            missing.push(index);
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
    tell_of(
        &missing,
        "frame is missing or damaged",
        "frames are missing or damaged",
    );
    tell_of(&failed, "frame failed", "frames failed");
    Ok(missing.is_empty() && failed.is_empty())
}

fn tell_of(indices: &[u64], one: &str, many: &str) {
    if indices.is_empty() {
        return;
    }
    let mut named: Vec<String> = indices.iter().map(u64::to_string).collect();
    if named.len() > MOST_NAMED {
        named.truncate(MOST_NAMED);
        named.push("...".into());
    }
    let count = counted(indices.len() as u64, one, many);
    tell(&format!("{count}: {}", named.join(", ")));
}

/// All manifests of the folder, those of shards first, and the number of shard manifests.
fn manifests(folder: &Path) -> Result<(Vec<Lines>, u64), Failure> {
    let unreadable = |error| {
        format!(
            "{}: cannot read the folder: {error}; give the --output of the batch",
            folder.display()
        )
    };
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
