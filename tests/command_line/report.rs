//! The report on speed and error, on a real device, with a stand-in for the peers program.
#![cfg(all(feature = "cli", unix))]

use std::{fs, os::unix::fs::PermissionsExt, path::Path, process::Output};

use crate::rows::assert_says;
use serde_json::Value;

use crate::program::{assert_fails, copy_scene_files, json, run, scene_file, stderr};

const SIZE: [&str; 3] = ["--size", "24", "20"];

/// Runs `camlux report --quick` of the Cornell box, with output to `out` in a folder.
fn report(folder: &Path, more: &[&str]) -> Output {
    let scene = scene_file("cornell");
    let mut arguments = vec!["report", scene.to_str().unwrap(), "--quick", "-o", "out"];
    arguments.extend(SIZE);
    arguments.extend(more);
    run(folder, &arguments)
}

/// The only scene of a successful report, and the HTML page.
#[track_caller]
fn read(folder: &Path, output: &Output) -> (Value, String) {
    let stderr = stderr(output);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert_eq!(stdout.lines().count(), 1, "one line a scene: {stdout}");
    assert!(stdout.starts_with("cornell: "), "{stdout}");
    let json = json(&folder.join("out/report.json"));
    let page = fs::read_to_string(folder.join("out/index.html")).unwrap();
    (json["scenes"][0].clone(), page)
}

/// The entries of a series.
fn series<'a>(scene: &'a Value, name: &str) -> Vec<&'a Value> {
    let entries = scene["entries"].as_array().unwrap().iter();
    entries.filter(|entry| entry["series"] == name).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().filter(|v| v.is_finite()).unwrap()
}

/// Checks that an entry of the engine has times and errors.
#[track_caller]
fn assert_is_measured(entry: &Value) {
    assert!(number(&entry["seconds"]["median"]) > 0.0);
    assert!(entry["seconds"]["runs"].as_array().unwrap().len() >= 2);
    assert!(number(&entry["indirect"]["relative_rmse"]) > 0.0);
    assert!(number(&entry["total"]["relative_rmse"]) > 0.0);
    let with_edges = number(&entry["indirect"]["relative_rmse_with_edges"]);
    assert!(with_edges > 0.0 && with_edges != number(&entry["indirect"]["relative_rmse"]));
    assert_eq!(entry["indirect"]["non_finite"], 0);
}

/// Writes a program that copies `a.exr` to its output folder and prints `lines`, with OUT replaced by the output folder.
fn write_peers(folder: &Path, lines: &str) -> String {
    let path = folder.join("peers");
    let script = format!(
        "#!/bin/sh\nwhile [ $# -gt 0 ]; do [ \"$1\" = --output ] && out=$2; shift; done\n\
         cp {}/a.exr \"$out/a.exr\"\nsed \"s|OUT|$out|g\" <<'LINES'\n{lines}\nLINES\n",
        folder.display()
    );
    fs::write(&path, script).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_report_says_how_fast_and_how_wrong_each_setting_is() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();

    // A missing peers program gives a warning, not an error.
    let output = report(folder, &["--peers", "./not_there"]);
    let (scene, page) = read(folder, &output);
    let stderr = stderr(&output);
    assert_says(&stderr, &["camlux: warning: cornell: peers: "]);
    let status = scene["peers"]["status"].as_str().unwrap();
    assert!(status.contains("not_there failed"), "{status}");
    assert!(page.contains("not_there failed"));

    assert_eq!(scene["resolution_px"], serde_json::json!([24, 20]));
    assert_eq!(scene["reference"]["was_there"], false);
    let noise = scene["reference"]["noise_floor"].as_f64().unwrap();
    assert!(noise > 0.0 && noise <= 0.03, "{noise}");
    // The box's edges run through pixel centres at every image size.
    let edge_pixels = scene["reference"]["edge_pixels"].as_u64().unwrap();
    let share = scene["reference"]["edge_share"].as_f64().unwrap();
    assert!(edge_pixels > 0 && edge_pixels < 30, "{edge_pixels}");
    assert!((share - edge_pixels as f64 / 480.0).abs() < 0.02, "{share}");
    assert!(page.contains(&format!("{edge_pixels} pixels (")));
    for name in ["rsm-average", "instant-radiosity"] {
        let entries = series(&scene, name);
        assert_eq!(entries.len(), 4, "sizes 8 to 64");
        for (entry, size) in entries.into_iter().zip([8, 16, 32, 64]) {
            assert_is_measured(entry);
            let engine = &entry["engine"];
            // f32 compared with f64 on the same VPLs, with the bound of `compare::kernels`.
            assert!(number(&engine["kernel_error"]) <= 9e-7);
            let passes = engine["gpu_passes"].as_array().unwrap();
            assert!(passes.iter().any(|pass| pass["name"] == "gather"));
            assert_eq!(engine["estimator"], name);
            assert_eq!(engine["rsm_size"], size);
            assert_eq!(engine["ray_count"], 0);
            for error in ["target_error", "estimated_error"] {
                assert_eq!(engine[error], Value::Null, "{error}");
            }
        }
    }
    let entries = series(&scene, "final-gather");
    assert_eq!(entries.len(), 2, "5 and 2 %");
    for (entry, requested) in entries.into_iter().zip([0.05, 0.02]) {
        assert_is_measured(entry);
        let engine = &entry["engine"];
        assert_eq!(engine["estimator"], "final-gather");
        assert_eq!(engine["target_error"], requested);
        assert!(engine["ray_count"].as_u64().unwrap() > 0);
        let estimated = engine["estimated_error"].as_f64().unwrap();
        assert!(estimated > 0.0 && estimated <= requested, "{estimated}");
        // The engine chose the RSM size, so it is not a setting. There is no sum to compute in f64.
        assert_eq!(engine["rsm_size"], Value::Null);
        assert_eq!(engine["kernel_error"], Value::Null);
    }
    for part in [
        "final-gather requested 5 %",
        "the engine&#39;s estimate",
        "is its own standard error",
    ] {
        assert!(page.contains(part), "{part:?} is missing in the page");
    }
    // The documented errors of the two sums are for 200 x 200 (`compare::truth`); here they are similar.
    let error_at_64 = |estimator| {
        let entry = series(&scene, estimator)[3];
        entry["indirect"]["relative_rmse"].as_f64().unwrap()
    };
    assert!((error_at_64("rsm-average") - 0.84).abs() < 0.1);
    assert!((error_at_64("instant-radiosity") - 0.31).abs() < 0.15);
    assert!(series(&scene, "camlux reference").len() >= 2);
    let entries = scene["entries"].as_array().unwrap();
    assert!(entries.iter().any(|entry| entry["is_on_front"] == true));

    // The page is self-contained: it fetches nothing.
    for reference in [
        "src=\"http",
        "href=",
        "<script ",
        "import ",
        "fetch(",
        "@import",
        "url(",
    ] {
        assert!(!page.contains(reference), "{reference}");
    }
    assert!(page.contains("<svg") && page.contains("src=\"data:image/png;base64,"));
    for file in ["cornell-model-error.svg", "cornell-kernel-error.svg"] {
        assert!(folder.join("out").join(file).exists(), "{file}");
    }
    assert!(!folder.join("out/timing.exr").exists());

    // The engine's own image, given as a peer's, has the engine's error. The report reuses the existing reference.
    let render = run(
        folder,
        &[
            &[
                "render",
                scene_file("cornell").to_str().unwrap(),
                "-o",
                "a.exr",
            ],
            &SIZE[..],
            &["--estimator", "instant-radiosity", "--rsm-size", "16"],
        ]
        .concat(),
    );
    assert!(render.status.success());
    let peers = write_peers(
        folder,
        r#"{"about":"a <stand-in>","notes":["nothing is fair & square"]}
{"peer":"copy","label":"a copy","spp":7,"seconds":[0.5,0.25,2],"seconds_median":0.5,"seconds_of":{"render":0.4},"image":"OUT/a.exr"}
{"peer":"refusal","unsupported":"it does not like boxes"}"#,
    );
    let (scene, page) = read(folder, &report(folder, &["--peers", &peers]));
    assert_eq!(scene["reference"]["was_there"], true);
    let copy = series(&scene, "copy");
    assert_eq!(copy.len(), 1);
    assert_eq!(copy[0]["kind"], "peer");
    assert_eq!(copy[0]["label"], "7 spp");
    assert_eq!(copy[0]["seconds"]["median"], 0.5);
    assert_eq!(
        copy[0]["indirect"],
        series(&scene, "instant-radiosity")[1]["indirect"]
    );
    assert_eq!(scene["peers"]["unsupported"][0]["peer"], "refusal");
    assert!(page.contains("a &lt;stand-in&gt;") && page.contains("fair &amp; square"));
    assert!(page.contains("it does not like boxes"));
}

/// Replaces a part of a text file.
fn edit(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{} lacks {from:?}", path.display());
    fs::write(path, text.replace(from, to)).unwrap();
}

#[test]
fn a_report_that_was_cut_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    copy_scene_files(&["cornell.toml", "cornell.obj", "cornell.mtl"], folder);
    let calls = folder.join("calls");
    let peers = write_peers(
        folder,
        r#"{"peer":"copy","label":"a copy","seconds":[0.5],"image":"OUT/a.exr"}"#,
    );
    edit(
        Path::new(&peers),
        "#!/bin/sh\n",
        &format!("#!/bin/sh\necho >>{}\n", calls.display()),
    );
    let size = ["--size", "12", "10"];
    let rendered = run(
        folder,
        &[&["render", "cornell.toml", "-o", "a.exr"], &size[..]].concat(),
    );
    assert!(rendered.status.success());
    let report = || {
        let quick = [
            "report",
            "cornell.toml",
            "--quick",
            "-o",
            "out",
            "--peers",
            &peers,
        ];
        run(folder, &[&quick[..], &size].concat())
    };
    let counts = || {
        let json = json(&folder.join("out/report.json"));
        let counts = &json["measurements"];
        let count = |name: &str| counts[name].as_u64().unwrap();
        (count("all"), count("of_earlier_run"))
    };
    let (first, page) = read(folder, &report());
    let (all, earlier) = counts();
    // Direct light, and the series of the engine, the reference and the peers.
    assert!(all > 1 + 10 + 2 && earlier == 0, "{earlier} of {all}");
    assert!(!page.contains("earlier run"));
    assert_eq!(first["entries"].as_array().unwrap().len() as u64, all - 1);

    // The state after a killed process: one measurement is missing, another is half a file.
    let measured = folder.join("out/measured/cornell-12x10");
    fs::remove_file(folder.join("out/report.json")).unwrap();
    fs::remove_file(folder.join("out/index.html")).unwrap();
    fs::remove_file(measured.join("instant-radiosity-16.json")).unwrap();
    let damaged = measured.join("final-gather-requested-5.json");
    let text = fs::read_to_string(&damaged).unwrap();
    fs::write(&damaged, &text[..text.len() / 2]).unwrap();
    let output = report();
    let (again, page) = read(folder, &output);
    assert_eq!(counts(), (all, all - 2));
    let stderr = stderr(&output);
    let steps = stderr.lines().filter(|line| line.starts_with("cornell: "));
    assert_eq!(
        Vec::from_iter(steps),
        [
            "cornell: instant-radiosity 16²",
            "cornell: final-gather requested 5 %"
        ]
    );
    let note = format!("{} of {all} measurements are from an earlier run", all - 2);
    assert!(stderr.contains(&note) && page.contains(&note), "{stderr}");
    assert_eq!(fs::read_to_string(&calls).unwrap().lines().count(), 1);

    // Kept measurements are identical. Repeated ones have new times but the same error.
    let entries = |scene: &Value| scene["entries"].as_array().unwrap().clone();
    for (before, after) in entries(&first).iter().zip(&entries(&again)) {
        assert_eq!(before["label"], after["label"]);
        assert_eq!(before["indirect"], after["indirect"]);
        let is_new = before["seconds"] != after["seconds"];
        let name = (before["series"].as_str(), before["label"].as_str());
        let was_missing = name == (Some("instant-radiosity"), Some("16²"))
            || name == (Some("final-gather"), Some("requested 5 %"));
        assert_eq!(is_new, was_missing, "{name:?}");
    }
    assert_eq!(entries(&first).len(), entries(&again).len());
    assert_eq!(again["peers"], first["peers"]);
    assert_eq!(again["direct_only"], first["direct_only"]);
    // At the top: the reference, the best image, its error and the colour scale. Below: two pictures per entry, none for the reference.
    let pictures = page.matches("src=\"data:image/png").count();
    let references = series(&again, "camlux reference").len();
    assert_eq!(pictures, 4 + 2 * (entries(&again).len() - references));

    // A changed scene with the same name is measured again.
    edit(
        &folder.join("cornell.toml"),
        "power_w = 50.",
        "power_w = 60.",
    );
    read(folder, &report());
    assert_eq!(counts().1, 0);
    assert_eq!(fs::read_to_string(&calls).unwrap().lines().count(), 2);
}

#[test]
fn growth_is_the_time_of_each_scene_in_each_size() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scene = scene_file("cornell");
    let scene = scene.to_str().unwrap();
    let mut arguments = vec!["report", scene, scene, "--quick", "--growth", "-o", "out"];
    arguments.extend(SIZE);
    let output = run(folder, &arguments);
    let stderr = stderr(&output);
    assert_eq!(output.status.code(), Some(0), "{stderr}");

    let json = json(&folder.join("out/report.json"));
    let rows = json["growth"].as_array().unwrap();
    let sizes = [[6, 5], [12, 10], [24, 20], [48, 40]];
    assert_eq!(rows.len(), 2 * sizes.len());
    for (index, row) in rows.iter().enumerate() {
        let name = ["cornell", "cornell-2"][index / sizes.len()];
        assert_eq!(row["scene"], name);
        let size = sizes[index % sizes.len()];
        assert_eq!(row["resolution_px"], serde_json::json!(size));
        assert_eq!(row["triangles"], 32);
        assert!(number(&row["seconds"]["median"]) > 0.0);
        assert!(number(&row["ray_count"]) > 0.0);
        assert!(number(&row["estimated_error"]) <= 0.02);
    }
    let page = fs::read_to_string(folder.join("out/index.html")).unwrap();
    for plot in ["triangles", "pixels"] {
        let svg = fs::read_to_string(folder.join(format!("out/growth-{plot}.svg"))).unwrap();
        assert!(page.contains(&svg), "{plot}");
    }
    assert!(!page.contains("How to read this"), "there are no errors");
}

#[test]
fn what_cannot_become_a_report_is_said_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("out"), "a file").unwrap();
    assert_fails(&report(folder, &[]), &["out", "cannot create the folder"]);

    // Every scene is loaded before the first is rendered.
    let scene = scene_file("cornell");
    let scenes = [scene.to_str().unwrap(), "missing.toml"];
    let output = run(folder, &["report", scenes[0], scenes[1], "-o", "other"]);
    assert_fails(&output, &["missing.toml"]);
    let left: Vec<_> = fs::read_dir(folder.join("other")).unwrap().collect();
    assert_eq!(left.len(), 1, "only the folder for references");
}
