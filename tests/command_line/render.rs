//! `camlux render` from the scene file to the image files, on a real device.
#![cfg(feature = "cli")]

use std::{fs, path::Path, process::Output};

use crate::exr_attributes::text_attribute;
use crate::program::{
    self, assert_succeeds, copy_scene_files, files, json, program, run, scene_file, stderr, stdout,
};
use crate::rows::{assert_says, rows};
use exr::prelude::{AttributeValue, FlatImage, FlatSamples, Text, read_all_flat_layers_from_file};

/// `camlux render` of a demo scene at 24 × 16 pixels into `a.exr` of a folder, with more arguments.
pub fn render(folder: &Path, name: &str, more: &[&str]) -> Output {
    let scene = scene_file(name);
    let mut arguments = vec!["render", scene.to_str().unwrap(), "--size", "24", "16"];
    arguments.extend(["--rsm-size", "8", "-o", "a.exr"]);
    arguments.extend(more);
    run(folder, &arguments)
}

/// The same as [`program::assert_fails`], and no file is left.
#[track_caller]
pub fn assert_fails(folder: &Path, output: &Output, says: &[&str]) {
    program::assert_fails(output, says);
    assert_eq!(files(folder), [""; 0], "no file is left");
}

pub fn read(path: &Path) -> FlatImage {
    read_all_flat_layers_from_file(path).unwrap()
}

pub fn channels(image: &FlatImage) -> Vec<(String, FlatSamples)> {
    let list = image.layer_data[0].channel_data.list.iter();
    list.map(|channel| (channel.name.to_string(), channel.sample_data.clone()))
        .collect()
}

fn channel_names(image: &FlatImage) -> Vec<String> {
    channels(image).into_iter().map(|(name, _)| name).collect()
}

#[test]
fn a_scene_becomes_image_preview_and_statistics() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--png", "a.png", "--stats", "a.json"];
    let stderr = assert_succeeds(&render(folder.path(), "cornell", &more));
    assert_says(&stderr, &["a.exr", "a.png", "a.json", "time ", " ms"]);
    // -v prints these lines, too.
    let more = [&more[..], &["-v"]].concat();
    let verbose = assert_succeeds(&render(folder.path(), "cornell", &more));
    for part in [
        "passes", "gbuffer ", "direct ", "gather ", "sensor ", "VPLs", "pairs/s", "device",
    ] {
        assert!(verbose.contains(part), "{part:?} is missing in: {verbose}");
        let is_shown = stderr.contains(&format!("\n{part}  "));
        assert!(!is_shown, "{part:?} is in: {stderr}");
    }
    assert_eq!(files(folder.path()), ["a.exr", "a.json", "a.png"]);

    let image = read(&folder.path().join("a.exr"));
    let size = image.layer_data[0].size;
    assert_eq!((size.0, size.1), (24, 16));
    let names = channel_names(&image);
    assert_eq!(names.len(), 5 * 3 + 2 * 3 + 2 + 2, "{names:?}");
    assert_eq!(text_attribute(&image, "camlux.estimator"), "rsm-average");
    assert_eq!(text_attribute(&image, "camlux.unit.energy"), "J");
    assert!(text_attribute(&image, "camlux.light.0.kind").contains("point"));
    let is_black = |samples: &FlatSamples| samples.values_as_f32().all(|value| value == 0.0);
    for (name, samples) in channels(&image) {
        assert!(!is_black(&samples), "{name} has values");
    }

    let preview = image::open(folder.path().join("a.png")).unwrap();
    assert_eq!((preview.width() % 24, preview.height()), (0, 16));
    assert!(preview.width() >= 3 * 24, "three panels");

    let stats = json(&folder.path().join("a.json"));
    assert_eq!(
        stats["settings"]["resolution_px"],
        serde_json::json!([24, 16])
    );
    assert_eq!(stats["settings"]["rsm_size"], 8);
    assert_eq!(stats["ray_count"], 0);
    for key in [
        "target_error",
        "error_norm",
        "max_ms",
        "max_rays",
        "stderr_layer",
        "interpolation_error",
    ] {
        assert_eq!(stats["settings"][key], serde_json::Value::Null, "{key}");
    }
    for key in [
        "estimated_error",
        "estimated_error_upper",
        "estimated_interpolation_error",
        "stop",
    ] {
        assert_eq!(stats[key], serde_json::Value::Null, "{key}");
    }
    let hash = text_attribute(&image, "camlux.scene_hash");
    assert_eq!(stats["scene"]["hash"], serde_json::json!(hash));
    assert_eq!(stats["warnings"], serde_json::json!([]));
    let vpl_count = stats["vpl_count"].as_u64().unwrap();
    assert!(0 < vpl_count && vpl_count <= 6 * 8 * 8, "{vpl_count}");
    let passes = stats["gpu_passes"].as_array().unwrap();
    for name in [
        "gbuffer",
        "rsm",
        "shadow",
        "direct",
        "vpl",
        "receivers",
        "gather",
        "sensor",
    ] {
        let pass = passes.iter().find(|pass| pass["name"] == name);
        let milliseconds = pass.and_then(|pass| pass["milliseconds"].as_f64());
        assert!(
            milliseconds.is_some_and(|ms| ms > 0.0),
            "{name}: {passes:?}"
        );
    }
}

#[test]
fn layers_and_half_pick_what_is_stored() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--layers", "direct,depth,id.instance", "--half"];
    assert_succeeds(&render(folder.path(), "cornell", &more));
    let image = read(&folder.path().join("a.exr"));
    let names = channel_names(&image);
    assert_eq!(
        names,
        ["depth.Z", "direct.B", "direct.G", "direct.R", "id.instance"]
    );
    for (name, samples) in channels(&image) {
        let fits = match samples {
            FlatSamples::F16(_) => name.starts_with("direct"),
            FlatSamples::F32(_) => name == "depth.Z",
            FlatSamples::U32(_) => name == "id.instance",
        };
        assert!(fits, "{name}");
    }
}

/// Layers that no file shows are not read. Nothing that is written changes.
#[test]
fn files_of_some_layers_are_as_if_all_were_read() {
    for (name, layers) in [
        ("cornell_spot", "P,id.material"),
        ("tof_corner", "tof0.amplitude,N"),
        ("tof_corner", "direct"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let [exr, png] = ["a.exr", "a.png"].map(|file| folder.path().join(file));
        assert_succeeds(&render(folder.path(), name, &["--png", "a.png"]));
        let all = channels(&read(&exr));
        let picture = fs::read(&png).unwrap();
        let more = ["--png", "a.png", "--layers", layers];
        assert_succeeds(&render(folder.path(), name, &more));
        let some = channels(&read(&exr));
        assert!(!some.is_empty() && some.len() < all.len());
        let missing = some.iter().find(|channel| !all.contains(channel));
        assert!(missing.is_none(), "{name}: {missing:?}");
        assert!(fs::read(&png).unwrap() == picture, "{name}: {layers}");
    }
}

#[test]
fn a_layer_that_the_frame_will_not_have_is_refused_before_the_render() {
    let folder = tempfile::tempdir().unwrap();
    // The glossy scene has no sensor.
    let output = render(folder.path(), "glossy", &["--layers", "energy"]);
    assert_fails(
        folder.path(),
        &output,
        &["energy", "give the scene a sensor"],
    );
    let output = render(folder.path(), "cornell_spot", &["--layers", "stderr"]);
    assert_fails(
        folder.path(),
        &output,
        &["stderr", "set stderr_layer of its indirect light"],
    );
}

#[test]
fn a_render_has_standard_errors_where_they_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--target-error", "0.2", "--stderr-layer"];
    assert_succeeds(&render(folder.path(), "cornell_spot", &more));
    let image = read(&folder.path().join("a.exr"));
    for channel in ["stderr.R", "stderr.G", "stderr.B"] {
        assert!(channel_names(&image).contains(&channel.to_owned()));
    }
    assert_eq!(text_attribute(&image, "camlux.unit.stderr"), "W/sr/m^2");
}

#[test]
fn estimator_turns_indirect_light_on() {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(scene_file("cornell")).unwrap();
    let (direct_only, _) = text.split_once("[indirect]").unwrap();
    copy_scene_files(&["cornell.obj", "cornell.mtl"], folder.path());
    fs::write(folder.path().join("s.toml"), direct_only).unwrap();
    let run = |more: &[&str]| {
        let mut arguments = vec!["render", "s.toml", "--size", "24", "16", "-o", "a.exr"];
        arguments.extend(more);
        let stderr = assert_succeeds(&run(folder.path(), &arguments));
        (stderr, read(&folder.path().join("a.exr")))
    };

    let (stderr, image) = run(&[]);
    assert!(!stderr.contains("VPLs"), "{stderr}");
    assert!(!channel_names(&image).contains(&"indirect.R".to_owned()));
    assert_eq!(text_attribute(&image, "camlux.estimator"), "none");

    for (estimator, filled_in) in [
        ("rsm-average", "no rsm_size for rsm-average: using 64"),
        (
            "instant-radiosity",
            "no rsm_size for instant-radiosity: using 64",
        ),
        ("final-gather", "target 2.00 %"),
    ] {
        let (stderr, image) = run(&["--estimator", estimator]);
        assert!(stderr.contains(filled_in), "{stderr}");
        assert!(channel_names(&image).contains(&"indirect.R".to_owned()));
        assert_eq!(text_attribute(&image, "camlux.estimator"), estimator);
    }
}

/// The target error is in the plan, in the header and in the statistics.
#[test]
fn a_target_error_is_said_everywhere() {
    let folder = tempfile::tempdir().unwrap();
    let more = [
        ["--target-error", "0.2"],
        ["--error-norm", "image"],
        ["--max-rays", "5000000000"],
        ["--max-ms", "600000"],
        ["--stats", "a.json"],
    ];
    let more = [more.as_flattened(), &["--plan"]].concat();
    let stderr = assert_succeeds(&render(folder.path(), "cornell_spot", &more));
    assert_says(
        &stderr,
        &[
            "visibility by rays",
            "target error 0.2 over the image",
            "for 600000 ms at most",
            "with 5000000000 rays at most",
            "target 20.00 %",
        ],
    );
    let image = read(&folder.path().join("a.exr"));
    let attributes = &image.layer_data[0].attributes.other;
    let requested = attributes.get(&Text::from("camlux.target_error"));
    assert_eq!(requested, Some(&AttributeValue::F32(0.2)));
    assert_eq!(text_attribute(&image, "camlux.error_norm"), "image");
    let max_ms = attributes.get(&Text::from("camlux.max_ms"));
    assert_eq!(max_ms, Some(&AttributeValue::F32(600_000.0)));
    let stats = json(&folder.path().join("a.json"));
    let settings = &stats["settings"];
    assert_eq!(settings["target_error"], 0.2);
    assert_eq!(settings["error_norm"], "image");
    assert_eq!(settings["max_ms"], 600_000.0);
    assert_eq!(settings["stderr_layer"], false);
    assert_eq!(settings["max_rays"], 5_000_000_000_u64);
    assert_eq!(settings["interpolation_error"], serde_json::Value::Null);
    assert!(stats["ray_count"].is_u64());
    assert_eq!(stats["stop"], "target-met");
    assert_eq!(text_attribute(&image, "camlux.stop"), "target-met");
}

/// The interpolation error is relative to the sum at every pixel. It does not include the distance of the sum from the true bounce.
#[test]
fn an_interpolation_error_counts_against_the_sum() {
    let folder = tempfile::tempdir().unwrap();
    let more = [
        "--interpolation-error",
        "0.05",
        "--plan",
        "--stats",
        "a.json",
    ];
    let stderr = assert_succeeds(&render(folder.path(), "cornell", &more));
    assert_says(
        &stderr,
        &[
            "rsm-average, no visibility",
            "interpolation error 0.05",
            "ray tree (BVH): nothing casts rays",
            "target 5.00 % (relRMSE against the sum at every pixel)",
        ],
    );
    let stats = json(&folder.path().join("a.json"));
    assert_eq!(stats["settings"]["interpolation_error"], 0.05);
    let estimated = stats["estimated_interpolation_error"].as_f64();
    assert!(estimated.unwrap() <= 0.05);
    assert_eq!(stats["estimated_error"], serde_json::Value::Null);
    let attributes = read(&folder.path().join("a.exr")).layer_data.remove(0);
    let has = |name: &str| attributes.attributes.other.contains_key(&Text::from(name));
    assert!(has("camlux.interpolation_error") && has("camlux.estimated_interpolation_error"));
    assert!(!has("camlux.target_error") && !has("camlux.estimated_error"));
}

#[test]
fn what_does_not_go_together_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |(name, more): &(&str, [&str; 2]), says: &[&str]| {
        assert_fails(folder.path(), &render(folder.path(), name, more), says);
    };
    rows! { refused;
        ("cornell", ["--target-error", "0.02"]) =>
            "--target-error belongs to final-gather, but the estimator is rsm-average";
        ("cornell_spot", ["--interpolation-error", "0.02"]) =>
            "--interpolation-error belongs to rsm-average, but the estimator is final-gather";
        ("cornell", ["--interpolation-error", "0.6"]) => "from 0.002 to 0.5";
        ("cornell_spot", ["--target-error", "0.001"]) => "from 0.002 to 0.5";
        ("cornell", ["--max-rays", "9"]) =>
            "--max-rays belongs to final-gather, but the estimator is rsm-average";
        ("cornell_spot", ["--max-ms", "0"]) => "max_ms is 0";
    }
}

#[test]
fn the_plan_goes_to_stdout_unless_there_is_an_image_to_make() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene_file("cornell");
    let scene = scene.to_str().unwrap();
    let output = run(folder.path(), &["render", scene, "--plan"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty());
    let plan = stdout(&output);
    assert_says(
        &plan,
        &["800 x 800 px", "rsm-average", "left out", "specular terms"],
    );
    assert_eq!(files(folder.path()), [""; 0]);

    let stderr = assert_succeeds(&render(folder.path(), "cornell", &["--plan"]));
    assert!(stderr.contains("24 x 16 px") && stderr.contains("left out"));
    assert_eq!(files(folder.path()), ["a.exr"]);
}

#[test]
fn what_is_probably_not_meant_is_said_and_in_the_statistics() {
    let folder = tempfile::tempdir().unwrap();
    let cornell = fs::read_to_string(scene_file("cornell")).unwrap();
    let text = cornell.replace("look_at = [0.0, 1.0, 0.0]", "look_at = [0.0, 1.0, 9.0]");
    assert_ne!(text, cornell);
    fs::write(folder.path().join("away.toml"), text).unwrap();
    copy_scene_files(&["cornell.obj", "cornell.mtl"], folder.path());
    let arguments = ["render", "away.toml", "-o", "a.exr", "--size", "8", "8"];
    let mut command = program(folder.path(), &arguments);
    let output = command.args(["--stats", "-"]).output().unwrap();
    let stderr = stderr(&output);
    assert!(output.status.success(), "{stderr}");
    assert_says(&stderr, &["camlux: warning: nothing is in view"]);
    let stats: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let warnings = stats["warnings"].as_array().unwrap();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].as_str().unwrap().contains("nothing is in view"));
    assert!(!folder.path().join("-").exists());
}

#[test]
fn outputs_destroy_neither_each_other_nor_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("own.exr");
    std::fs::write(&scene, "a scene").unwrap();
    for (arguments, says) in [
        (
            ["render", "b.toml", "-o", "x.exr", "--stats", "./x.exr"],
            "named for two outputs",
        ),
        (
            ["render", "own.exr", "-o", "./own.exr", "--stats", "s.json"],
            "is the scene file",
        ),
    ] {
        let output = run(folder.path(), &arguments);
        let stderr = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains(says), "{stderr}");
    }
    assert_eq!(std::fs::read_to_string(&scene).unwrap(), "a scene");
}
