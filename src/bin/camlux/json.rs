//! The result of a run, for programs.

use camlux::output::{Layer, PassTime, StopReason};
use camlux::scene::{IndirectLight, ParameterValue};
use serde_json::{Map, json};

use crate::summary::RunSummary;

/// The statistics of a run as one JSON object.
pub fn text(run: &RunSummary) -> String {
    let stats = &run.frame.stats;
    let description = &run.frame.description;
    let indirect = description.indirect;
    let times = |times: &[PassTime]| {
        let times = times.iter();
        let times =
            times.map(|time| json!({ "name": time.name, "milliseconds": time.milliseconds }));
        Vec::from_iter(times)
    };
    let of_frame = || run.frame.layers.iter().map(|(layer, _)| *layer).collect();
    let layers = run.layers.map_or_else(of_frame, <[Layer]>::to_vec);
    let files = run
        .written
        .iter()
        .map(|(content, path)| json!({ "path": path.to_string_lossy(), "content": content }));
    let wall = run.wall.iter();
    let wall = wall.map(|&(name, milliseconds)| (name.to_owned(), json!(milliseconds)));
    let mut object = json!({
        "camlux_version": env!("CARGO_PKG_VERSION"),
        "scene": {
            "path": run.scene.to_string_lossy(),
            "hash": description.scene_hash,
        },
        "settings": {
            "resolution_px": run.frame.resolution_px,
            "estimator": indirect.map(|i| i.name()),
            "half": run.half,
            "layers": Vec::from_iter(layers.into_iter().map(Layer::name)),
        },
        "device": { "name": stats.device, "driver": stats.driver },
        "gpu_passes": times(&stats.passes),
        "host_steps": times(&stats.host_steps),
        "vpl_count": stats.vpl_count,
        "pixel_vpl_pairs": stats.pixel_vpl_pairs,
        "pairs_per_second": stats.pairs_per_second(),
        "ray_count": stats.ray_count,
        "estimated_error": stats.estimated_error,
        "estimated_error_upper": stats.estimated_error_upper,
        "estimated_range_error_mm": stats.estimated_range_error_mm,
        "estimated_range_error_upper_mm": stats.estimated_range_error_upper_mm,
        "stop": stats.stop.map(StopReason::name),
        "least_rays": stats.least_rays,
        "least_ms": stats.least_milliseconds,
        "estimated_interpolation_error": stats.estimated_interpolation_error,
        "estimated_area_light_error": stats.estimated_area_light_error,
        "submissions": stats.submissions,
        "frame_wall_milliseconds": stats.wall_milliseconds,
        "wall_milliseconds": Map::from_iter(wall),
        "files": Vec::from_iter(files),
        "warnings": run.warnings,
    });
    for parameter in IndirectLight::all_parameters() {
        let value = indirect.and_then(|indirect| indirect.value(parameter.name));
        object["settings"][parameter.name] = match value {
            None => json!(null),
            Some(ParameterValue::Number(number)) => json!(number),
            Some(ParameterValue::Pair(numbers)) => json!(numbers),
            Some(ParameterValue::Bands(numbers) | ParameterValue::Coefficients(numbers)) => {
                json!(numbers)
            }
            Some(ParameterValue::Count(count)) => json!(count),
            Some(ParameterValue::Name(word)) => json!(word),
            Some(ParameterValue::Flag(flag)) => json!(flag),
        };
    }
    format!("{object:#}\n")
}
