//! `dataset.json`: what all frames of a data set have in common.

use std::{fs, path::Path};

use camlux::output::{DATASET_FORMAT, dataset_conventions, describe_scene};
use camlux::{Scene, engine_hash};
use serde_json::{Value, json};

use super::frames::Frames;
use super::manifest::replace_text;
use super::timing::{self, Timing};
use crate::Failure;

pub fn write(frames: &Frames, folder: &Path) -> Result<(), Failure> {
    let text = format!("{:#}\n", object(frames));
    Ok(replace_text(&folder.join("dataset.json"), &text)?)
}

/// Refuses the data set of a loop (Python's `DatasetWriter`), whose frames a job would not know.
pub fn refuse_loop(folder: &Path) -> Result<(), Failure> {
    let text = fs::read_to_string(folder.join("dataset.json")).unwrap_or_default();
    let about: Value = serde_json::from_str(&text).unwrap_or_default();
    match about.get("job") {
        Some(Value::Null) => Err(format!(
            "{}: this is a data set that a loop has written; name another folder",
            folder.display()
        )
        .into()),
        _ => Ok(()),
    }
}

fn object(frames: &Frames) -> Value {
    let job = &frames.job;
    let name = job.file.file_name().unwrap_or_default().to_string_lossy();
    let scenes = frames
        .scenes
        .iter()
        .zip(&job.scenes)
        .map(|(loaded, of_job)| {
            let starts_s = phase_image_starts_s(&loaded.scene, job.timing.as_ref());
            let mut scene = json!({
                "file": loaded.name,
                "hash": loaded.hash,
                "frames": format!("frames/{}", loaded.folder),
            });
            let (exr, has_flow) = (job.exr_of(of_job), !of_job.flow.is_empty());
            let described = describe_scene(&loaded.scene, &exr, has_flow, starts_s);
            described
                .into_iter()
                .for_each(|(key, value)| scene[key] = value);
            if let Some(mount) = &of_job.mount {
                scene["rig"] = mount.description();
            }
            scene
        });
    let scenes: Vec<Value> = scenes.collect();
    json!({
        "format": DATASET_FORMAT,
        "camlux_version": env!("CARGO_PKG_VERSION"),
        "engine_hash": engine_hash(),
        "job": {
            "file": name,
            "blake3": blake3::hash(job.text.as_bytes()).to_hex().as_str(),
            "text": job.text,
        },
        "scenes": scenes,
        "frame_count": frames.count(),
        "frames_per_scene": frames.count_in_scene(),
        "seed": job.seed,
        "compression": job.exr.compression.name(),
        "half": job.exr.half,
        "plain": job.exr.plain,
        "multipart": job.exr.multipart,
        "file_format": job.format.name(),
        "depth_png": job.has_depth_png,
        "time": job.timing.map(|timing| json!({
            "frame_interval_s": timing.frame_interval_s,
            "readout_time_s": timing.readout_time_s,
            "temporal_samples": timing.temporal_samples,
        })),
        "conventions": dataset_conventions(),
    })
}

/// When the phase images of a job with times begin.
fn phase_image_starts_s(scene: &Scene, timing: Option<&Timing>) -> Option<Vec<f64>> {
    let (timing, tof, sensor) = (timing?, scene.tof.as_ref()?, scene.sensor?);
    let images = timing::images(tof);
    let starts_s = images.map(|image| timing.start_s(tof, sensor.exposure_time_s, image));
    Some(starts_s.collect())
}
