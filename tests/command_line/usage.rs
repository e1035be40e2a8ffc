//! Behaviour of the program that needs no device.
#![cfg(feature = "cli")]

use std::fs;

use crate::program::{files, run, stderr, stdout};
use crate::rows::{assert_says, rows};

/// Checks that the program fails with this exit code and message, writes nothing to stdout and leaves no file.
fn assert_fails(arguments: &[&str], exit_code: i32, says: &str) {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), arguments);
    let stderr = stderr(&output);
    assert_eq!(
        output.status.code(),
        Some(exit_code),
        "{arguments:?}: {stderr}"
    );
    assert!(
        stderr.starts_with("camlux: error: "),
        "{arguments:?}: {stderr}"
    );
    assert!(stderr.contains(says), "{arguments:?}: {stderr}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    assert_eq!(files(folder.path()), [""; 0], "{arguments:?}");
    if exit_code == 1 {
        assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
    }
}

fn is_wrong_usage(arguments: &[&str], words: &[&str]) {
    words
        .iter()
        .for_each(|says| assert_fails(arguments, 2, says));
}

#[test]
fn wrong_usage_is_said_with_exit_code_2() {
    rows! { is_wrong_usage;
        ["render", "scene.toml", "-o", "a.exr", "--tracer", "quick"] => "host, query, kernel";
        ["render", "scene.toml"] => "--output";
        ["render", "-o", "a.exr"] => "SCENE.toml";
        ["render", "scene.toml", "-o", "a.exr", "--estimator", "x"] =>
            "[possible values: final-gather, rsm-average, instant-radiosity]";
        ["render", "scene.toml", "-o", "a.exr", "--interpolation-error", "x"] => "'x'";
        ["render", "scene.toml", "-o", "a.exr", "--target-error", "x"] => "'x'";
        ["render", "scene.toml", "-o", "a.exr", "--layers", "direct,x"] => "id.material";
        // Only a reference image has the layer `edge`.
        ["render", "scene.toml", "-o", "a.exr", "--layers", "edge"] =>
            "the layers are radiance, direct, indirect, indirect.1 and so on, emission, stderr, energy, electrons, dn, raw_electrons, raw_dn, P";
        ["render", "scene.toml", "-o", "a.exr", "--size", "-3", "5"] =>
            "'-3' for '--size <WIDTH> <HEIGHT>': give two whole numbers of 1 or more";
        ["render", "scene.toml", "-o", "a.exr", "--rsm-size", "0"] => "'0'";
        ["render", "scene.toml", "--plan", "--png", "a.png"] => "--output";
        ["paint"] => "paint";
    }
}

#[test]
fn unwritable_output_is_said_before_the_scene_is_read() {
    assert_fails(
        &["render", "no-scene.toml", "-o", "missing/a.exr"],
        1,
        "missing/a.exr: cannot write: its folder does not exist",
    );
    assert_fails(
        &[
            "render",
            "no-scene.toml",
            "-o",
            "a.exr",
            "--png",
            "missing/a.png",
        ],
        1,
        "missing/a.png",
    );
    assert_fails(
        &[
            "render",
            "no-scene.toml",
            "-o",
            "a.exr",
            "--stats",
            "missing/a.json",
        ],
        1,
        "missing/a.json",
    );
}

#[test]
fn outputs_need_names_of_their_own() {
    assert_fails(&["render", "no-scene.toml", "-o", "a.png"], 1, ".exr");
    // "-" is stdout for text; images go to files.
    for (output, png) in [("-", "a.png"), ("a.exr", "-"), ("a.exr", "a.jpg")] {
        let arguments = ["render", "no-scene.toml", "-o", output, "--png", png];
        assert_fails(
            &arguments,
            1,
            "an image is written there; end the name in .",
        );
    }
    assert_fails(
        &["render", "no-scene.toml", "-o", "a.exr", "--stats", "a.exr"],
        1,
        "two outputs",
    );
}

#[test]
fn missing_scene_is_named_and_leaves_no_output() {
    assert_fails(
        &[
            "render",
            "no-scene.toml",
            "-o",
            "a.exr",
            "--png",
            "a.png",
            "--stats",
            "a.json",
        ],
        1,
        "no-scene.toml",
    );
}

#[test]
fn help_fits_a_screen_and_has_an_example() {
    let folder = tempfile::tempdir().unwrap();
    let commands = [
        "render",
        "batch",
        "reference",
        "compare",
        "report",
        "doctor",
    ];
    for command in ["", "completions", "man"].into_iter().chain(commands) {
        let arguments: Vec<&str> = [command, "--help"]
            .into_iter()
            .filter(|word| !word.is_empty())
            .collect();
        let output = run(folder.path(), &arguments);
        let help = stdout(&output);
        let widest = help.lines().map(|line| line.chars().count()).max();
        assert!(help.lines().count() <= 40, "{help}");
        assert!(widest <= Some(120), "{widest:?}: {help}");
        assert!(help.contains("Example"), "{help}");
    }
}

#[test]
fn shells_and_man_know_the_commands() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let output = run(folder.path(), &["completions", shell]);
        let script = stdout(&output);
        assert_says(&script, &["render", "target-error"]);
    }
    let output = run(folder.path(), &["man", "pages"]);
    assert!(output.status.success());
    let page = |name: &str| fs::read_to_string(folder.path().join("pages").join(name)).unwrap();
    assert!(page("camlux.1").contains("Measure speed against error"));
    let render = page("camlux-render.1");
    for part in [
        ".TH camlux-render",
        "target\\-error",
        "camlux render scenes/cornell_spot.toml",
    ] {
        assert!(render.contains(part), "{part}: {render}");
    }
    fs::write(folder.path().join("file"), "").unwrap();
    assert_fails(&["man", "/dev/null/pages"], 1, "choose another folder");
}

#[test]
fn help_and_version_go_to_stdout() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [["--help"], ["--version"]] {
        let output = run(folder.path(), &arguments);
        assert!(output.status.success());
        assert!(stdout(&output).contains("camlux"));
        assert!(output.stderr.is_empty());
    }
}
