//! What a run did, for programs.

use camlux::output::Layer;
use serde_json::{Map, Value, json};

use crate::summary::RunSummary;

/// The statistics of a run as one JSON object.
pub fn text(run: &RunSummary) -> String {
    format!("{:#}\n", object(run))
}

fn object(run: &RunSummary) -> Value {
    let stats = &run.frame.stats;
    let description = &run.frame.description;
    let passes: Vec<Value> = stats
        .passes
        .iter()
        .map(|pass| json!({ "name": pass.name, "milliseconds": pass.milliseconds }))
        .collect();
    let layers: Vec<&str> = match &run.args.layers {
        Some(layers) => layers.iter().copied().map(Layer::name).collect(),
        None => run
            .frame
            .layers
            .iter()
            .map(|(layer, _)| layer.name())
            .collect(),
    };
    let files: Vec<Value> = run
        .written
        .iter()
        .map(|file| json!({ "path": file.path.to_string_lossy(), "content": file.what }))
        .collect();
    let wall = run.wall.steps.iter();
    let wall = wall.map(|&(name, milliseconds)| (name.to_owned(), json!(milliseconds)));
    json!({
        "camlux_version": env!("CARGO_PKG_VERSION"),
        "scene": {
            "path": run.args.scene.to_string_lossy(),
            "hash": description.scene_hash,
        },
        "settings": {
            "resolution_px": run.frame.resolution_px,
            "estimator": description.indirect.map(|indirect| indirect.name()),
            "rsm_size": description.indirect.and_then(|indirect| indirect.rsm_size()),
            "target_error": description.indirect.and_then(|indirect| indirect.target_error()),
            "interpolation_error":
                description.indirect.and_then(|indirect| indirect.interpolation_error()),
            "half": run.args.half,
            "layers": layers,
        },
        "device": { "name": stats.device, "driver": stats.driver },
        "gpu_passes": passes,
        "vpl_count": stats.vpl_count,
        "pixel_vpl_pairs": stats.pixel_vpl_pairs,
        "pairs_per_second": stats.pairs_per_second(),
        "ray_count": stats.ray_count,
        "estimated_error": stats.estimated_error,
        "estimated_interpolation_error": stats.estimated_interpolation_error,
        "submissions": stats.submissions,
        "frame_wall_milliseconds": stats.wall_milliseconds,
        "wall_milliseconds": Map::from_iter(wall),
        "files": files,
        "warnings": run.warnings,
    })
}
