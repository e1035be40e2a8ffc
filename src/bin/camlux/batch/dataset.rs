//! `dataset.json`: what holds for all frames of a data set.

use std::path::Path;

use camlux::engine_hash;
use camlux::output::Layer;
use serde_json::{Map, Value, json};

use super::frames::Frames;
use super::manifest::replace_text;
use crate::Failure;

pub fn write(frames: &Frames, folder: &Path) -> Result<(), Failure> {
    let text = format!("{:#}\n", object(frames));
    Ok(replace_text(&folder.join("dataset.json"), &text)?)
}

fn object(frames: &Frames) -> Value {
    let job = &frames.job;
    let name = job.file.file_name().unwrap_or_default().to_string_lossy();
    let scenes: Vec<Value> = frames
        .scenes
        .iter()
        .enumerate()
        .map(|(index, scene)| {
            let loaded = frames.scene_as_loaded(index);
            json!({
                "file": scene.name,
                "hash": scene.hash,
                "frames": format!("frames/{}", scene.folder),
                "resolution_px": loaded.camera.resolution_px,
                "meshes": loaded.meshes.iter().map(|m| &m.name).collect::<Vec<_>>(),
                "materials": loaded.materials.iter().map(|m| &m.name).collect::<Vec<_>>(),
                "layers": layers(frames, index),
            })
        })
        .collect();
    json!({
        "format": "camlux dataset 1",
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
        "conventions": {
            "length": "m",
            "camera": "position_m and rotation_xyzw take points from the camera's axes (x right, y down, z forward) to the world",
            "mesh": "position_m and rotation_xyzw take points from where the scene file has the mesh to the world",
            "pixels": "x right, y down; the centre of the first is at (0.5, 0.5)",
        },
    })
}

/// The layers in the files, with their channels and units.
fn layers(frames: &Frames, scene: usize) -> Map<String, Value> {
    let scene = frames.scene_as_loaded(scene);
    let is_written = |layer: &Layer| layer.is_made_for(scene) && frames.job.exr.picks(*layer);
    let describe = |layer: Layer| {
        let value = json!({ "channels": layer.channel_names(), "unit": layer.unit() });
        (layer.name().to_owned(), value)
    };
    Layer::ALL
        .into_iter()
        .filter(is_written)
        .map(describe)
        .collect()
}
