//! `camlux render` from the scene file to the image files, on a real device.
#![cfg(feature = "cli")]

use std::{
    fs,
    io::{BufRead, BufReader, Lines},
    path::{Path, PathBuf},
    process::{Child, ChildStderr, Command, Output, Stdio},
};

use crate::exr_attributes::text_attribute;
use camlux::{Device, DeviceOptions};
use exr::prelude::{AttributeValue, FlatImage, FlatSamples, Text, read_all_flat_layers_from_file};

fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_camlux"));
    command.args(arguments).current_dir(folder);
    // Messages of the validation layer go to stdout, which the tests require to be empty.
    command.env("VK_INSTANCE_LAYERS", "VK_LAYER_KHRONOS_validation");
    command
}

/// `camlux render` of a demo scene at 24 × 16 pixels into `a.exr` of a folder, with more arguments.
fn render(folder: &Path, name: &str, more: &[&str]) -> Output {
    let scene = scene_file(name);
    let mut arguments = vec!["render", scene.to_str().unwrap(), "--size", "24", "16"];
    arguments.extend(["--rsm-size", "8", "-o", "a.exr"]);
    arguments.extend(more);
    program(folder, &arguments).output().unwrap()
}

fn scene_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"))
}

/// The program's stderr. Checks that the program succeeded and that stdout is empty.
#[track_caller]
fn assert_succeeds(output: &Output) -> String {
    let stderr = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert!(output.stdout.is_empty(), "stdout stays clean");
    stderr
}

/// Checks that stderr has one line with these parts, that the exit code is 1 and that no file is left.
#[track_caller]
fn assert_fails(folder: &Path, output: &Output, says: &[&str]) {
    let stderr = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    for part in says {
        assert!(stderr.contains(part), "{part:?} is missing in: {stderr}");
    }
    assert_eq!(files(folder), [""; 0], "no file is left");
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn read(path: &Path) -> FlatImage {
    read_all_flat_layers_from_file(path).unwrap()
}

fn channels(image: &FlatImage) -> Vec<(String, FlatSamples)> {
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
    for part in ["a.exr", "a.png", "a.json", "time ", " ms"] {
        assert!(stderr.contains(part), "{part:?} is missing in: {stderr}");
    }
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

    let json = fs::read_to_string(folder.path().join("a.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(&json).unwrap();
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
    for name in ["cornell.obj", "cornell.mtl"] {
        let from = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("scenes")
            .join(name);
        fs::copy(from, folder.path().join(name)).unwrap();
    }
    fs::write(folder.path().join("s.toml"), direct_only).unwrap();
    let run = |more: &[&str]| {
        let mut arguments = vec!["render", "s.toml", "--size", "24", "16", "-o", "a.exr"];
        arguments.extend(more);
        let stderr = assert_succeeds(&program(folder.path(), &arguments).output().unwrap());
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
    for part in [
        "visibility by rays",
        "target error 0.2 over the image",
        "for 600000 ms at most",
        "with 5000000000 rays at most",
        "target 20.00 %",
    ] {
        assert!(stderr.contains(part), "{part:?} is missing in: {stderr}");
    }
    let image = read(&folder.path().join("a.exr"));
    let attributes = &image.layer_data[0].attributes.other;
    let requested = attributes.get(&Text::from("camlux.target_error"));
    assert_eq!(requested, Some(&AttributeValue::F32(0.2)));
    assert_eq!(text_attribute(&image, "camlux.error_norm"), "image");
    let max_ms = attributes.get(&Text::from("camlux.max_ms"));
    assert_eq!(max_ms, Some(&AttributeValue::F32(600_000.0)));
    let json = fs::read_to_string(folder.path().join("a.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(&json).unwrap();
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
    for part in [
        "rsm-average, no visibility",
        "interpolation error 0.05",
        "ray tree (BVH): nothing casts rays",
        "target 5.00 % (relRMSE against the sum at every pixel)",
    ] {
        assert!(stderr.contains(part), "{part:?} is missing in: {stderr}");
    }
    let json = fs::read_to_string(folder.path().join("a.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(&json).unwrap();
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
    for (name, more, says) in [
        (
            "cornell",
            &["--target-error", "0.02"][..],
            "--target-error belongs to final-gather, but the estimator is rsm-average",
        ),
        (
            "cornell_spot",
            &["--interpolation-error", "0.02"],
            "--interpolation-error belongs to rsm-average, but the estimator is final-gather",
        ),
        (
            "cornell",
            &["--interpolation-error", "0.6"],
            "from 0.002 to 0.5",
        ),
        (
            "cornell_spot",
            &["--target-error", "0.001"],
            "from 0.002 to 0.5",
        ),
        (
            "cornell",
            &["--max-rays", "9"],
            "--max-rays belongs to final-gather, but the estimator is rsm-average",
        ),
        ("cornell_spot", &["--max-ms", "0"], "max_ms is 0"),
    ] {
        assert_fails(folder.path(), &render(folder.path(), name, more), &[says]);
    }
}

#[test]
fn the_plan_goes_to_stdout_unless_there_is_an_image_to_make() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene_file("cornell");
    let scene = scene.to_str().unwrap();
    let output = program(folder.path(), &["render", scene, "--plan"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty());
    let plan = String::from_utf8(output.stdout).unwrap();
    for part in ["800 x 800 px", "rsm-average", "left out", "specular terms"] {
        assert!(plan.contains(part), "{part:?} is missing in: {plan}");
    }
    assert_eq!(files(folder.path()), [""; 0]);

    let stderr = assert_succeeds(&render(folder.path(), "cornell", &["--plan"]));
    assert!(stderr.contains("24 x 16 px") && stderr.contains("left out"));
    assert_eq!(files(folder.path()), ["a.exr"]);
}

#[test]
fn a_tracer_is_forced() {
    let folder = tempfile::tempdir().unwrap();
    let more = [
        "--estimator",
        "final-gather",
        "--plan",
        "--tracer",
        "kernel",
    ];
    let plan = assert_succeeds(&render(folder.path(), "cornell", &more));
    assert!(plan.contains("trace      by kernel, up to"), "{plan}");
}

#[test]
fn a_device_is_picked_by_index_or_part_of_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let info = program(folder.path(), &["info"]).output().unwrap();
    assert_eq!(info.status.code(), Some(0));
    assert!(info.stderr.is_empty());
    let info = String::from_utf8(info.stdout).unwrap();
    for part in [
        "usable",
        "driver",
        "largest image",
        "storage buffer",
        "default: ",
    ] {
        assert!(info.contains(part), "{part:?} is missing in: {info}");
    }
    let (_, chosen) = info.split_once("default: ").unwrap();
    let (index, name) = chosen.trim().split_once(' ').unwrap();
    let loud = name.to_uppercase();
    let (_, uuid) = info.split_once("UUID").unwrap();
    let uuid = uuid.split_whitespace().next().unwrap();
    for device in [index, name, &loud[..name.len() - 1], uuid] {
        let stderr = assert_succeeds(&render(
            folder.path(),
            "cornell",
            &["-v", "--device", device],
        ));
        assert!(stderr.contains(name), "{stderr}");
        fs::remove_file(folder.path().join("a.exr")).unwrap();
    }
    for (device, problem) in [
        ("99", "there is no device 99"),
        ("voodoo", "no device is called \"voodoo\""),
        ("ff:1f.7", "no device is at the PCI address ff:1f.7"),
    ] {
        let output = render(folder.path(), "cornell", &["--device", device]);
        assert_fails(
            folder.path(),
            &output,
            &[problem, "choose one of: 0 \"", name],
        );
    }
    let scene = scene_file("cornell");
    let mut command = Command::new(env!("CARGO_BIN_EXE_camlux"));
    command.args(["render", scene.to_str().unwrap(), "-o", "a.exr"]);
    command
        .current_dir(folder.path())
        .env("CAMLUX_DEVICE", "voodoo");
    let says = "CAMLUX_DEVICE is \"voodoo\": no device is called";
    assert_fails(folder.path(), &command.output().unwrap(), &[says]);
}

#[test]
fn without_a_driver_it_says_what_to_install() {
    let folder = tempfile::tempdir().unwrap();
    let without_driver = |command: &mut Command| {
        // The newer and the older name of the loader's variable.
        for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
            command.env(variable, folder.path().join("none.json"));
        }
        command.output().unwrap()
    };
    let says = ["no driver", "apt-get install", "mesa-vulkan-drivers"];
    let scene = scene_file("cornell");
    let arguments = ["render", scene.to_str().unwrap(), "-o", "a.exr"];
    let output = without_driver(&mut program(folder.path(), &arguments));
    assert_fails(folder.path(), &output, &says);
    assert!(output.stdout.is_empty());

    let output = without_driver(&mut program(folder.path(), &["info"]));
    assert_eq!(output.status.code(), Some(1));
    let stdout = String::from_utf8(output.stdout).unwrap();
    assert_eq!(stdout.lines().count(), 1, "{stdout}");
    for part in says {
        assert!(stdout.contains(part), "{part:?} is missing in: {stdout}");
    }
}

#[test]
fn an_image_over_the_devices_limits_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene_file("cornell");
    let scene = scene.to_str().unwrap();
    let refused = |[width, height]: [&str; 2], says: &[&str]| {
        let arguments = ["render", scene, "-o", "a.exr", "--size", width, height];
        let output = program(folder.path(), &arguments).output().unwrap();
        assert_fails(folder.path(), &output, says);
    };
    refused(
        ["300000", "4"],
        &["300000", "over the limit", "smaller image"],
    );
    // Images of 4 GiB are over the limit of one allocation, or do not fit in memory.
    let device = Device::open(&DeviceOptions::default()).unwrap();
    let limits = &device.info().limits;
    if limits.memory_bytes < 28 << 30 || limits.max_allocation_bytes < 4 << 30 {
        let says = ["(bytes) is", "over the limit of", "smaller image"];
        refused(["16384", "16384"], &says);
    }
}

/// Starts a render and waits until it has reached the gather. Returns it and its further stderr lines.
fn render_at_work(folder: &Path, name: &str) -> (Child, Lines<BufReader<ChildStderr>>) {
    let scene = scene_file("cornell");
    let arguments = ["render", scene.to_str().unwrap(), "-o", name];
    // About 270 G pairs, far more than can be computed before a signal.
    let mut child = program(folder, &arguments)
        .args(["--size", "2048", "2048", "--rsm-size", "256"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.any(|line| line.unwrap().contains("gather")));
    (child, lines)
}

/// Only the hidden unfinished file is left, and an existing file is unchanged.
#[test]
fn a_killed_render_leaves_no_half_image() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("old.exr"), "old").unwrap();
    for name in ["new.exr", "old.exr"] {
        let (mut child, _stderr) = render_at_work(folder.path(), name);
        child.kill().unwrap();
        let status = child.wait().unwrap();
        assert!(status.code().is_none(), "killed at work: {status}");
    }
    let visible: Vec<String> = files(folder.path())
        .into_iter()
        .filter(|name| !(name.starts_with('.') && name.ends_with(".part")))
        .collect();
    assert_eq!(visible, ["old.exr"]);
    assert_eq!(
        fs::read_to_string(folder.path().join("old.exr")).unwrap(),
        "old"
    );
}

/// Ctrl-C and SIGTERM end the program between two submissions, after it has removed its files.
#[test]
fn a_terminated_render_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (mut child, lines) = render_at_work(folder.path(), "a.exr");
    let pid = child.id().to_string();
    let signal = Command::new("kill").args(["-TERM", &pid]).status().unwrap();
    assert!(signal.success());
    let rest: Vec<String> = lines.map(|line| line.unwrap()).collect();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{rest:?}");
    assert!(
        rest.iter().any(|line| line.contains("cancelled")),
        "{rest:?}"
    );
    assert_eq!(files(folder.path()), Vec::<String>::new());
}

/// The image does not depend on the number of threads. The driver reads that number when it is loaded.
#[test]
fn threads_do_not_show() {
    let ways: [(&str, &[&str]); 5] = [
        ("cornell", &["rsm-average"]),
        ("cornell", &["instant-radiosity"]),
        ("glossy", &["rsm-average"]),
        ("glossy", &["instant-radiosity"]),
        ("glossy", &["final-gather", "--target-error", "0.1"]),
    ];
    for (name, estimator) in ways {
        let folder = tempfile::tempdir().unwrap();
        // A CPU may have fewer cores than threads. The scheduler then interrupts the threads at different points in each run.
        let images = ["1", "2", "4"].map(|threads| {
            let scene = scene_file(name);
            let arguments = ["render", scene.to_str().unwrap(), "-o", "a.exr"];
            let output = program(folder.path(), &arguments)
                .args(["--size", "64", "64", "--rsm-size", "24", "--estimator"])
                .args(estimator)
                .env("LP_NUM_THREADS", threads)
                .output()
                .unwrap();
            assert_succeeds(&output);
            channels(&read(&folder.path().join("a.exr")))
        });
        let of_one_thread = &images[0];
        let is_lit = of_one_thread.iter().any(|(name, samples)| {
            name == "indirect.G" && samples.values_as_f32().any(|value| value > 0.0)
        });
        assert!(is_lit, "a black image proves nothing");
        assert!(
            images.iter().all(|image| image == of_one_thread),
            "{name}, {estimator:?}"
        );
    }
}

#[test]
fn what_is_probably_not_meant_is_said_and_in_the_statistics() {
    let folder = tempfile::tempdir().unwrap();
    let cornell = fs::read_to_string(scene_file("cornell")).unwrap();
    let text = cornell.replace("look_at = [0.0, 1.0, 0.0]", "look_at = [0.0, 1.0, 9.0]");
    assert_ne!(text, cornell);
    fs::write(folder.path().join("away.toml"), text).unwrap();
    for name in ["cornell.obj", "cornell.mtl"] {
        let file = scene_file("cornell").with_file_name(name);
        fs::copy(file, folder.path().join(name)).unwrap();
    }
    let arguments = ["render", "away.toml", "-o", "a.exr", "--size", "8", "8"];
    let mut command = program(folder.path(), &arguments);
    let output = command.args(["--stats", "-"]).output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    assert!(
        stderr.contains("camlux: warning: nothing is in view"),
        "{stderr}"
    );
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
        let output = program(folder.path(), &arguments).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains(says), "{stderr}");
    }
    assert_eq!(std::fs::read_to_string(&scene).unwrap(), "a scene");
}
