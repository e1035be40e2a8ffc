//! `--dry-run`: lists the frames and estimates time and disk space from a few frames that are rendered and packed but not kept.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::time::{Duration, Instant};

use camlux::DeviceOptions;
use serde_json::json;

use super::engine::Engine;
use super::files;
use super::frames::Frames;
use super::work::frames_in_flight;
use crate::{Failure, counted, print, tell};

/// Number of frames that are tried besides the first. The time of the first includes one-off work.
const TRIED_FRAMES: usize = 3;

pub fn run(frames: &Frames, indices: &[u64], device: &DeviceOptions) -> Result<(), Failure> {
    let described: Vec<_> = indices
        .iter()
        .map(|&index| describe(frames, index))
        .collect();
    let first_parts = described.first().map(|(_, parts)| parts);
    let varies = |name: &String| {
        let of_frames = described.iter().map(|(_, parts)| parts.get(name));
        first_parts.is_some_and(|first| of_frames.into_iter().any(|part| part != first.get(name)))
    };
    let names: BTreeSet<&String> = described
        .iter()
        .flat_map(|(_, parts)| parts.keys())
        .collect();
    let names: Vec<&String> = names.into_iter().filter(|name| varies(name)).collect();
    let mut text = String::new();
    for (camera, parts) in &described {
        text += camera;
        for name in &names {
            if let Some(part) = parts.get(*name) {
                // Writing to a string cannot fail.
                let _ = write!(text, ", {name} = {part}");
            }
        }
        text.push('\n');
    }
    print(&text)?;
    let (Some(&first), Some(&last)) = (indices.first(), indices.last()) else {
        return Ok(());
    };
    let spread = |i: usize| indices[(2 * i + 1) * indices.len() / (2 * TRIED_FRAMES)];
    let mut tried: Vec<u64> = (0..TRIED_FRAMES).map(spread).collect();
    tried.dedup();
    let mut engine = Engine::open(device)?;
    let mut take = |index| take(index, frames, &mut engine).map_err(|error| (index, error));
    let mut failures = Vec::new();
    failures.extend(take(first).err().filter(|_| !tried.contains(&first)));
    let (mut times, mut bytes) = (Vec::new(), Vec::new());
    for &index in &tried {
        match take(index) {
            Ok((time, size)) => {
                times.push(time);
                bytes.push(size);
            }
            Err(failure) => failures.push(failure),
        }
    }
    for (index, error) in &failures {
        tell(&format!("camlux: frame {index} would fail: {error}"));
    }
    if times.is_empty() {
        return Err("none of the trial frames could be rendered; mend the errors above".into());
    }
    let (tried, total) = (times.len() as u32, indices.len() as u32);
    let time = times.iter().sum::<Duration>() / tried * total;
    let megabytes = bytes.iter().sum::<u64>() as f64 / f64::from(tried) * f64::from(total) * 1e-6;
    tell(&format!(
        "{total} frames, {first} to {last}: about {} and {megabytes:.1} MB, estimated from {tried} of them, rendered and written one after the other",
        humantime::format_duration(Duration::from_secs(time.as_secs())),
    ));
    let in_flight = frames_in_flight(frames, indices, &engine.device_info());
    tell(&format!(
        "{} at a time",
        counted(in_flight as u64, "frame renders", "frames render")
    ));
    match failures.len() {
        0 => Ok(()),
        count => {
            Err(format!("{count} of the trial frames would fail; mend the errors above").into())
        }
    }
}

/// Index, file and camera of a frame; and its lights, moving meshes and varied materials, as its line of the manifest describes them.
fn describe(frames: &Frames, index: u64) -> (String, BTreeMap<String, String>) {
    let planned = frames.plan(index);
    let (position_m, rotation) = planned.camera_pose;
    let (position_m, rotation) = (position_m.to_array(), rotation.to_array());
    let camera = format!(
        "{index} {} camera position = {position_m:?}, rotation = {rotation:?}",
        planned.file
    );
    let list = |name: &str| planned.description[name].as_array().into_iter().flatten();
    let lights = list("lights").enumerate();
    let lights = lights.map(|(index, light)| (format!("light {index}"), light.to_string()));
    let meshes = list("meshes").map(|mesh| {
        let pose =
            json!({ "position_m": mesh["position_m"], "rotation_xyzw": mesh["rotation_xyzw"] });
        (format!("mesh {}", mesh["index"]), pose.to_string())
    });
    let description = planned.description.as_object().into_iter().flatten();
    let materials = description.flat_map(|(key, of_materials)| {
        let quantity = key.strip_prefix("materials_");
        let of_materials = of_materials.as_object().into_iter().flatten();
        of_materials.filter_map(move |(name, value)| {
            Some((format!("{} of {name}", quantity?), value.to_string()))
        })
    });
    (camera, lights.chain(meshes).chain(materials).collect())
}

/// The time that a frame takes, and its size in bytes.
fn take(index: u64, frames: &Frames, engine: &mut Engine) -> Result<(Duration, u64), Failure> {
    let start = Instant::now();
    let planned = frames.plan(index);
    let frame = engine.render(&planned)?;
    let name = format!("camlux-dry-run-{}", std::process::id());
    let path = std::env::temp_dir().join(name);
    let path = path.with_extension(frames.job.format.name());
    let (written, _) = files::write(&frames.job, &planned, &path, &frame)?;
    for file in &written.files {
        let _ = std::fs::remove_file(file);
    }
    Ok((start.elapsed(), written.bytes))
}
