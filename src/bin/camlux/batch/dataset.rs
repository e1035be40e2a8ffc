//! `dataset.json`: what all frames of a data set have in common.

use std::path::Path;

use camlux::model::PhaseSampling;
use camlux::output::{Layer, TOF_CONVENTION};
use camlux::scene::TimeOfFlight;
use camlux::{Scene, engine_hash};
use serde_json::{Map, Value, json};

use super::frames::Frames;
use super::job::Job;
use super::manifest::replace_text;
use super::timing::{self, Timing};
use crate::Failure;

pub fn write(frames: &Frames, folder: &Path) -> Result<(), Failure> {
    let text = format!("{:#}\n", object(frames));
    Ok(replace_text(&folder.join("dataset.json"), &text)?)
}

fn object(frames: &Frames) -> Value {
    let job = &frames.job;
    let name = job.file.file_name().unwrap_or_default().to_string_lossy();
    let scenes = frames.scenes.iter().map(|loaded| {
        let scene = &loaded.scene;
        json!({
            "file": loaded.name,
            "hash": loaded.hash,
            "frames": format!("frames/{}", loaded.folder),
            "resolution_px": scene.camera.resolution_px,
            "meshes": scene.meshes.iter().map(|m| &m.name).collect::<Vec<_>>(),
            "materials": scene.materials.iter().map(|m| &m.name).collect::<Vec<_>>(),
            "layers": layers(scene, job),
            "time_of_flight": scene.tof.as_ref().map(|tof| time_of_flight(scene, tof, job.timing.as_ref())),
        })
    });
    let scenes: Vec<Value> = scenes.collect();
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
        "time": job.timing.map(|timing| json!({
            "frame_interval_s": timing.frame_interval_s,
            "readout_time_s": timing.readout_time_s,
            "temporal_samples": timing.temporal_samples,
        })),
        "conventions": {
            "length": "m",
            "camera": "position_m and rotation_xyzw take points from the camera's axes (x right, y down, z forward) to the world",
            "mesh": "position_m and rotation_xyzw take points from where the scene file has the mesh to the world",
            "pixels": "x right, y down; the centre of the first is at (0.5, 0.5)",
        },
    })
}

/// How phase images are taken and what they mean, as in the header of each file.
fn time_of_flight(scene: &Scene, tof: &TimeOfFlight, timing: Option<&Timing>) -> Value {
    let exposure_s = scene.sensor.map(|sensor| sensor.exposure_time_s);
    let starts_s = timing.zip(exposure_s).map(|(timing, exposure_s)| {
        let images = timing::images(tof).map(|image| timing.start_s(tof, exposure_s, image));
        images.collect::<Vec<f64>>()
    });
    let delays_rad = (0..tof.phase_count).map(|i| PhaseSampling::delay_rad(i, tof.phase_count));
    json!({
        "frequencies_hz": tof.frequencies_hz,
        "contrasts": tof.contrasts,
        "delays_rad": delays_rad.collect::<Vec<f64>>(),
        "phase_offset_deg": tof.phase_offset_deg,
        "band_weights": tof.band_weights,
        "exposure_time_s": exposure_s,
        "phase_image_starts_s": starts_s,
        "convention": TOF_CONVENTION,
    })
}

/// The layers in the files, with their channels and units.
fn layers(scene: &Scene, job: &Job) -> Map<String, Value> {
    let is_made = |layer: Layer| {
        layer.is_made_for(scene) || job.has_flow && Layer::OF_SEQUENCE.contains(&layer)
    };
    let written = Layer::all().filter(|layer| is_made(*layer) && job.exr.picks(*layer));
    let described = written.map(|layer| {
        let value =
            json!({ "channels": layer.channel_names(), "unit": layer.unit_by(scene.tof.as_ref()) });
        (layer.name().to_owned(), value)
    });
    described.collect()
}
